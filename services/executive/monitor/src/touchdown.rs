//! How fast the vehicle came down on the ground, and from what height it fell if its motors were stopped in the air.

use std::time::Duration;

use domain::flight_state::AT_REST_M_S;
use domain::time::Time;

/// The fastest descent in the last one to two of these before the vehicle counts as on the ground counts as the touchdown.
/// (PX4's land detector takes about a second: LNDMC_TRIG_TIME.) Time at rest is left out: the ground may be noticed seconds after the impact.
/// The touchdown is over when the vehicle has been at rest for this long: an autopilot whose motors are stopped in the air reports the
/// ground before the fall. (ArduPilot: 60 ms after the disarming.)
const WINDOW: Duration = Duration::from_millis(1500);
/// No more time at rest is left out than this: a vehicle that hovers before it lands has not come down as it did before. (ENG)
const LONGEST_REST: Duration = Duration::from_secs(10);
/// A vehicle that descends faster falls. (PX4: no descent is faster than MPC_Z_VEL_MAX_DN, 1.5 m/s; ENG: above it.)
const FALLS_M_S: f64 = 2.5;
/// A longer silence hides a fall: its mean speed counts. (ENG: five times the period of the slowest autopilot.)
const SILENCE: Duration = Duration::from_millis(500);
/// Standard gravity.
const GRAVITY_M_S2: f64 = 9.81;

/// A moment of a descent.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Descent {
    speed_m_s: f64,
    /// The height at which it became a fall.
    from_m: f64,
}

impl Descent {
    fn or_faster(self, other: Descent) -> Descent {
        if self.speed_m_s < other.speed_m_s { other } else { self }
    }
}

/// Watches descents and landings.
#[derive(Debug, Clone, Default)]
pub(crate) struct Touchdown {
    /// The fastest descent in this window and in the one before it.
    this_window: Descent,
    last_window: Descent,
    ends: Time,
    /// Time at rest that was left out of this window.
    rested: Duration,
    /// The last height, and when it was heard.
    heard: Time,
    height_m: f64,
    /// The height at which it was last seen not to fall.
    steady_m: f64,
    armed: bool,
    /// The height at which the motors were seen to be stopped in the air, as long as they are not started.
    stopped_at_m: Option<f64>,
    flying: bool,
    /// On the ground: until then a descent belongs to the touchdown.
    open_until: Time,
    touchdown: Option<Descent>,
}

impl Touchdown {
    /// The vehicle is at this height and moves downwards so fast, in metres per second.
    pub(crate) fn descends(&mut self, now: Time, height_m: f64, speed_m_s: f64) {
        let (rest, mean_m) = (now - self.heard, self.height_m - height_m);
        let is_silence = SILENCE < rest && Time::ZERO < self.heard;
        let speed_m_s = if is_silence { speed_m_s.max(mean_m / rest.as_secs_f64()) } else { speed_m_s };
        (self.heard, self.height_m) = (now, height_m);
        if speed_m_s.abs() < AT_REST_M_S && self.rested < LONGEST_REST {
            self.ends = self.ends + rest;
            self.rested += rest;
        }
        if self.ends <= now {
            self.last_window = std::mem::take(&mut self.this_window);
            (self.ends, self.rested) = (now + WINDOW, Duration::ZERO);
        }
        if speed_m_s <= FALLS_M_S {
            self.steady_m = height_m;
        }
        let descent = Descent { speed_m_s, from_m: self.steady_m };
        self.this_window = self.this_window.or_faster(descent);
        if !self.flying && now <= self.open_until && AT_REST_M_S < speed_m_s {
            self.open_until = now + WINDOW;
            self.touchdown = self.touchdown.map(|it| it.or_faster(descent));
        }
    }

    /// The motors may turn, or not, at this height; `None`: at the ground.
    pub(crate) fn motors(&mut self, armed: bool, away_m: Option<f64>) {
        let stops = self.armed && self.flying;
        self.stopped_at_m = self.stopped_at_m.or(away_m.filter(|_| stops)).filter(|_| !armed);
        self.armed = armed;
    }

    /// Whether the height of a vehicle that is down now was last heard so high and so recently that it has fallen.
    pub(crate) fn must_have_fallen(&self, now: Time) -> bool {
        let silence = now - self.heard;
        SILENCE < silence && FALLS_M_S * silence.as_secs_f64() < self.height_m
    }

    /// The motors were stopped at this height, and nothing vouches for how fast it comes down: as fast as it must.
    pub(crate) fn falls_unseen(&mut self, height_m: f64) {
        let speed_m_s = (2.0 * GRAVITY_M_S2 * height_m.max(0.0)).sqrt();
        self.this_window = self.this_window.or_faster(Descent { speed_m_s, from_m: height_m });
    }

    /// The vehicle flies, or stands on the ground.
    pub(crate) fn flies(&mut self, now: Time, flying: bool) {
        if flying {
            self.touchdown = Some(Descent::default());
        } else if self.flying {
            self.touchdown = Some(self.this_window.or_faster(self.last_window));
            self.open_until = now + WINDOW;
        }
        self.flying = flying;
    }

    /// The speed of the last touchdown, 0 in the air; `None` where none was seen.
    pub(crate) fn speed_m_s(&self) -> Option<f64> {
        self.touchdown.map(|it| it.speed_m_s)
    }

    /// The height at which the motors were stopped, if it fell from there.
    pub(crate) fn fell_from_m(&self) -> Option<f64> {
        let fall = self.touchdown.filter(|it| FALLS_M_S < it.speed_m_s)?;
        // The motors may be seen to be stopped when it has fallen for some metres.
        Some(self.stopped_at_m?.max(fall.from_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Descents at a tenth of a second each, from 15 m, at 5 s.
    fn descends(touchdown: &mut Touchdown, descents_m_s: &[f64]) {
        for speed_m_s in descents_m_s {
            let now = touchdown.heard + Duration::from_millis(100);
            touchdown.descends(now, 15.0, *speed_m_s);
        }
    }

    fn in_the_air() -> Touchdown {
        let mut touchdown = Touchdown::default();
        touchdown.flies(Time::ZERO, false);
        assert_eq!(touchdown.speed_m_s(), None, "it has not come down yet");
        touchdown.motors(true, None);
        touchdown.flies(Time::ZERO, true);
        assert_eq!(touchdown.speed_m_s(), Some(0.0));
        touchdown
    }

    #[test]
    fn the_fastest_descent_of_the_last_seconds_is_the_touchdown() {
        /// A descent, then the ground.
        #[track_caller]
        fn check(descents_m_s: &[f64], expected_m_s: f64) {
            let mut touchdown = in_the_air();
            descends(&mut touchdown, descents_m_s);
            touchdown.flies(touchdown.heard, false);
            touchdown.flies(touchdown.heard, false);
            assert_eq!(touchdown.speed_m_s(), Some(expected_m_s));
        }
        check(&[0.7; 40], 0.7);
        check(&[1.5, 6.0, 0.0, 0.0], 6.0);
        let before_a_landing: Vec<f64> = [6.0].into_iter().chain([0.7; 40]).collect();
        check(&before_a_landing, 0.7);
        let noticed_late: Vec<f64> = [6.0].into_iter().chain([0.0; 100]).collect();
        check(&noticed_late, 6.0);
        let hovered_before: Vec<f64> = [2.6].into_iter().chain([0.0; 300]).chain([0.5; 10]).collect();
        check(&hovered_before, 0.5);
    }

    #[test]
    fn a_fall_after_the_ground_was_reported_is_the_touchdown() {
        /// The motors are stopped in a hover, the ground is reported at once, and it comes down so fast.
        #[track_caller]
        fn check(descents_m_s: &[f64], expected: (f64, Option<f64>)) {
            let mut touchdown = in_the_air();
            descends(&mut touchdown, &[0.0; 40]);
            touchdown.motors(false, Some(13.0));
            touchdown.flies(touchdown.heard, false);
            descends(&mut touchdown, descents_m_s);
            assert_eq!((touchdown.speed_m_s(), touchdown.fell_from_m()), (Some(expected.0), expected.1));
        }
        check(&[1.0, 2.0, 3.0, 17.0, 0.0], (17.0, Some(15.0)));
        // It stood at a height that had drifted, and is carried away later.
        check(&[0.0; 40], (0.0, None));
        let carried: Vec<f64> = [0.0; 40].into_iter().chain([3.0; 5]).collect();
        check(&carried, (0.0, None));
    }

    #[test]
    fn a_fall_in_a_silence_is_as_fast_as_its_mean() {
        /// Nothing is heard for some time, in which it comes down by 15 m.
        #[track_caller]
        fn check(silence_s: u64, expected_m_s: f64, fell_from_m: Option<f64>) {
            for disarmed_first in [false, true] {
                let mut touchdown = in_the_air();
                descends(&mut touchdown, &[0.0; 40]);
                let now = touchdown.heard + Duration::from_secs(silence_s);
                if disarmed_first {
                    assert_eq!(touchdown.must_have_fallen(now), fell_from_m.is_some());
                } else {
                    touchdown.descends(now, 0.0, 0.0);
                }
                touchdown.motors(false, Some(15.0));
                touchdown.flies(now, false);
                touchdown.descends(now, 0.0, 0.0);
                assert_eq!((touchdown.speed_m_s(), touchdown.fell_from_m()), (Some(expected_m_s), fell_from_m));
            }
        }
        check(2, 7.5, Some(15.0));
        check(10, 1.5, None);
    }

    #[test]
    fn a_fall_that_nothing_vouches_for_is_as_fast_as_it_must_be() {
        let mut touchdown = in_the_air();
        touchdown.motors(false, Some(15.0));
        touchdown.falls_unseen(15.0);
        touchdown.flies(Time::ZERO, false);
        assert!(touchdown.speed_m_s().is_some_and(|it| (17.0..17.3).contains(&it)), "{touchdown:?}");
        assert_eq!(touchdown.fell_from_m(), Some(15.0));
    }
}
