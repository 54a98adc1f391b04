//! The setpoints that were sent last, to tell a foreign one from ours.

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
/// More are not kept: of a silence of more than a minute at 20 Hz, the beginning and the end are.
const KEPT: usize = 1_200;
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
        // It may be told of several: of the oldest, moved on, as of the newest.
        match self.targets.iter().find(|(at, sent)| is_told(sent, echo, now - *at)) {
            Some((followed, _)) => {
                let followed = *followed;
                self.is_followed = self.targets.back().is_some_and(|(at, sent)| is_told(sent, echo, now - *at));
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
mod tests;
