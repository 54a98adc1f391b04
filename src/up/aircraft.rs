//! Whether the aircraft is on the ground with its motors off: before that a system that is to end with its mission does not
//! end. Judged by the rule that every process shares ([`domain::flight_state`]), from the aircraft's own telemetry.
//!
//! Time is the launcher's wall time since its start, as a value, at every speed factor.

use std::time::Duration;

use domain::flight_state::{Evidence, FlightState, Motors};
use domain::fmu::{LocalPosition, Status};
use domain::time::{Pace, Time};
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
    status: Option<(Duration, Status)>,
    landed: Option<(Duration, bool)>,
    position: Option<(Duration, LocalPosition)>,
    flight: FlightState,
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
    /// It is not heard, or repeats its status.
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
                "mission over, and the aircraft is not heard, or its status is frozen, so it may be in the air: the system stays up \
                 until it is seen on the ground; Ctrl-C ends it"
            }
        }
    }
}

impl Aircraft {
    /// Takes in what the vehicle says. A position that makes no sense shows nothing.
    pub fn on(&mut self, message: &Message, now: Duration) {
        match message {
            Message::VehicleStatus(status) => {
                let status = Status::from(status.clone());
                self.status = Some((status.known_since(now, self.status.as_ref()), status));
            }
            Message::VehicleLandDetected(land) => self.landed = Some((now, land.landed)),
            Message::VehicleLocalPosition(position) => {
                self.position = LocalPosition::try_from(*position).ok().map(|it| (now, it)).or(self.position);
            }
            _ => return,
        }
        let age = |it: Duration| now.saturating_sub(it);
        let position = self.position.map(|(at, it)| (age(at), it));
        let landed = self.landed.map(|(at, it)| (age(at), it));
        let status = self.status.as_ref().map(|(at, it)| (age(*at), Motors::from(it)));
        let evidence = Evidence::new(Pace::REAL_TIME, status, position, landed);
        self.flight.update(Time::after(now), evidence);
    }

    /// How it is now.
    pub fn state(&self, now: Duration) -> State {
        let is_fresh = |at: Option<Duration>| at.is_some_and(|at| now < at + STALE);
        let is_seen = is_fresh(self.landed.map(|it| it.0)) || is_fresh(self.position.map(|it| it.0));
        let status = self.status.as_ref().filter(|(at, _)| is_fresh(Some(*at)) && is_seen);
        match (self.flight.flying(), status.map(|(_, it)| it.armed)) {
            (None, _) | (_, None) => State::Unknown,
            (Some(true), Some(_)) => State::InTheAir,
            (Some(false), Some(true)) => State::Armed,
            (Some(false), Some(false)) => State::AtRest,
        }
    }

    /// Whether it may be in the air: one that was heard, and was not seen at rest since.
    pub fn may_be_in_the_air(&self, now: Duration) -> bool {
        let was_heard = self.status.is_some() || self.landed.is_some();
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

    fn seen_at_height(height_m: f64, at: Duration, aircraft: &mut Aircraft) {
        let position = Some(v1::Ned { down_m: -height_m, ..Default::default() });
        let velocity = Some(v1::NedVelocity::default());
        let seen = v1::VehicleLocalPosition { position, velocity, vertical_valid: true, ..Default::default() };
        aircraft.on(&seen.into(), at);
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
    fn a_status_that_is_frozen_says_nothing_of_now() {
        let mut aircraft = Aircraft::default();
        for second in 10..20 {
            aircraft.on(&v1::VehicleStatus { timestamp_us: 7, ..Default::default() }.into(), s(second));
            aircraft.on(&v1::VehicleLandDetected { landed: true, ..Default::default() }.into(), s(second));
            assert_eq!(aircraft.state(s(second)), if second < 15 { State::AtRest } else { State::Unknown }, "{second}");
        }
    }

    #[test]
    fn a_land_detector_that_is_stuck_neither_ends_the_system_in_the_air_nor_keeps_it_up_on_the_ground() {
        #[track_caller]
        fn check(armed: bool, landed: bool, height_m: f64, expected: State) {
            let mut aircraft = Aircraft::default();
            heard(armed, landed, s(10), &mut aircraft);
            seen_at_height(height_m, s(10), &mut aircraft);
            assert_eq!(aircraft.state(s(11)), expected);
        }
        check(true, true, 20.0, State::InTheAir);
        check(false, false, 0.1, State::AtRest);
        check(false, false, 20.0, State::InTheAir);
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
