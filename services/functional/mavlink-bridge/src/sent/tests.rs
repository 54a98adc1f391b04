use proptest::prelude::*;

use super::*;

/// East at 10 m/s, a target each 50 ms.
fn moving(count: u64) -> Sent {
    let mut sent = Sent::default();
    for i in 0..count {
        let position = Some([0.0, 0.5 * i as f64, -10.0]);
        let target = Target { position, velocity: Some([0.0, 10.0, 0.0]), yaw_rad: None, yaw_rate_rad_s: None };
        sent.note(target, at(50 * i));
    }
    sent
}

fn at(ms: u64) -> Time {
    Time::after(Duration::from_millis(ms))
}

fn place(east_m: f64) -> Echo {
    Echo { position: Some([0.0, east_m, -10.0]), velocity: Some([0.0, 10.0, 0.0]) }
}

const STANDS: Echo = Echo { position: None, velocity: Some([0.0; 3]) };

/// Whether four times the same, once in each quarter of a second, is somebody else's.
#[track_caller]
fn check(mut sent: Sent, echo: Echo, from_ms: u64, expected: bool) {
    let judged = (0..4).map(|i| sent.is_of_somebody_else(echo, at(from_ms + 250 * i))).collect::<Vec<_>>();
    assert_eq!(judged.iter().any(|it| *it), expected, "{echo:?} at {from_ms} ms: {judged:?}");
    assert!(!judged[0], "once is not enough: {judged:?}");
}

#[test]
fn what_moves_on_along_ours_is_ours_and_what_lies_beside_is_not() {
    // The last of 40 was sent at 1,950 ms, at 19.5 m.
    check(moving(40), place(19.5), 2_000, false);
    check(moving(40), place(28.0), 2_900, false);
    check(moving(40), place(49.5), 6_000, false);
    check(moving(40), place(60.0), 6_000, true);
    let beside = Echo { position: Some([5.0, 19.5, -10.0]), velocity: None };
    check(moving(40), beside, 2_000, true);
    check(moving(40), STANDS, 2_000, true);
    // Before anything is sent, nothing can be told apart.
    check(Sent::default(), beside, 2_000, false);
}

#[test]
fn in_a_silence_whatever_arrived_last_is_ours() {
    // It heard ours until 1 s, and told so; then nothing came through for 9 s.
    let mut sent = moving(20);
    assert!(!sent.is_of_somebody_else(place(9.5), at(1_000)));
    for i in 20..200 {
        let position = Some([0.0, 0.5 * f64::from(i), -10.0]);
        let target = Target { position, velocity: Some([0.0, 10.0, 0.0]), yaw_rad: None, yaw_rate_rad_s: None };
        sent.note(target, at(50 * i as u64));
    }
    assert!(sent.targets.len() <= KEPT);
    check(sent, place(9.5 + 30.0), 10_000, false);
}

#[test]
fn a_velocity_of_ours_may_have_been_given_up() {
    let mut sent = Sent::default();
    let velocity = Some([3.0, 0.0, 0.0]);
    sent.note(Target { position: None, velocity, yaw_rad: None, yaw_rate_rad_s: None }, at(0));
    assert!(!sent.is_of_somebody_else(STANDS, at(3_000)));
    let mut sent = Sent::default();
    sent.note(Target { position: None, velocity, yaw_rad: None, yaw_rate_rad_s: None }, at(0));
    assert!(!sent.is_of_somebody_else(STANDS, at(100)));
    assert!(sent.is_of_somebody_else(STANDS, at(350)));
}

#[test]
fn one_of_ours_after_suspicion_is_ours() {
    let mut sent = moving(40);
    for _ in 0..5 {
        let _ = sent.is_of_somebody_else(STANDS, at(2_000));
    }
    assert!(!sent.is_of_somebody_else(place(19.5), at(2_000)));
}

/// Of a moving target: for how many steps of 50 ms it goes where, by how much its speed changes, and whether setpoints are sent and heard meanwhile.
#[derive(Debug, Clone, Copy)]
struct Leg {
    steps: u64,
    /// m/s, north and east.
    wanted: [f64; 2],
    is_sent: bool,
    is_heard: bool,
    delay_ms: u64,
}

fn legs() -> impl Strategy<Value = Vec<Leg>> {
    let leg =
        (1_u64..120, [-12.0..12.0, -12.0..12.0], prop::bool::weighted(0.8), prop::bool::weighted(0.7), 0_u64..400);
    let leg =
        leg.prop_map(|(steps, wanted, is_sent, is_heard, delay_ms)| Leg { steps, wanted, is_sent, is_heard, delay_ms });
    prop::collection::vec(leg, 1..12)
}

/// What an ArduPilot follows: a place, a velocity, since when.
type Followed = ([f64; 3], [f64; 3], Time);

/// GUID_TIMEOUT.
const TIMEOUT: Duration = Duration::from_secs(3);

fn told((position, velocity, since): Followed, now: Time) -> Echo {
    let age = now - since;
    let along_s = age.min(TIMEOUT).as_secs_f64();
    let moved = std::array::from_fn(|i| position[i] + velocity[i] * along_s);
    Echo { position: Some(moved), velocity: Some(if TIMEOUT < age { [0.0; 3] } else { velocity }) }
}

/// Whether it counts as somebody else's at any time. Every frame of a leg that is heard arrives `delay_ms` later, in both directions;
/// `stranger` is followed from the given step on instead.
fn flown(legs: &[Leg], stranger: Option<(u64, [f64; 3])>) -> bool {
    let (mut sent, mut position, mut velocity) = (Sent::default(), [0.0, 0.0, -10.0], [0.0; 3]);
    let (mut followed, mut in_flight): (Option<Followed>, Vec<(u64, Followed)>) = (None, Vec::new());
    let mut echoes: Vec<(u64, Echo)> = Vec::new();
    let mut step = 0;
    for leg in legs {
        for _ in 0..leg.steps {
            step += 1;
            let ms = 50 * step;
            for i in 0..2 {
                // 4 m/s2.
                velocity[i] += (leg.wanted[i] - velocity[i]).clamp(-0.2, 0.2);
                position[i] += velocity[i] * 0.05;
            }
            if leg.is_sent {
                let target =
                    Target { position: Some(position), velocity: Some(velocity), yaw_rad: None, yaw_rate_rad_s: None };
                sent.note(target, at(ms));
                if leg.is_heard {
                    in_flight.push((ms + leg.delay_ms, (position, velocity, at(ms + leg.delay_ms))));
                }
            }
            // Frames do not overtake each other: the bridge drops those that do.
            in_flight.sort_by_key(|(arrives, _)| *arrives);
            while in_flight.first().is_some_and(|(arrives, _)| *arrives <= ms) {
                followed = Some(in_flight.remove(0).1);
            }
            if let Some((_, place)) = stranger.filter(|(from, _)| *from <= step) {
                followed = Some((place, [0.0; 3], at(ms)));
            }
            if step % 5 == 0
                && leg.is_heard
                && let Some(followed) = followed
            {
                echoes.push((ms + leg.delay_ms, told(followed, at(ms))));
            }
            let due: Vec<Echo> = echoes.extract_if(.., |(arrives, _)| *arrives <= ms).map(|(_, it)| it).collect();
            if due.into_iter().any(|echo| sent.is_of_somebody_else(echo, at(ms))) {
                return true;
            }
        }
    }
    false
}

proptest! {
    #[test]
    fn whatever_is_lost_late_or_paused_ours_is_ours(legs in legs()) {
        prop_assert!(!flown(&legs, None));
    }

    #[test]
    fn a_place_that_is_not_on_our_way_is_somebody_elses(legs in legs(), from in 20_u64..100) {
        let last = Leg { steps: 200, wanted: [5.0, 0.0], is_sent: true, is_heard: true, delay_ms: 100 };
        let legs: Vec<Leg> = legs.into_iter().chain([last]).collect();
        prop_assert!(flown(&legs, Some((from, [0.0, 0.0, -60.0]))));
    }
}
