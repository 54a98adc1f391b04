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

/// Signed with this key for what the vehicle needs, but as far as the line says something else.
fn signed(key: &SecretKey, rig: &Rig, mut line: v1::Permission) -> v1::Permission {
    rig.complete(&mut line);
    let signature = key.sign(&Permission::try_from(line.clone()).expect("it makes sense"));
    v1::Permission { signature, ..line }
}

fn say(rig: &mut Rig, line: v1::Permission) {
    rig.say(v1::PermissionLedger { permissions: vec![line], ..Default::default() });
}

fn say_signed(rig: &mut Rig, line: v1::Permission) {
    let line = signed(&tower(), rig, line);
    say(rig, line);
}

#[test]
fn each_forged_permission_is_recorded_once_and_flown_by_never() {
    use PermissionState::Granted;
    #[track_caller]
    fn check(forge: impl FnOnce(&Rig) -> v1::Permission, expected: &str) {
        let mut rig = before_a();
        let forged = forge(&rig);
        for _ in 0..3 {
            say(&mut rig, forged.clone());
        }
        assert_eq!(rig.decisions, [format!("area A: a permission is not believed: {expected}")]);
        assert_eq!(
            rig.story(),
            vec![format!("permission/ledger refused: area A: {expected}"); 3].join("\n"),
            "counted"
        );
        let own = signed(&tower(), &rig, line(Granted, 9));
        say(&mut rig, own);
        assert_eq!(rig.story(), "start fly 0 500 10, giving up 1", "the tower's own is believed");
    }
    let foreign = SecretKey::of_seed([2; 32]).expect("32 bytes make a key");
    let not_the_towers = "its signature is not the tower's";
    check(|_| line(Granted, 5), "it is not signed");
    check(|rig| signed(&foreign, rig, line(Granted, 5)), not_the_towers);
    check(|rig| v1::Permission { decision: 6, ..signed(&tower(), rig, line(Granted, 5)) }, not_the_towers);
    let check_signed = |line: v1::Permission, expected: &str| check(|rig| signed(&tower(), rig, line), expected);
    let of_another = v1::Permission { vehicle: "uav2".into(), ..line(Granted, 5) };
    check_signed(of_another, "it was given to vehicle `uav2`");
    check_signed(v1::Permission { expires_utc_ms: -7000, ..line(Granted, 5) }, "it expired 7 s ago");
    let of_another_flight = v1::Permission { flight: "0-0".into(), ..line(Granted, 5) };
    check_signed(of_another_flight, "it was given for another flight, `0-0`, and this is `1-0`");
    let extent = Some(v1::AreaExtent { outline: vec![1; 32], ..Default::default() });
    check_signed(v1::Permission { extent, ..line(Granted, 5) }, "it was given for another area of the same name");
}

#[test]
fn a_grant_before_a_revocation_is_not_believed_after_a_restart_either() {
    use PermissionState::{Granted, Revoked};
    let mut rig = before_a();
    say_signed(&mut rig, line(Revoked, 6));
    let mut rig = rig.started_again().that_verifies_with(tower().public());
    say_signed(&mut rig, line(Granted, 5));
    let said = rig.decisions.join("\n");
    assert!(said.contains("not believed: a later decision than number 5 is known: 6"), "{said}");
    say_signed(&mut rig, line(Granted, 7));
    assert!(rig.decisions.join("\n").contains("area A: granted"), "{:?}", rig.decisions);
}

#[test]
fn a_revocation_with_a_lower_number_than_the_grant_makes_the_vehicle_ask_and_is_recorded_once() {
    use PermissionState::{Granted, Revoked};
    let mut rig = before_a();
    say_signed(&mut rig, line(Granted, 5));
    rig.story();
    rig.decisions.clear();
    for _ in 0..3 {
        say_signed(&mut rig, line(Revoked, 4));
    }
    let said = "area A: a decision is not believed: number 4 says no, and a later decision is known: 5; the tower is asked again";
    assert_eq!(rig.decisions, [said]);
    assert_eq!(rig.story(), "ask A");
    // A recording comes again and again; a tower that has lost its numbers would have answered by now.
    let mut asked = 1;
    for _ in 0..10 {
        rig.wait(11.0);
        say_signed(&mut rig, line(Revoked, 4));
        asked += rig.story().matches("ask A").count();
    }
    assert_eq!((asked, rig.decisions.len()), (3, 1), "asked as often as any request is sent");
}
