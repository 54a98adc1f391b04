//! Whether a flight comes nearer to its goal: what says that an action has failed, whatever time has passed.
//!
//! What is left of a flight is measured in seconds by what is intended ([`crate::speeds`]), so that a climb, a slow flight and a long way are
//! judged alike. It is compared with what was left one stretch of time before.

use std::time::Duration;

use crate::time::Time;

/// How long a flight is watched for one judgement. (ENG: a start against its velocity, or a gust, takes ten seconds.)
pub const STRETCH: Duration = Duration::from_secs(30);
/// A flight with less of its intended speed stands. (ENG: 0.5 m/s of the cruise speed, what the wind triangle takes for standing in the
/// wind; an estimate drifts slower.)
const STANDS: f64 = 0.05;

/// How a flight comes forward.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Headway {
    stretch: Duration,
    since: Time,
    /// What was left when the stretch began, and what was left when it was seen last, in seconds.
    began_with_s: f64,
    left_s: f64,
    pace: Option<f64>,
}

impl Headway {
    /// It begins at `now` and takes `left_s`, if it is flown as intended.
    pub fn begins(now: Time, left_s: f64, stretch: Duration) -> Headway {
        Headway { stretch, since: now, began_with_s: left_s, left_s, pace: None }
    }

    /// The same at `now`, with `left_s` to fly.
    pub fn seen(self, now: Time, left_s: f64) -> Headway {
        if now < self.judged_at() {
            return Headway { left_s, ..self };
        }
        // A flight that was to end within the stretch had no more to do.
        let intended_s = (now - self.since).as_secs_f64().min(self.began_with_s);
        let gained_s = self.began_with_s - left_s;
        let pace = if 0.0 < intended_s { gained_s / intended_s } else { 0.0 };
        Headway { since: now, began_with_s: left_s, left_s, pace: Some(pace), ..self }
    }

    /// The same with another goal, to which it takes `left_s`; `spared_s` are not counted, for a stop and a start.
    pub fn turned(self, left_s: f64, spared_s: f64) -> Headway {
        Headway { began_with_s: left_s + self.began_with_s - self.left_s + spared_s, left_s, ..self }
    }

    /// When it is judged next.
    pub fn judged_at(&self) -> Time {
        self.since + self.stretch
    }

    /// Its speed as a share of the intended one, over the last whole stretch: 0.5 takes twice as long, less than 0 leads away.
    pub fn pace(&self) -> Option<f64> {
        self.pace
    }

    /// Whether it came no nearer in the last whole stretch.
    pub fn stands(&self) -> bool {
        self.pace.is_some_and(|pace| pace < STANDS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Ned;
    use crate::speeds::Speeds;

    /// A flight of a kilometre at 10 m/s of which `position` is seen each second: its pace, and whether it stands, after this many.
    #[track_caller]
    fn check(seconds: u64, position_m: impl Fn(f64) -> f64, expected: Option<(f64, bool)>) {
        let at = |s| Time::after(Duration::from_secs(s));
        let (to, speeds) = (Ned::new(0.0, 1000.0, -10.0), Speeds::calm(10.0, 3.0, 1.5));
        let left_s = |s: u64| speeds.time_s(Ned::new(0.0, position_m(s as f64), -10.0), to);
        let begun = Headway::begins(at(0), left_s(0), STRETCH);
        let seen = (1..=seconds).fold(begun, |it, s| it.seen(at(s), left_s(s)));
        let found = seen.pace().map(|pace| ((pace * 100.0).round() / 100.0, seen.stands()));
        assert_eq!(found, expected, "after {seconds} s");
    }

    #[test]
    fn a_flight_has_failed_when_it_comes_no_nearer_however_long_it_takes() {
        let (planned, quarter) = (|s: f64| (10.0 * s).min(1000.0), |s: f64| (2.5 * s).min(1000.0));
        check(29, planned, None);
        check(30, planned, Some((1.0, false)));
        // A clock of twice its time and 20 s would have ended it after 220 s, 450 m before its goal.
        check(300, quarter, Some((0.25, false)));
        // Held up on its way, and led away.
        check(60, |s| (10.0 * s).min(200.0), Some((0.0, true)));
        check(60, |s| -s, Some((-0.1, true)));
        // The rest of the way is shorter than a stretch: six metres before its goal, and there.
        check(120, |s| (10.0 * s).min(994.0), Some((0.94, false)));
        check(150, |s| (10.0 * s).min(994.0), Some((0.0, true)));
        check(150, planned, Some((0.0, true)));
        // It flies on after a gust that held it up.
        check(90, |s| if s < 30.0 { 0.0 } else { 10.0 * (s - 30.0) }, Some((1.0, false)));
    }

    #[test]
    fn a_turn_is_no_progress_and_no_delay() {
        let at = |s| Time::after(Duration::from_secs(s));
        let begun = Headway::begins(at(0), 10.0, STRETCH).seen(at(14), 0.0);
        // Ten seconds of the first leg in 14 s, then five of the second in 16 s, of which 10 s are spared.
        let pace = begun.turned(40.0, 10.0).seen(at(30), 35.0).pace();
        assert_eq!(pace, Some(25.0 / 30.0));
        assert_eq!(begun.turned(40.0, 0.0).seen(at(30), 40.0).pace(), Some(10.0 / 30.0));
    }
}
