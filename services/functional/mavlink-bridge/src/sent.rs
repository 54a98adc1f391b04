//! The setpoints that were sent last, by which one of somebody else is told from ours.

use std::collections::VecDeque;
use std::time::Duration;

use domain::time::Time;

use crate::heard::Echo;
use crate::said::Target;
use crate::vector::{difference, dot, length};

/// What was sent and may be followed: since the newest one that was seen to be followed, and a little before.
#[derive(Debug, Default)]
pub(crate) struct Sent {
    targets: VecDeque<(Time, Target)>,
    /// Points against: two for each that is not ours, one less for each that is.
    suspicion: u32,
    /// The newest was seen to be followed.
    is_followed: bool,
}

/// What is seen to be followed may be older than what was seen before by this: frames overtake each other.
const OVERTAKEN: Duration = Duration::from_millis(1_500);
/// More are not kept: 3 s of 20 Hz. Of a longer silence the beginning and the end are.
const KEPT: usize = 60;
/// Two setpoints that are not ours, or one in every two of several.
const SUSPICIOUS: u32 = 4;
/// As long an autopilot moves a position on along the velocity that came with it: ArduPilot's GUID_TIMEOUT, 3 s at most by our
/// `autopilot-check`, and two periods of its telling.
const MOVED_ON: Duration = Duration::from_millis(3_500);
/// After this it may have given a velocity up: GUID_TIMEOUT, 1 s at least.
const GIVEN_UP: Duration = Duration::from_millis(900);
/// A position that is farther away is another one. (ENG: it may have begun to move before the velocity was known to it.)
const OTHER_M: f64 = 2.0;
/// A velocity that differs by more is another one.
const OTHER_M_S: f64 = 0.5;

impl Sent {
    /// This was sent.
    pub(crate) fn note(&mut self, target: Target, now: Time) {
        if self.targets.len() == KEPT {
            // What came to the autopilot last is near the beginning, if nothing does now, and what comes next at the end.
            self.targets.remove(KEPT / 2);
        }
        self.targets.push_back((now, target));
        self.is_followed = false;
    }

    /// What was sent is followed no more.
    pub(crate) fn forget(&mut self) {
        *self = Sent::default();
    }

    /// Whether the newest may not have arrived, and nothing of somebody else was seen in its place.
    pub(crate) fn may_be_lost(&self) -> bool {
        !self.is_followed && self.suspicion == 0
    }

    /// Whether what the autopilot follows is not ours, again and again.
    pub(crate) fn is_of_somebody_else(&mut self, echo: Echo, now: Time) -> bool {
        if self.targets.is_empty() {
            return false;
        }
        match self.targets.iter().rposition(|(at, sent)| is_told(sent, echo, now - *at)) {
            Some(index) => {
                let followed = self.targets[index].0;
                self.is_followed = index + 1 == self.targets.len();
                self.suspicion = self.suspicion.saturating_sub(1);
                while self.targets.get(1).is_some_and(|(at, _)| OVERTAKEN < followed - *at) {
                    self.targets.pop_front();
                }
                false
            }
            None => {
                self.suspicion = (self.suspicion + 2).min(SUSPICIOUS);
                self.suspicion == SUSPICIOUS
            }
        }
    }
}

/// Whether `echo` is how an autopilot may tell of `sent`, which was sent `age` ago.
fn is_told(sent: &Target, echo: Echo, age: Duration) -> bool {
    match (sent.position, sent.velocity, echo) {
        (Some(from), along, Echo { position: Some(position), .. }) => {
            let longest_s = age.min(MOVED_ON).as_secs_f64();
            from_segment(position, from, along.unwrap_or_default().map(|it| it * longest_s)) <= OTHER_M
        }
        (None, Some(sent), Echo { position: None, velocity: Some(velocity) }) => {
            let is_given_up = GIVEN_UP <= age && length(velocity) <= OTHER_M_S;
            is_given_up || length(difference(sent, velocity)) <= OTHER_M_S
        }
        _ => false,
    }
}

/// How far `point` is from the way that begins at `from` and goes on by `along`.
fn from_segment(point: [f64; 3], from: [f64; 3], along: [f64; 3]) -> f64 {
    let (to_point, squared) = (difference(point, from), dot(along, along));
    let part = if squared == 0.0 { 0.0 } else { (dot(to_point, along) / squared).clamp(0.0, 1.0) };
    length(difference(to_point, along.map(|it| it * part)))
}

#[cfg(test)]
mod tests {
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
}
