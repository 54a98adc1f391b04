//! The newest data of the vehicle with their ages. Data that are too old are left out.

use std::time::Duration;

use domain::flight_state::{Evidence, FlightState, Motors, detector_limit};
use domain::fmu::{Command, FlightMode, LandDetected, LocalPosition, Status};
use domain::time::{Pace, Time};
use domain::wire::InvalidMessage;

use crate::config::Config;

/// What the autopilot does, in modes that are known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FlightStatus {
    /// Whether the motors may turn.
    pub(crate) armed: bool,
    /// The mode that was asked for.
    pub(crate) intended: FlightMode,
    /// The mode that is flown.
    pub(crate) actual: FlightMode,
    /// Whether one of the autopilot's own failsafes flies.
    pub(crate) failsafe: bool,
}

impl TryFrom<Status> for FlightStatus {
    type Error = InvalidMessage;
    fn try_from(status: Status) -> Result<FlightStatus, InvalidMessage> {
        Ok(FlightStatus {
            armed: status.armed,
            intended: status.intended.ok_or(InvalidMessage::Missing("intended_mode"))?,
            actual: status.actual.ok_or(InvalidMessage::Missing("actual_mode"))?,
            failsafe: status.failsafe,
        })
    }
}

/// The newest of each topic, with the time at which it arrived.
#[derive(Debug)]
pub(crate) struct Vehicle {
    limits: AgeLimits,
    position: Option<(Time, LocalPosition)>,
    status: Option<(Time, FlightStatus)>,
    landed: Option<(Time, LandDetected)>,
    flight: FlightState,
    pace: Pace,
    /// The status came after the newest command was settled.
    status_is_settled: bool,
    /// The newest status that came while a command was in flight.
    during_command: Option<FlightStatus>,
}

#[derive(Debug)]
struct AgeLimits {
    position: Duration,
    status: Duration,
    landed: Duration,
}

/// The vehicle at one moment: only what is recent enough to decide by.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct View {
    /// Position and velocity, if the estimator vouches for both parts.
    pub(crate) motion: Option<LocalPosition>,
    /// The same, if the estimator vouches at least for the vertical part.
    pub(crate) vertical: Option<LocalPosition>,
    /// The status, if it is newer than the answer to the newest command.
    pub(crate) status: Option<FlightStatus>,
    /// Whether the vehicle flies, by the rule that all processes share.
    pub(crate) flying: Option<bool>,
    /// It stands still on the ground, motors on or off.
    pub(crate) stands_still: bool,
    /// When the land detector spoke last, by the vehicle's clock; 0 while it is silent.
    pub(crate) landed_timestamp_us: u64,
}

impl Vehicle {
    /// A vehicle that was never heard.
    pub(crate) fn new(config: &Config, pace: Pace) -> Vehicle {
        let limits = AgeLimits {
            position: pace.limit(config.position_age_limit_s.seconds()),
            status: at_wall_rate(pace, config.status_age_limit_s.seconds()),
            landed: detector_limit(pace),
        };
        let flight = FlightState::default();
        Vehicle {
            limits,
            position: None,
            status: None,
            landed: None,
            flight,
            pace,
            status_is_settled: false,
            during_command: None,
        }
    }

    /// A position has arrived.
    pub(crate) fn moved(&mut self, position: LocalPosition, now: Time) {
        self.position = Some((now, position));
        self.judge_flight(now);
    }

    /// A status has arrived, while a command was in flight or not.
    pub(crate) fn reported(&mut self, status: FlightStatus, command_in_flight: bool, now: Time) {
        self.status = Some((now, status));
        self.status_is_settled = !command_in_flight;
        self.during_command = Some(status).filter(|_| command_in_flight);
        self.judge_flight(now);
    }

    /// A statement of the land detector has arrived.
    pub(crate) fn land_detected(&mut self, landed: LandDetected, now: Time) {
        self.landed = Some((now, landed));
        self.judge_flight(now);
    }

    fn judge_flight(&mut self, now: Time) {
        let status = self.status.map(|(_, it)| Motors { armed: it.armed, lands: it.actual == FlightMode::Land });
        let position = self.position.map(|(at, it)| (now - at, it));
        let landed = self.landed.map(|(at, it)| (now - at, it.landed));
        self.flight.update(now, Evidence::new(self.pace, status, position, landed));
    }

    /// A command is sent: the mode in the newest status will soon be out of date.
    pub(crate) fn commanded(&mut self) {
        self.status_is_settled = false;
        self.during_command = None;
    }

    /// Whether a status that came since `command` was sent shows that the vehicle does what it says.
    pub(crate) fn obeys(&self, command: Command) -> bool {
        let Some(FlightStatus { armed, intended, actual, .. }) = self.during_command else { return false };
        match command.mode() {
            Some(mode) => intended == mode && actual == mode,
            None => armed == (command == Command::Arm),
        }
    }

    /// The data that are recent enough at this moment.
    pub(crate) fn view(&self, now: Time) -> View {
        let position = newer_than(self.limits.position, self.position, now);
        let status = newer_than(self.limits.status, self.status, now);
        let landed = newer_than(self.limits.landed, self.landed, now);
        View {
            motion: position.filter(|it| it.horizontal_valid && it.vertical_valid),
            vertical: position.filter(|it| it.vertical_valid),
            status: status.filter(|_| self.status_is_settled),
            flying: self.flight.flying(),
            stands_still: self.flight.stands_still(),
            landed_timestamp_us: landed.map_or(0, |it| it.timestamp_us),
        }
    }
}

impl View {
    /// Whether the vehicle is on the ground and nothing is about to lift it; `None` when that is not
    /// known.
    ///
    /// That it does not fly is not enough: so it stands while a takeoff spools up.
    pub(crate) fn at_rest_on_ground(&self) -> Option<bool> {
        if self.flying == Some(true) {
            return Some(false);
        }
        let status = self.status?;
        if self.flying.is_none() {
            // With its motors on it may fly.
            return status.armed.then_some(false);
        }
        Some(!status.armed || !matches!(status.intended, FlightMode::Takeoff | FlightMode::Offboard))
    }
}

/// A limit for something whose rate keeps to the wall clock at any speed factor: never less than
/// this much wall time.
pub(crate) fn at_wall_rate(pace: Pace, limit: Duration) -> Duration {
    limit.max(pace.wall(limit))
}

fn newer_than<T>(limit: Duration, sample: Option<(Time, T)>, now: Time) -> Option<T> {
    sample.filter(|(at, _)| now - *at <= limit).map(|(_, value)| value)
}
