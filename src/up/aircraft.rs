//! Whether the aircraft is on the ground with its motors off, as it says itself: before that a system that is to end with
//! its mission does not end.
//!
//! Time is the launcher's wall time since its start, as a value.

use std::time::Duration;

use kittiwake_proto::topics::Message;

/// What is older than this says nothing about the present. The autopilot speaks once a second at least.
const STALE: Duration = Duration::from_secs(5);
/// The state that a report implies is still on its way from the aircraft: it is awaited this long without a message.
const GRACE: Duration = Duration::from_secs(2);
/// How often it is said again what is waited for.
const AGAIN: Duration = Duration::from_secs(30);

/// What the aircraft says of itself, and what was said about it.
#[derive(Debug, Default)]
pub struct Aircraft {
    armed: Option<(Duration, bool)>,
    landed: Option<(Duration, bool)>,
    /// Since when it is waited for.
    awaited: Option<Duration>,
    said: Option<(Duration, State)>,
}

/// Whether the system may be taken away from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// On the ground, motors off.
    AtRest,
    /// On the ground, motors on.
    Armed,
    /// In the air.
    InTheAir,
    /// It is not heard.
    Unknown,
}

impl State {
    /// What it means for a system whose mission is over.
    fn in_words(self) -> &'static str {
        match self {
            State::AtRest => "mission over, on the ground and disarmed",
            State::Armed => "mission over, on the ground and still armed: waiting until it is disarmed",
            State::InTheAir => "mission over, still in the air: waiting for the landing",
            State::Unknown => {
                "mission over, and the aircraft is not heard, so it may be in the air: the system stays up until it is seen \
                 on the ground; Ctrl-C ends it"
            }
        }
    }
}

impl Aircraft {
    /// Takes in what the vehicle says.
    pub fn on(&mut self, message: &Message, now: Duration) {
        match message {
            Message::VehicleStatus(status) => self.armed = Some((now, status.armed)),
            Message::VehicleLandDetected(land) => self.landed = Some((now, land.landed)),
            _ => {}
        }
    }

    /// How it is now.
    pub fn state(&self, now: Duration) -> State {
        let fresh = |it: Option<(Duration, bool)>| it.filter(|(at, _)| now < *at + STALE).map(|(_, value)| value);
        match (fresh(self.landed), fresh(self.armed)) {
            (Some(true), Some(false)) => State::AtRest,
            (Some(true), Some(true)) => State::Armed,
            (Some(false), _) => State::InTheAir,
            (None, _) | (_, None) => State::Unknown,
        }
    }

    /// Whether it may be in the air: one that was heard, and was not seen at rest since.
    pub fn may_be_in_the_air(&self, now: Duration) -> bool {
        let was_heard = self.armed.is_some() || self.landed.is_some();
        was_heard && self.state(now) != State::AtRest
    }

    /// The mission is over. Returns what is to be said now about the wait for the aircraft: when it begins to last, when
    /// something changes, and now and then.
    pub fn await_rest(&mut self, now: Duration) -> Option<&'static str> {
        let state = self.state(now);
        let awaited = *self.awaited.get_or_insert(now);
        let is_known = self.said.is_some_and(|(at, said)| said == state && now < at + AGAIN);
        if state == State::AtRest || is_known || now < awaited + GRACE {
            return None;
        }
        self.said = Some((now, state));
        Some(state.in_words())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kittiwake_proto::v1;

    fn s(seconds: u64) -> Duration {
        Duration::from_secs(seconds)
    }

    fn heard(armed: bool, landed: bool, at: Duration, aircraft: &mut Aircraft) {
        aircraft.on(&v1::VehicleStatus { armed, ..Default::default() }.into(), at);
        aircraft.on(&v1::VehicleLandDetected { landed, ..Default::default() }.into(), at);
    }

    #[test]
    fn it_is_at_rest_when_it_says_so_itself_and_lately() {
        #[track_caller]
        fn check(armed: bool, landed: bool, age_s: u64, expected: State) {
            let mut aircraft = Aircraft::default();
            assert_eq!(aircraft.state(s(0)), State::Unknown);
            heard(armed, landed, s(10), &mut aircraft);
            assert_eq!(aircraft.state(s(10 + age_s)), expected);
        }
        check(false, true, 1, State::AtRest);
        check(true, true, 1, State::Armed);
        check(true, false, 1, State::InTheAir);
        check(false, true, 6, State::Unknown);
    }

    #[test]
    fn a_wait_that_lasts_is_told_once_and_again_when_it_changes() {
        let mut aircraft = Aircraft::default();
        let mut told = Vec::new();
        for second in 0..50 {
            match second {
                0..20 => heard(true, false, s(second), &mut aircraft),
                20..30 => {}
                _ => heard(false, true, s(second), &mut aircraft),
            }
            told.extend(aircraft.await_rest(s(second)).map(|it| (second, it)));
        }
        assert_eq!(told, [(2, State::InTheAir.in_words()), (24, State::Unknown.in_words())]);
        assert_eq!(aircraft.state(s(50)), State::AtRest);
    }
}
