use super::*;

/// On the ground, disarmed.
const PARKED: Evidence = Evidence {
    armed: Some(false),
    lands: false,
    may_land: false,
    landed: Some(true),
    height_m: Some(0.0),
    speed_m_s: Some(0.0),
    vertical_m_s: Some(0.0),
};
const ARMED: Evidence = Evidence { armed: Some(true), ..PARKED };

fn at(height_m: f64) -> Evidence {
    Evidence { landed: Some(false), height_m: Some(height_m), speed_m_s: Some(2.0), vertical_m_s: Some(2.0), ..ARMED }
}

/// Moves or rests in the landing mode at this height.
fn landing(height_m: f64, landed: Option<bool>, speed_m_s: f64) -> Evidence {
    Evidence { lands: true, landed, speed_m_s: Some(speed_m_s), vertical_m_s: Some(speed_m_s), ..at(height_m) }
}

/// What is seen, each for a number of seconds, and whether the vehicle flies at the end.
#[track_caller]
fn check(seen: &[(u64, Evidence)], expected: Option<bool>) -> FlightState {
    let mut state = FlightState::default();
    let mut now = Time::ZERO;
    for (seconds, evidence) in seen {
        for _ in 0..seconds * 10 {
            state.update(now, *evidence);
            now = now + Duration::from_millis(100);
        }
    }
    assert_eq!(state.flying(), expected, "{seen:?}");
    state
}

#[test]
fn each_combination_of_what_may_be_known_is_a_majority_of_three() {
    let flown = [(1, PARKED), (5, at(10.0))];
    for (armed, landed, height_m, expected) in [
        (true, Some(true), 10.0, true),
        (true, Some(false), 10.0, true),
        (true, None, 10.0, true),
        (true, Some(true), 0.3, false),
        (true, Some(false), 0.3, true),
        (true, None, 0.3, true),
        (false, Some(true), 10.0, false),
        (false, Some(false), 10.0, true),
        (false, None, 10.0, false),
        (false, Some(true), 0.3, false),
        (false, Some(false), 0.3, false),
        (false, None, 0.3, false),
    ] {
        let last = Evidence { armed: Some(armed), landed, speed_m_s: Some(0.1), ..at(height_m) };
        check(&[flown[0], flown[1], (1, last)], Some(expected));
    }
}

#[test]
fn a_detector_that_sticks_at_landed_in_a_takeoff_or_a_low_hover_ends_no_flight() {
    let lifted = [(1, PARKED), (1, ARMED), (1, at(0.7))];
    let stuck = |height_m, speed_m_s| Evidence { landed: Some(true), speed_m_s: Some(speed_m_s), ..at(height_m) };
    check(&[lifted[0], lifted[1], lifted[2], (9, stuck(0.9, 2.0))], Some(true));
    check(&[lifted[0], lifted[1], lifted[2], (9, stuck(1.3, 0.0))], Some(true));
    // At rest as low as it stood it has landed, in whatever mode; in a landing at another height, too.
    check(&[lifted[0], lifted[1], lifted[2], (1, stuck(0.4, 0.0))], Some(false));
    check(&[lifted[0], lifted[1], (5, at(10.0)), (5, landing(1.3, Some(true), 0.0))], Some(false));
}

#[test]
fn a_detector_that_is_stuck_at_landed_hides_no_flight() {
    let stuck = |height_m| Evidence { landed: Some(true), ..at(height_m) };
    let state = check(&[(1, PARKED), (1, ARMED), (1, stuck(0.5)), (1, stuck(1.4))], Some(false));
    assert_eq!(state.contradicts_detector(), Some(false));
    let state = check(&[(1, PARKED), (1, ARMED), (1, stuck(0.5)), (60, stuck(3.0))], Some(true));
    assert_eq!(state.contradicts_detector(), Some(true));
    // It hovers, also at the end of a landing that is blocked; it has never noticed the flight.
    let flight = [(1, PARKED), (1, ARMED), (5, stuck(10.0))];
    check(&[&flight[..], &[(60, Evidence { speed_m_s: Some(0.0), ..stuck(10.0) })]].concat(), Some(true));
    check(&[&flight[..], &[(60, landing(2.0, Some(true), 0.0))]].concat(), Some(true));
    // The estimator does not vouch for the height for a while.
    check(&[&flight[..], &[(60, Evidence { height_m: None, ..stuck(10.0) })]].concat(), Some(true));
    check(&[&flight[..], &[(5, landing(0.2, Some(true), 0.0))]].concat(), Some(false));
    check(&[&flight[..], &[(5, PARKED)]].concat(), Some(false));
}

#[test]
fn a_detector_that_is_stuck_at_flying_hides_no_landing() {
    let flight = [(1, PARKED), (5, at(10.0)), (5, landing(5.0, Some(false), 0.7))];
    check(&[&flight[..], &[(7, landing(0.4, Some(false), 0.0))]].concat(), Some(true));
    let state = check(&[&flight[..], &[(9, landing(0.4, Some(false), 0.0))]].concat(), Some(false));
    assert_eq!((state.contradicts_detector(), state.stands_still()), (Some(true), true));
    // Not where something holds it up, not while it moves, and not in another mode.
    check(&[&flight[..], &[(60, landing(2.0, Some(false), 0.0))]].concat(), Some(true));
    check(&[&flight[..], &[(60, landing(0.4, Some(false), 0.7))]].concat(), Some(true));
    check(&[&flight[..], &[(60, Evidence { lands: false, ..landing(0.4, Some(false), 0.0) })]].concat(), Some(true));
}

#[test]
fn a_detector_that_speaks_in_a_descent_ends_no_landing_before_the_vehicle_rests() {
    let flight = [(1, PARKED), (5, at(10.0)), (5, landing(5.0, Some(false), 0.7))];
    check(&[&flight[..], &[(1, landing(0.5, Some(true), 0.7))]].concat(), Some(true));
    check(
        &[&flight[..], &[(1, landing(0.5, Some(true), 0.7)), (1, landing(0.1, Some(true), 0.0))]].concat(),
        Some(false),
    );
    // How fast it comes down is not known.
    let unseen = Evidence { height_m: None, speed_m_s: None, vertical_m_s: None, ..landing(0.5, Some(true), 0.0) };
    check(&[&flight[..], &[(1, unseen)]].concat(), Some(false));
    // Its estimate drifts along the ground.
    let drifts = Evidence { speed_m_s: Some(1.0), ..landing(0.1, Some(true), 0.0) };
    check(&[&flight[..], &[(1, drifts)]].concat(), Some(false));
}

/// Its mode is not known, and its detector has stuck since before it lifted off.
#[test]
fn who_rests_where_it_stood_before_has_landed_also_with_a_silent_status_if_the_detector_says_so() {
    let silent =
        |landed, height_m, speed_m_s| Evidence { may_land: true, landed, speed_m_s: Some(speed_m_s), ..at(height_m) };
    let stuck = |height_m, speed_m_s| silent(Some(true), height_m, speed_m_s);
    let flight = [(1, PARKED), (1, ARMED), (5, Evidence { landed: Some(true), ..at(10.0) }), (5, stuck(5.0, 0.7))];
    check(&[&flight[..], &[(7, stuck(0.1, 0.0))]].concat(), Some(true));
    check(&[&flight[..], &[(9, stuck(0.1, 0.0))]].concat(), Some(false));
    check(&[&flight[..], &[(60, Evidence { may_land: false, ..stuck(0.1, 0.0) })]].concat(), Some(true));
    // Not where it hovers, and not while it moves.
    check(&[&flight[..], &[(60, stuck(1.2, 0.0))]].concat(), Some(true));
    check(&[&flight[..], &[(60, stuck(10.0, 0.0))]].concat(), Some(true));
    check(&[&flight[..], &[(60, stuck(0.1, 0.7))]].concat(), Some(true));
    check(&[&flight[..], &[(60, stuck(10.0, 0.0)), (1, stuck(0.5, 0.7))]].concat(), Some(true));
    // A detector that says otherwise, or nothing, may be right: it hovers as low, and may touch the ground.
    for landed in [Some(false), None] {
        let state = check(&[&flight[..], &[(60, silent(landed, 0.14, 0.0))]].concat(), Some(true));
        assert!(state.is_near_ground());
        let state = check(&[&flight[..], &[(60, silent(landed, 0.5, 0.0))]].concat(), Some(true));
        assert!(!state.is_near_ground());
        // Who passes by at that height, over lower ground, does not touch it.
        let state = check(&[&flight[..], &[(60, silent(landed, 0.14, 0.7))]].concat(), Some(true));
        assert!(!state.is_near_ground());
    }
}

#[test]
fn a_deck_at_another_height_is_ground_also_with_a_silent_status_if_the_detector_notices_the_touchdown() {
    let silent =
        |height_m, landed, speed_m_s| Evidence { may_land: true, lands: false, ..landing(height_m, landed, speed_m_s) };
    let (air, ground) = (Some(false), Some(true));
    let flight = [(1, PARKED), (5, at(40.0)), (5, silent(35.0, air, 0.7))];
    let rests = [(2, silent(30.0, air, 0.0)), (5, silent(30.0, ground, 0.0))];
    check(&[&flight[..], &rests, &[(1, silent(30.0, ground, 0.0))]].concat(), Some(true));
    check(&[&flight[..], &rests, &[(3, silent(30.0, ground, 0.0))]].concat(), Some(false));
    // So it is on ground that is hardly higher than where it stood, neither here nor far away.
    let low = [(2, silent(1.2, air, 0.0)), (5, silent(1.2, ground, 0.0))];
    check(&[&flight[..], &low, &[(1, silent(1.2, ground, 0.0))]].concat(), Some(true));
    check(&[&flight[..], &low, &[(3, silent(1.2, ground, 0.0))]].concat(), Some(false));
    // One that sticks in a hover, or on the way, has noticed no touchdown.
    check(&[&flight[..], &[(9, silent(30.0, air, 0.0)), (60, silent(30.0, ground, 0.0))]].concat(), Some(true));
    check(&[&flight[..], &[(1, silent(30.0, ground, 0.7)), (60, silent(30.0, ground, 0.0))]].concat(), Some(true));
}

#[test]
fn a_silent_detector_leaves_what_was_known_until_height_or_motors_show_more() {
    let silent = |evidence| Evidence { landed: None, ..evidence };
    check(&[(1, silent(PARKED)), (1, silent(ARMED))], Some(false));
    check(&[(1, silent(PARKED)), (1, silent(ARMED)), (1, silent(at(3.0)))], Some(true));
    check(&[(1, PARKED), (5, at(10.0)), (7, silent(landing(0.1, None, 0.0)))], Some(true));
    check(&[(1, PARKED), (5, at(10.0)), (9, silent(landing(0.1, None, 0.0)))], Some(false));
    check(&[(1, Evidence::default())], None);
}

#[test]
fn a_deck_at_another_height_is_ground_by_a_detector_that_noticed_the_flight() {
    let flight = [(1, PARKED), (5, at(40.0)), (5, landing(35.0, Some(false), 0.7))];
    let down = landing(30.0, Some(true), 0.0);
    let state = check(&[&flight[..], &[(2, down)]].concat(), Some(false));
    assert_eq!(state.contradicts_detector(), Some(false));
    // From there it takes off again.
    let on_deck = Evidence { height_m: Some(30.0), ..ARMED };
    check(&[&flight[..], &[(2, down), (2, on_deck)]].concat(), Some(false));
    check(&[&flight[..], &[(2, down), (2, on_deck), (1, at(32.0))]].concat(), Some(true));
    // A false report of the ground on the way is ignored.
    check(&[&flight[..], &[(60, Evidence { lands: false, ..down })]].concat(), Some(true));
    check(&[&flight[..], &[(60, landing(30.0, Some(true), 0.7))]].concat(), Some(true));
}

#[test]
fn near_the_ground_is_who_has_touched_it_or_has_hardly_left_it() {
    #[track_caller]
    fn near(seen: &[(u64, Evidence)], flying: bool, expected: bool) {
        assert_eq!(check(seen, Some(flying)).is_near_ground(), expected, "{seen:?}");
    }
    let air = Some(false);
    near(&[(1, PARKED)], false, true);
    // A takeoff, as long as it is lower than a metre; what has been higher flies.
    near(&[(1, PARKED), (1, ARMED), (1, at(0.9))], true, true);
    near(&[(1, PARKED), (1, ARMED), (1, at(1.1))], true, false);
    near(&[(1, PARKED), (5, at(10.0)), (1, at(0.5))], true, false);
    // A landing that touches the ground, also if it is given up there, and not one that is stopped above it.
    let flown = [(1, PARKED), (5, at(10.0))];
    near(&[flown[0], flown[1], (1, landing(0.5, air, 0.7))], true, false);
    near(&[flown[0], flown[1], (1, landing(0.5, air, 0.7)), (9, at(0.5))], true, false);
    near(&[flown[0], flown[1], (1, landing(0.1, air, 0.7))], true, true);
    near(&[flown[0], flown[1], (1, landing(0.1, air, 0.7)), (9, at(-0.1))], true, true);
    near(&[flown[0], flown[1], (1, landing(0.1, air, 0.7)), (9, at(1.2)), (9, at(0.1))], true, false);
    // What a process finds so low when it is started, and at rest or in a landing, may stand there.
    let hovers = |height_m| Evidence { speed_m_s: Some(0.1), ..at(height_m) };
    near(&[(1, hovers(0.9))], true, true);
    near(&[(1, landing(0.9, air, 0.7))], true, true);
    near(&[(1, at(0.9))], true, false);
    near(&[(1, hovers(1.1)), (1, hovers(0.9))], true, false);
    // A height that nobody knows says nothing.
    near(&[flown[0], flown[1], (1, landing(0.1, air, 0.7)), (1, Evidence { height_m: None, ..at(0.1) })], true, false);
}
