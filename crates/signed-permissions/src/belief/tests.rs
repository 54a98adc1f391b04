//! What is believed and what is not, case by case and for anything that may come.

use proptest::prelude::*;

use super::*;
use crate::key::SecretKey;

const UTC_MS: i64 = 1_700_000_000_000;

fn tower() -> SecretKey {
    SecretKey::of_seed([1; 32]).expect("a seed of 32 bytes makes a key")
}

fn belief() -> Belief {
    Belief::new("uav1", Some(tower().public()))
}

fn at(s: u64) -> Now {
    Now { time: Time::after(Duration::from_secs(s)), utc_ms: UTC_MS + 1000 * s as i64 }
}

/// A grant for area A, given at 0 s for 900 s, for plan 3.
fn grant(decision: u64) -> Permission {
    Permission {
        area: "A".into(),
        state: PermissionState::Granted,
        reason: String::new(),
        expires_utc_ms: UTC_MS + 900_000,
        valid_for: Duration::from_secs(900),
        request_id: "mcm-1-p1".into(),
        decision,
        plan_revision: 3,
        signature: Vec::new(),
    }
}

fn signed(permission: Permission) -> Permission {
    Permission { signature: tower().sign("uav1", &permission), ..permission }
}

fn state(state: PermissionState, decision: u64) -> Permission {
    signed(Permission { state, expires_utc_ms: 0, valid_for: Duration::ZERO, ..grant(decision) })
}

/// Takes one line at `s` seconds.
fn take(belief: &mut Belief, s: u64, line: Permission) -> Result<(), Refusal> {
    let taken = belief.take(at(s), Pace::REAL_TIME, 3, vec![line]);
    taken.refused.into_iter().next().map_or(Ok(()), |(_, refusal)| Err(refusal))
}

fn remaining_s(belief: &Belief, s: u64) -> Option<u64> {
    belief.remaining("A", at(s).time).map(|it| it.as_secs())
}

#[test]
fn what_the_tower_has_not_signed_for_this_vehicle_is_refused() {
    #[track_caller]
    fn check(line: Permission, expected: Result<(), Refusal>) {
        let mut belief = belief();
        assert_eq!(take(&mut belief, 0, line), expected);
        assert_eq!(remaining_s(&belief, 0).is_some(), expected.is_ok());
    }
    check(signed(grant(5)), Ok(()));
    check(grant(5), Err(Refusal::Unsigned));
    let other_vehicle = Permission { signature: tower().sign("uav2", &grant(5)), ..grant(5) };
    check(other_vehicle, Err(Refusal::NotTheTowers));
    let other_key = SecretKey::of_seed([2; 32]).unwrap();
    check(Permission { signature: other_key.sign("uav1", &grant(5)), ..grant(5) }, Err(Refusal::NotTheTowers));
}

#[test]
fn a_line_that_was_changed_is_refused() {
    #[track_caller]
    fn check(change: impl Fn(&mut Permission)) {
        let mut line = signed(grant(5));
        change(&mut line);
        assert_eq!(take(&mut belief(), 0, line), Err(Refusal::NotTheTowers));
    }
    check(|it| it.area = "B".into());
    check(|it| it.state = PermissionState::Revoked);
    check(|it| it.reason = "fog".into());
    check(|it| it.expires_utc_ms += 1);
    check(|it| it.request_id.push('1'));
    check(|it| it.decision += 1);
    check(|it| it.plan_revision -= 1);
    check(|it| it.signature[10] ^= 1);
    check(|it| it.signature.truncate(63));
}

#[test]
fn a_grant_is_not_believed_after_a_later_decision_also_not_after_a_restart() {
    for later in [PermissionState::Revoked, PermissionState::Denied] {
        for restarts in [false, true] {
            let mut vehicle = belief();
            take(&mut vehicle, 0, signed(grant(5))).unwrap();
            take(&mut vehicle, 1, state(later, 6)).unwrap();
            if restarts {
                let latest = vehicle.latest().clone();
                vehicle = belief();
                vehicle.restore(latest);
            }
            let refusal = take(&mut vehicle, 2, signed(grant(5))).unwrap_err();
            assert_eq!(refusal.to_string(), "a later decision than number 5 is known: 6");
            assert_eq!(remaining_s(&vehicle, 2), None);
            take(&mut vehicle, 3, signed(grant(7))).unwrap();
            assert_eq!(remaining_s(&vehicle, 3), Some(897));
        }
    }
}

#[test]
fn a_grant_ends_with_its_window_however_often_and_late_it_is_sent() {
    let mut belief = belief();
    assert_eq!(take(&mut belief, 1000, signed(grant(5))), Err(Refusal::Expired { since_s: 100 }));
    take(&mut belief, 10, Permission { valid_for: Duration::from_secs(5000), ..signed(grant(5)) }).unwrap();
    assert_eq!(remaining_s(&belief, 10), Some(890), "`valid_for` is not signed, and bounded by what is");
    take(&mut belief, 20, Permission { valid_for: Duration::from_secs(30), ..signed(grant(5)) }).unwrap();
    take(&mut belief, 21, signed(grant(5))).unwrap();
    assert_eq!(remaining_s(&belief, 21), Some(29), "a repetition prolongs nothing");
    assert_eq!(take(&mut belief, 950, signed(grant(5))), Ok(()), "it is known, and has ended");
    assert_eq!(remaining_s(&belief, 950), None);
}

#[test]
fn a_clock_that_is_set_cuts_no_grant_that_is_held_and_prolongs_none() {
    for set_s in [700, 3600, -700, -1_000_000] {
        let mut belief = belief();
        let left = |s: u64| signed(Permission { valid_for: Duration::from_secs(900 - s), ..grant(5) });
        take(&mut belief, 100, left(100)).unwrap();
        let wrong = Now { utc_ms: at(101).utc_ms + 1000 * set_s, ..at(101) };
        let refused = belief.take(wrong, Pace::REAL_TIME, 3, vec![left(101)]).refused;
        assert_eq!((refused, remaining_s(&belief, 101)), (Vec::new(), Some(799)), "set by {set_s} s");
        // Nor does a repetition that claims more, while the clock is wrong.
        belief.take(wrong, Pace::REAL_TIME, 3, vec![left(0)]);
        assert_eq!(remaining_s(&belief, 101), Some(799), "set by {set_s} s");
        take(&mut belief, 102, left(102)).unwrap();
        assert_eq!(remaining_s(&belief, 102), Some(798), "set by {set_s} s, and corrected");
        assert_eq!(remaining_s(&belief, 900), None);
    }
}

#[test]
fn a_grant_that_has_expired_for_the_tower_has_expired() {
    let mut belief = belief();
    take(&mut belief, 0, signed(grant(5))).unwrap();
    take(&mut belief, 1, state(PermissionState::Expired, 5)).unwrap();
    take(&mut belief, 2, signed(grant(5))).unwrap();
    assert_eq!(remaining_s(&belief, 2), None);
}

#[test]
fn a_grant_for_a_plan_that_was_never_made_is_refused() {
    let line = signed(Permission { plan_revision: 4, ..grant(5) });
    assert_eq!(take(&mut belief(), 0, line), Err(Refusal::UnknownPlan { found: 4, newest: 3 }));
    assert_eq!(take(&mut belief(), 0, signed(Permission { plan_revision: 0, ..grant(5) })), Ok(()), "by hand");
}

#[test]
fn a_request_that_a_new_tower_hears_takes_no_grant_away() {
    let mut belief = belief();
    take(&mut belief, 0, signed(grant(5))).unwrap();
    take(&mut belief, 1, state(PermissionState::Requested, 0)).unwrap();
    assert_eq!(remaining_s(&belief, 1), Some(899));
}

#[test]
fn without_a_key_only_the_order_of_decisions_counts() {
    let mut belief = Belief::new("uav1", None);
    let line = Permission { expires_utc_ms: 0, plan_revision: 99, ..grant(5) };
    assert_eq!(take(&mut belief, 0, line.clone()), Ok(()));
    assert_eq!(
        take(&mut belief, 1, Permission { decision: 4, ..line }),
        Err(Refusal::Replayed { found: 4, latest: 5 })
    );
}

#[test]
fn names_from_the_network_do_not_fill_the_memory() {
    let mut belief = Belief::new("uav1", None);
    for n in 0..2 * MAX_AREAS {
        let _ = take(&mut belief, 0, Permission { area: n.to_string(), ..grant(5) });
    }
    assert_eq!((belief.areas().count(), belief.latest().len()), (MAX_AREAS, MAX_AREAS));
}

#[test]
fn areas_of_which_nothing_is_granted_any_more_make_room_and_no_old_grant_comes_back() {
    for restarts in [false, true] {
        let mut vehicle = Belief::new("uav1", None);
        let line = |n: u64, decision| Permission { area: format!("area {n}"), ..grant(decision) };
        let denied = |n: u64, decision| Permission { state: PermissionState::Denied, ..line(n, decision) };
        take(&mut vehicle, 0, line(0, 1)).unwrap();
        let last = 2 * MAX_AREAS as u64;
        for n in 1..last {
            assert_eq!(take(&mut vehicle, 0, denied(n, n + 10)), Ok(()), "area {n}");
        }
        assert_eq!(vehicle.latest().len(), MAX_AREAS);
        assert!(remaining_area(&vehicle, "area 0"), "a grant is not forgotten");
        if restarts {
            let latest = vehicle.latest().clone();
            let grant = vehicle.stored_grant("area 0").unwrap();
            vehicle = Belief::new("uav1", None);
            vehicle.restore(latest);
            vehicle.restore_grant("area 0".to_owned(), grant);
            vehicle.begin(at(0), Pace::REAL_TIME);
        }
        let replayed = take(&mut vehicle, 0, line(1, 5)).unwrap_err();
        assert!(matches!(replayed, Refusal::Replayed { found: 5, .. }), "{replayed}");
        assert!(!remaining_area(&vehicle, "area 1"));
        let old = Permission { state: PermissionState::Requested, ..line(last, 0) };
        assert_eq!(take(&mut vehicle, 0, old), Ok(()), "a request is no decision yet");
        assert_eq!(take(&mut vehicle, 0, line(last, last + 10)), Ok(()));
        assert!(remaining_area(&vehicle, &format!("area {last}")) && remaining_area(&vehicle, "area 0"));
        assert_eq!(vehicle.latest().len(), MAX_AREAS);
    }
}

fn remaining_area(belief: &Belief, area: &str) -> bool {
    belief.remaining(area, at(0).time).is_some()
}

fn any_permission() -> impl Strategy<Value = Permission> {
    use PermissionState::*;
    let state = prop::sample::select(vec![Requested, Granted, Denied, Revoked, Expired]);
    let texts = ("[a-c]{0,3}", "[a-c]{0,3}", "[a-c]{0,3}");
    (texts, state, any::<i64>(), any::<u32>(), any::<u64>(), any::<u64>()).prop_map(
        |((area, reason, request_id), state, expires_utc_ms, valid_ms, decision, plan_revision)| Permission {
            area,
            state,
            reason,
            expires_utc_ms,
            valid_for: Duration::from_millis(valid_ms.into()),
            request_id,
            decision,
            plan_revision,
            signature: Vec::new(),
        },
    )
}

proptest! {
    #[test]
    fn a_signature_is_under_one_statement_only(
        (vehicle, first) in ("[a-c]{0,3}", any_permission()),
        (other_vehicle, second) in ("[a-c]{0,3}", any_permission()),
    ) {
        let signature = tower().sign(&vehicle, &first);
        let is_same = vehicle == other_vehicle
            && first == Permission { valid_for: first.valid_for, ..second.clone() };
        let verified = tower().public().verifies(&other_vehicle, &Permission { signature: signature.clone(), ..second });
        prop_assert_eq!(verified, is_same);
        let verified = tower().public().verifies(&vehicle, &Permission { signature, ..first });
        prop_assert!(verified);
    }

    #[test]
    fn a_signature_of_which_a_bit_was_changed_is_none(permission in any_permission(), bit in 0..512usize) {
        let mut signature = tower().sign("uav1", &permission);
        signature[bit / 8] ^= 1 << (bit % 8);
        let verified = tower().public().verifies("uav1", &Permission { signature, ..permission });
        prop_assert!(!verified);
    }

    #[test]
    fn what_is_refused_is_not_held(permission in any_permission(), newest in any::<u64>(), s in 0..10_000u64) {
        let line = Permission { area: "A".into(), ..permission };
        let mut belief = belief();
        let taken = belief.take(at(s), Pace::REAL_TIME, newest, vec![line.clone(), Permission { decision: 1, ..line }]);
        prop_assert_eq!(taken.refused.len(), 2);
        prop_assert_eq!(belief.remaining("A", at(s).time), None);
        prop_assert!(belief.latest().is_empty());
    }
}

/// A belief that goes on at `s` seconds from what another one has stored; the clock was set by `set_ms` meanwhile.
fn started_again(before: &Belief, s: u64, set_ms: i64) -> Belief {
    let mut after = belief();
    after.restore(before.latest().clone());
    for area in before.latest().keys() {
        if let Some(grant) = before.stored_grant(area) {
            after.restore_grant(area.clone(), grant);
        }
    }
    // Mission time begins again.
    after.begin(Now { time: Time::ZERO, utc_ms: at(s).utc_ms + set_ms }, Pace::REAL_TIME);
    after
}

#[test]
fn a_grant_is_believed_over_a_restart_until_its_end() {
    /// `expected_s`: what remains of it after a restart at `s` seconds.
    #[track_caller]
    fn check(line: Permission, s: u64, set_ms: i64, expected_s: Option<u64>) {
        let mut before = belief();
        take(&mut before, 0, line).unwrap();
        let after = started_again(&before, s, set_ms);
        assert_eq!(remaining_s(&after, 0), expected_s);
        // A second death before anything is heard changes nothing.
        assert_eq!(after.stored_grant("A"), before.stored_grant("A"));
    }
    check(signed(grant(1)), 100, 0, Some(800));
    check(signed(grant(1)), 899, 0, Some(1));
    check(signed(grant(1)), 900, 0, None);
    check(state(PermissionState::Revoked, 1), 1, 0, None);
    // A clock that was set back gives no more than there was.
    check(signed(grant(1)), 100, -3_600_000, Some(900));
    check(signed(grant(1)), 100, 3_600_000, None);
}

#[test]
fn what_the_tower_says_counts_more_than_what_is_remembered() {
    #[track_caller]
    fn check(line: Permission, expected_s: Option<u64>) {
        let mut before = belief();
        take(&mut before, 0, signed(grant(1))).unwrap();
        // By a clock that was set, nothing would be left of it.
        let mut after = started_again(&before, 100, 3_600_000);
        take(&mut after, 100, line).unwrap();
        assert_eq!(remaining_s(&after, 100), expected_s);
    }
    check(signed(Permission { valid_for: Duration::from_secs(800), ..grant(1) }), Some(800));
    check(state(PermissionState::Revoked, 2), None);
    check(state(PermissionState::Denied, 2), None);
}

#[test]
fn what_is_stored_changes_with_a_decision_or_a_clock_and_not_with_each_ledger() {
    let mut belief = belief();
    take(&mut belief, 0, signed(grant(1))).unwrap();
    let first = belief.stored_grant("A").unwrap();
    assert_eq!((first.until_utc_ms, first.longest.as_secs()), (UTC_MS + 900_000, 900));
    take(&mut belief, 10, signed(Permission { valid_for: Duration::from_millis(889_900), ..grant(1) })).unwrap();
    assert_eq!(belief.stored_grant("A"), Some(first));
    // The clock goes wrong by 100 s, and what is left by mission time stays the same.
    let now = Now { utc_ms: UTC_MS - 80_000, ..at(20) };
    belief.take(now, Pace::REAL_TIME, 3, vec![signed(Permission { valid_for: Duration::from_secs(880), ..grant(1) })]);
    assert_eq!(belief.stored_grant("A").map(|it| it.until_utc_ms), Some(UTC_MS - 80_000 + 879_900));
    take(&mut belief, 30, state(PermissionState::Revoked, 2)).unwrap();
    assert_eq!(belief.stored_grant("A"), None);
}
