//! Permissions that are signed, and those that only look like it.

use domain::permission::{Permission, PermissionState};
use kittiwake_proto::v1;
use kittiwake_proto::v1::FlightMode::Loiter;
use signed_permissions::key::SecretKey;

use crate::stories::fly;
use crate::stories::rig::{Rig, plan, step};

fn tower() -> SecretKey {
    SecretKey::of_seed([1; 32]).expect("32 bytes make a key")
}

/// A vehicle in the air before area A, for which it has asked with plan 0.
fn before_a() -> Rig {
    let mut rig = Rig::new().that_verifies_with(tower().public());
    rig.vehicle(true, Loiter, (0.0, 0.0, 10.0));
    rig.plan(plan(&[step(1, fly(80.0), &["A"]), step(2, fly(500.0), &[])]));
    rig.execute();
    rig.next(Some(step(2, fly(500.0), &[])));
    rig.story();
    rig.decisions.clear();
    rig
}

fn line(state: PermissionState, decision: u64) -> v1::Permission {
    v1::Permission {
        area: "A".into(),
        state: v1::PermissionState::from(state) as i32,
        expires_utc_ms: 900_000,
        valid_for_s: 900.0,
        decision,
        ..Default::default()
    }
}

/// Signed with this key for this vehicle.
fn signed(key: &SecretKey, vehicle: &str, line: v1::Permission) -> v1::Permission {
    let signature = key.sign(vehicle, &Permission::try_from(line.clone()).expect("it makes sense"));
    v1::Permission { signature, ..line }
}

fn say(rig: &mut Rig, line: v1::Permission) {
    rig.say(v1::PermissionLedger { permissions: vec![line], ..Default::default() });
}

#[test]
fn each_forged_permission_is_recorded_once_and_flown_by_never() {
    use PermissionState::Granted;
    #[track_caller]
    fn check(forged: v1::Permission, expected: &str) {
        let mut rig = before_a();
        for _ in 0..3 {
            say(&mut rig, forged.clone());
        }
        assert_eq!(rig.decisions, [format!("area A: a permission is not believed: {expected}")]);
        assert_eq!(
            rig.story(),
            vec![format!("permission/ledger refused: area A: {expected}"); 3].join("\n"),
            "counted"
        );
        say(&mut rig, signed(&tower(), "uav1", line(Granted, 9)));
        assert_eq!(rig.story(), "start fly 0 500 10, giving up 1\ndone 1", "the tower's own is believed");
    }
    let foreign = SecretKey::of_seed([2; 32]).expect("32 bytes make a key");
    let not_the_towers = "its signature is not the tower's for this vehicle";
    check(line(Granted, 5), "it is not signed");
    check(signed(&foreign, "uav1", line(Granted, 5)), not_the_towers);
    check(signed(&tower(), "uav2", line(Granted, 5)), not_the_towers);
    check(v1::Permission { decision: 6, ..signed(&tower(), "uav1", line(Granted, 5)) }, not_the_towers);
    let expired = v1::Permission { expires_utc_ms: -7000, ..line(Granted, 5) };
    check(signed(&tower(), "uav1", expired), "it expired 7 s ago");
    let of_the_future = v1::Permission { plan_revision: 8, ..line(Granted, 5) };
    check(signed(&tower(), "uav1", of_the_future), "it was given for plan 8, and the newest is 0");
}

#[test]
fn a_grant_before_a_revocation_is_not_believed_after_a_restart_either() {
    use PermissionState::{Granted, Revoked};
    let mut rig = before_a();
    say(&mut rig, signed(&tower(), "uav1", line(Revoked, 6)));
    let mut rig = rig.started_again().that_verifies_with(tower().public());
    say(&mut rig, signed(&tower(), "uav1", line(Granted, 5)));
    let said = rig.decisions.join("\n");
    assert!(said.contains("not believed: a later decision than number 5 is known: 6"), "{said}");
    say(&mut rig, signed(&tower(), "uav1", line(Granted, 7)));
    assert!(rig.decisions.join("\n").contains("area A: granted"), "{:?}", rig.decisions);
}

#[test]
fn a_revocation_with_a_lower_number_than_the_grant_makes_the_vehicle_ask_and_is_recorded_once() {
    use PermissionState::{Granted, Revoked};
    let mut rig = before_a();
    say(&mut rig, signed(&tower(), "uav1", line(Granted, 5)));
    rig.story();
    rig.decisions.clear();
    for _ in 0..3 {
        say(&mut rig, signed(&tower(), "uav1", line(Revoked, 4)));
    }
    let said = "area A: a decision is not believed: number 4 says no, and a later decision is known: 5; the tower is asked again";
    assert_eq!(rig.decisions, [said]);
    assert_eq!(rig.story(), "ask A");
    // A recording comes again and again; a tower that has lost its numbers would have answered by now.
    let mut asked = 1;
    for _ in 0..10 {
        rig.wait(11.0);
        say(&mut rig, signed(&tower(), "uav1", line(Revoked, 4)));
        asked += rig.story().matches("ask A").count();
    }
    assert_eq!((asked, rig.decisions.len()), (3, 1), "asked as often as any request is sent");
}
