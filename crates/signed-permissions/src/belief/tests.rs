//! What is believed and what is not, case by case and for anything that may come.

use domain::area::AreaKind;
use domain::geometry::Ned;
use domain::trust::Source;
use proptest::prelude::*;

use super::*;
use crate::key::SecretKey;

const UTC_MS: i64 = 1_700_000_000_000;

fn tower() -> SecretKey {
    SecretKey::of_seed([1; 32]).expect("a seed of 32 bytes makes a key")
}

/// A permission area of this name and size.
fn area(name: &str, size_m: f64) -> Area {
    let corners = [(0.0, 0.0), (size_m, 0.0), (0.0, size_m)].map(|(north, east)| Ned::new(north, east, 0.0)).to_vec();
    Area { ceiling_m: Some(50.0), ..Area::new(name, AreaKind::Permission, corners) }
}

/// Of a vehicle in flight `f1`, in whose mission there is an area A.
fn belief() -> Belief {
    knowing(Some(tower().public()), &["A"])
}

fn knowing(key: Option<PublicKey>, names: &[&str]) -> Belief {
    let mut belief = Belief::new("uav1", "f1".into(), key);
    belief.know_areas(&names.iter().map(|it| area(it, 10.0)).collect());
    belief
}

fn at(s: u64) -> Now {
    Now { time: Time::after(Duration::from_secs(s)), utc_ms: UTC_MS + 1000 * s as i64 }
}

/// A grant for area A in flight `f1`, given at 0 s for 900 s.
fn grant(decision: u64) -> Permission {
    Permission {
        area: "A".into(),
        state: PermissionState::Granted,
        reason: String::new(),
        expires_utc_ms: UTC_MS + 900_000,
        valid_for: Duration::from_secs(900),
        request_id: "mcm-1-p1".into(),
        decision,
        signature: Vec::new(),
        vehicle: "uav1".into(),
        flight: "f1".into(),
        extent: Some(area("A", 10.0).extent()),
    }
}

fn signed(permission: Permission) -> Permission {
    Permission { signature: tower().sign(&permission), ..permission }
}

fn state(state: PermissionState, decision: u64) -> Permission {
    signed(Permission { state, expires_utc_ms: 0, valid_for: Duration::ZERO, ..grant(decision) })
}

/// Takes one line at `s` seconds.
fn take(belief: &mut Belief, s: u64, line: Permission) -> Result<(), Refusal> {
    let taken = belief.take(at(s), Pace::REAL_TIME, vec![line]);
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
    let other_vehicle = || Permission { vehicle: "uav2".into(), ..grant(5) };
    check(signed(other_vehicle()), Err(NotForIt::OtherVehicle("uav2".into()).into()));
    check(Permission { vehicle: "uav1".into(), ..signed(other_vehicle()) }, Err(Refusal::NotTheTowers));
    let other_key = SecretKey::of_seed([2; 32]).unwrap();
    check(Permission { signature: other_key.sign(&grant(5)), ..grant(5) }, Err(Refusal::NotTheTowers));
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
    check(|it| it.vehicle = "uav2".into());
    check(|it| it.flight = "f2".into());
    check(|it| it.extent = None);
    check(|it| it.extent = Some(area("A", 11.0).extent()));
    check(|it| it.extent = it.extent.map(|it| Extent { floor_tenth_mm: Some(0), ..it }));
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
                let stored: Vec<_> = vehicle.stored().collect();
                vehicle = belief();
                stored.into_iter().for_each(|(area, decision, grant)| vehicle.restore(area, decision, grant));
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
    assert_eq!(take(&mut belief, 1000, signed(grant(5))), Err(NotForIt::Expired { since_s: 100 }.into()));
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
        let refused = belief.take(wrong, Pace::REAL_TIME, vec![left(101)]).refused;
        assert_eq!((refused, remaining_s(&belief, 101)), (Vec::new(), Some(799)), "set by {set_s} s");
        // Nor does a repetition that claims more, while the clock is wrong.
        belief.take(wrong, Pace::REAL_TIME, vec![left(0)]);
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
fn a_grant_of_another_flight_or_for_another_place_is_refused_also_after_a_restart() {
    #[track_caller]
    fn check(line: Permission, expected: NotForIt) {
        for restarts in [false, true] {
            let mut vehicle = belief();
            if restarts {
                vehicle = started_again(&vehicle, 1, 0);
            }
            assert_eq!(take(&mut vehicle, 2, signed(line.clone())), Err(expected.clone().into()));
            assert_eq!((remaining_s(&vehicle, 2), vehicle.highest()), (None, 0));
        }
    }
    let (found, present) = ("f0".to_owned(), "f1".to_owned());
    check(Permission { flight: "f0".into(), ..grant(5) }, NotForIt::OtherFlight { found, present });
    check(Permission { extent: Some(area("A", 11.0).extent()), ..grant(5) }, NotForIt::OtherOutline);
    let higher = Area { ceiling_m: Some(60.0), ..area("A", 10.0) };
    check(Permission { extent: Some(higher.extent()), ..grant(5) }, NotForIt::OtherBand);
}

#[test]
fn a_grant_in_advance_is_not_wrong_and_lets_nobody_in() {
    let mut vehicle = belief();
    let in_advance =
        |area: &str| signed(Permission { area: area.into(), flight: String::new(), extent: None, ..grant(5) });
    let taken = vehicle.take(at(0), Pace::REAL_TIME, vec![in_advance("A"), in_advance("elsewhere")]);
    let expected =
        Taken { to_ask: vec![ToAsk { area: "A".into(), decision: 5, why: Why::InAdvance }], ..Taken::default() };
    assert_eq!((taken, remaining_s(&vehicle, 0)), (expected, None));
    assert_eq!((take(&mut vehicle, 1, signed(grant(6))), remaining_s(&vehicle, 1)), (Ok(()), Some(899)));
    assert_eq!(vehicle.take(at(2), Pace::REAL_TIME, vec![in_advance("A")]), Taken::default(), "it is held, and older");
}

#[test]
fn what_is_held_ends_with_the_flight_and_with_the_place_also_where_it_was_stored() {
    for restarts in [false, true] {
        let held = || {
            let mut vehicle = belief();
            take(&mut vehicle, 0, signed(grant(5))).unwrap();
            if restarts { started_again(&vehicle, 1, 0) } else { vehicle }
        };
        assert!(remaining_s(&held(), 1).is_some());
        let mut next_flight = held();
        next_flight.begin_flight("f2".into());
        assert_eq!(remaining_s(&next_flight, 1), None);
        // One that lies elsewhere; one more of this name; none of this name any more.
        for areas in [vec![area("A", 11.0)], vec![area("A", 10.0), area("A", 11.0)], Vec::new()] {
            let mut other_place = held();
            other_place.know_areas(&areas.into());
            assert_eq!(remaining_s(&other_place, 1), None);
            other_place.know_areas(&[area("A", 10.0), area("B", 9.0)].into());
            assert!(remaining_s(&other_place, 1).is_some(), "it is the area that was granted");
        }
    }
}

#[test]
fn a_request_that_a_new_tower_hears_takes_no_grant_away() {
    let mut belief = belief();
    take(&mut belief, 0, signed(grant(5))).unwrap();
    take(&mut belief, 1, state(PermissionState::Requested, 0)).unwrap();
    assert_eq!(remaining_s(&belief, 1), Some(899));
}

#[test]
fn what_a_grant_waits_for_is_news_once() {
    let mut belief = belief();
    let mut check = |s: u64, reason: &str, expected: usize| {
        let line = Permission { reason: reason.into(), ..state(PermissionState::Requested, 0) };
        let taken = belief.take(at(s), Pace::REAL_TIME, vec![signed(line)]);
        assert_eq!((taken.decided.len(), taken.refused), (expected, Vec::new()), "{reason} at {s} s");
    };
    check(0, "", 0);
    check(1, "the rotor still turns", 1);
    check(2, "the rotor still turns", 0);
    check(3, "the deck is occupied", 1);
    check(4, "", 0);
}

#[test]
fn without_a_key_all_but_the_signature_counts() {
    let mut belief = knowing(None, &["A"]);
    assert_eq!(take(&mut belief, 0, grant(5)), Ok(()));
    let refused = |line: Permission, expected: NotForIt| {
        let mut belief = knowing(None, &["A"]);
        take(&mut belief, 0, grant(5)).unwrap();
        assert_eq!(take(&mut belief, 1, line), Err(expected.into()));
    };
    refused(grant(4), NotForIt::Replayed { found: 4, latest: 5 });
    refused(Permission { vehicle: "uav2".into(), ..grant(6) }, NotForIt::OtherVehicle("uav2".into()));
    refused(Permission { extent: Some(area("A", 11.0).extent()), ..grant(6) }, NotForIt::OtherOutline);
    refused(Permission { expires_utc_ms: UTC_MS, ..grant(6) }, NotForIt::Expired { since_s: 1 });
}

#[test]
fn names_from_the_network_do_not_fill_the_memory() {
    let mut belief = knowing(None, &[]);
    for n in 0..2 * MAX_AREAS {
        let _ = take(&mut belief, 0, Permission { area: n.to_string(), ..grant(5) });
    }
    assert_eq!((belief.areas().count(), belief.stored().count()), (MAX_AREAS, MAX_AREAS));
}

#[test]
fn areas_of_which_nothing_is_granted_any_more_make_room_and_no_old_grant_comes_back() {
    for restarts in [false, true] {
        let last = 2 * MAX_AREAS as u64;
        let of_mission = || knowing(None, &["area 0", "area 1", &format!("area {last}")]);
        let mut vehicle = of_mission();
        let line = |n: u64, decision| Permission { area: format!("area {n}"), ..grant(decision) };
        let denied = |n: u64, decision| Permission { state: PermissionState::Denied, ..line(n, decision) };
        take(&mut vehicle, 0, line(0, 1)).unwrap();
        for n in 1..last {
            assert_eq!(take(&mut vehicle, 0, denied(n, n + 10)), Ok(()), "area {n}");
        }
        assert_eq!(vehicle.stored().count(), MAX_AREAS);
        assert!(remaining_area(&vehicle, "area 0"), "a grant is not forgotten");
        if restarts {
            let stored: Vec<_> = vehicle.stored().collect();
            vehicle = of_mission();
            stored.into_iter().for_each(|(area, decision, grant)| vehicle.restore(area, decision, grant));
            vehicle.begin(at(0), Pace::REAL_TIME);
        }
        let replayed = take(&mut vehicle, 0, line(1, 5)).unwrap_err();
        assert!(matches!(replayed, Refusal::NotForIt(NotForIt::Replayed { found: 5, .. })), "{replayed}");
        assert!(!remaining_area(&vehicle, "area 1"));
        let old = Permission { state: PermissionState::Requested, ..line(last, 0) };
        assert_eq!(take(&mut vehicle, 0, old), Ok(()), "a request is not a decision yet");
        assert_eq!(take(&mut vehicle, 0, line(last, last + 10)), Ok(()));
        assert!(remaining_area(&vehicle, &format!("area {last}")) && remaining_area(&vehicle, "area 0"));
        assert_eq!(vehicle.stored().count(), MAX_AREAS);
    }
}

fn remaining_area(belief: &Belief, area: &str) -> bool {
    belief.remaining(area, at(0).time).is_some()
}

fn any_permission() -> impl Strategy<Value = Permission> {
    use PermissionState::*;
    let state = prop::sample::select(vec![Requested, Granted, Denied, Revoked, Expired]);
    let text = || "[a-c]{0,2}";
    let extent = any::<Option<([u8; 32], Option<i64>, Option<i64>)>>();
    ((text(), text(), text(), text(), text()), state, any::<i64>(), any::<u32>(), any::<u64>(), extent).prop_map(
        |((area, reason, request_id, vehicle, flight), state, expires_utc_ms, valid_ms, decision, extent)| Permission {
            area,
            state,
            reason,
            expires_utc_ms,
            valid_for: Duration::from_millis(valid_ms.into()),
            request_id,
            decision,
            signature: Vec::new(),
            vehicle,
            flight,
            extent: extent.map(|(outline, floor_tenth_mm, ceiling_tenth_mm)| Extent {
                outline,
                floor_tenth_mm,
                ceiling_tenth_mm,
            }),
        },
    )
}

proptest! {
    #[test]
    fn a_signature_is_under_one_statement_only(first in any_permission(), other in any_permission(), changed in 0..11u8) {
        let signature = tower().sign(&first);
        let mut second = first.clone();
        match changed {
            0 => second.area = other.area,
            1 => second.state = other.state,
            2 => second.reason = other.reason,
            3 => second.expires_utc_ms = other.expires_utc_ms,
            4 => second.valid_for = other.valid_for,
            5 => second.request_id = other.request_id,
            6 => second.decision = other.decision,
            7 => second.vehicle = other.vehicle,
            8 => second.flight = other.flight,
            9 => second.extent = other.extent,
            _ => second = other,
        }
        let is_same = first == Permission { valid_for: first.valid_for, ..second.clone() };
        let verified = tower().public().verifies(&Permission { signature: signature.clone(), ..second });
        prop_assert_eq!(verified, is_same);
        let verified = tower().public().verifies(&Permission { signature, ..first });
        prop_assert!(verified);
    }

    #[test]
    fn a_signature_of_which_a_bit_was_changed_is_none(permission in any_permission(), bit in 0..512usize) {
        let mut signature = tower().sign(&permission);
        signature[bit / 8] ^= 1 << (bit % 8);
        let verified = tower().public().verifies(&Permission { signature, ..permission });
        prop_assert!(!verified);
    }

    #[test]
    fn what_is_refused_is_not_held(permission in any_permission(), s in 0..10_000u64) {
        let line = Permission { area: "A".into(), ..permission };
        let mut belief = belief();
        let taken = belief.take(at(s), Pace::REAL_TIME, vec![line.clone(), Permission { decision: 1, ..line }]);
        prop_assert_eq!(taken.refused.len(), 2);
        prop_assert_eq!(belief.remaining("A", at(s).time), None);
        prop_assert_eq!(belief.stored().count(), 0);
    }
}

/// A belief that goes on at `s` seconds from what another one has stored; the clock was set by `set_ms` meanwhile.
fn started_again(before: &Belief, s: u64, set_ms: i64) -> Belief {
    let mut after = belief();
    before.stored().for_each(|(area, decision, grant)| after.restore(area, decision, grant));
    // Mission time begins again.
    after.begin(Now { time: Time::ZERO, utc_ms: at(s).utc_ms + set_ms }, Pace::REAL_TIME);
    after
}

#[test]
fn a_grant_is_believed_over_a_restart_until_its_end() {
    /// `expected_s`: the remaining time after a restart at `s` seconds.
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
        // By a clock that was set, no time would be left.
        let mut after = started_again(&before, 100, 3_600_000);
        take(&mut after, 100, line).unwrap();
        assert_eq!(remaining_s(&after, 100), expected_s);
    }
    check(signed(Permission { valid_for: Duration::from_secs(800), ..grant(1) }), Some(800));
    check(state(PermissionState::Revoked, 2), None);
    check(state(PermissionState::Denied, 2), None);
}

#[test]
fn what_was_denied_or_revoked_last_is_closed() {
    use PermissionState::{Denied, Expired, Revoked};
    #[track_caller]
    fn check(lines: &[Permission], expected: Option<u64>) {
        let mut before = belief();
        lines.iter().for_each(|it| take(&mut before, 0, it.clone()).unwrap());
        let closed = |it: &Belief| it.closed().map(|(area, decision)| (area.to_owned(), decision)).collect::<Vec<_>>();
        let expected: Vec<_> = expected.map(|it| ("A".to_owned(), it)).into_iter().collect();
        assert_eq!(closed(&before), expected, "{lines:?}");
        assert_eq!(closed(&started_again(&before, 1, 0)), expected, "{lines:?}");
    }
    check(&[], None);
    check(&[state(Denied, 1)], Some(1));
    check(&[signed(grant(1))], None);
    check(&[signed(grant(1)), state(Revoked, 2)], Some(2));
    check(&[state(Denied, 1), signed(grant(2))], None);
    let mut expired = belief();
    take(&mut expired, 0, signed(grant(1))).unwrap();
    take(&mut expired, 901, state(Expired, 1)).unwrap();
    assert_eq!(expired.closed().count(), 0);
}

fn source(belief: &Belief) -> Option<Source> {
    belief.decided("A").map(|it| it.source)
}

/// The tower may have revoked it while nobody listened, and somebody plays what was heard before.
#[test]
fn after_a_restart_a_grant_of_before_is_one_to_stay_until_the_tower_has_decided_again() {
    let mut before = belief();
    take(&mut before, 0, signed(grant(5))).unwrap();
    assert_eq!(source(&before), Some(Source::Live));
    let mut after = started_again(&before, 100, 0);
    for s in [101, 102] {
        let repeated = Permission { valid_for: Duration::from_secs(900 - s), ..grant(5) };
        let taken = after.take(at(s), Pace::REAL_TIME, vec![signed(repeated)]);
        assert_eq!(taken.to_ask, [ToAsk { area: "A".into(), decision: 5, why: Why::BeforeTheStart }]);
        assert_eq!((source(&after), remaining_s(&after, s)), (Some(Source::Restored), Some(900 - s)));
    }
    let taken = after.take(at(103), Pace::REAL_TIME, vec![signed(grant(6))]);
    assert_eq!((taken.to_ask, source(&after), remaining_s(&after, 103)), (Vec::new(), Some(Source::Live), Some(797)));
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
    belief.take(now, Pace::REAL_TIME, vec![signed(Permission { valid_for: Duration::from_secs(880), ..grant(1) })]);
    assert_eq!(belief.stored_grant("A").map(|it| it.until_utc_ms), Some(UTC_MS - 80_000 + 879_900));
    take(&mut belief, 30, state(PermissionState::Revoked, 2)).unwrap();
    assert_eq!(belief.stored_grant("A"), None);
}
