//! The newest vehicle data with their ages; what is too old is not there.

use domain::geometry::{Ned, NedVelocity};
use domain::time::{Pace, Time};
use kittiwake_proto::v1::FlightMode;
use std::time::Duration;

use crate::config::Config;

/// Where the vehicle is and how it moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Where.
    pub position: Ned,
    /// How fast, and which way.
    pub velocity: NedVelocity,
    /// The estimator vouches for the horizontal part.
    pub horizontal_valid: bool,
    /// The estimator vouches for the vertical part.
    pub vertical_valid: bool,
    /// When it was measured, by the vehicle's clock.
    pub timestamp_us: u64,
}

/// What the autopilot does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Status {
    /// Whether the motors may turn.
    pub armed: bool,
    /// What was asked for.
    pub intended: FlightMode,
    /// What is flown.
    pub actual: FlightMode,
    /// One of the autopilot's own failsafes flies.
    pub failsafe: bool,
}

/// What the land detector says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Landed {
    /// On the ground.
    pub landed: bool,
    /// When it was found so, by the vehicle's clock.
    pub timestamp_us: u64,
}

/// Everything the autopilot has said, with the time.
#[derive(Debug)]
pub struct Vehicle {
    limits: Limits,
    motion: Option<(Time, Motion)>,
    status: Option<(Time, Status)>,
    landed: Option<(Time, Landed)>,
    /// The status came after the newest command was settled.
    status_is_settled: bool,
}

#[derive(Debug)]
struct Limits {
    position: Duration,
    status: Duration,
    landed: Duration,
}

/// The vehicle at one moment: only what is recent enough to decide by.
#[derive(Debug, Clone, Copy, Default)]
pub struct View {
    /// Position and velocity, if the estimator vouches for all of it.
    pub motion: Option<Motion>,
    /// The same, if it vouches at least for the vertical part.
    pub vertical: Option<Motion>,
    /// The status, if it is newer than the answer to the newest command.
    pub status: Option<Status>,
    /// What the land detector says.
    pub landed: Option<bool>,
    /// When it said so, by the vehicle's clock; 0 for never.
    pub landed_timestamp_us: u64,
}

impl Vehicle {
    /// A vehicle that has said nothing yet.
    pub fn new(config: &Config, pace: Pace) -> Vehicle {
        let limits = Limits {
            position: pace.limit(config.position_age_limit_s.seconds()),
            status: at_wall_rate(pace, config.status_age_limit_s.seconds()),
            landed: at_wall_rate(pace, config.landed_age_limit_s.seconds()),
        };
        Vehicle { limits, motion: None, status: None, landed: None, status_is_settled: false }
    }

    /// A position has come.
    pub fn moved(&mut self, motion: Motion, now: Time) {
        self.motion = Some((now, motion));
    }

    /// A status has come, while a command was in flight or not.
    pub fn reported(&mut self, status: Status, command_in_flight: bool, now: Time) {
        self.status = Some((now, status));
        self.status_is_settled = !command_in_flight;
    }

    /// The land detector has spoken.
    pub fn land_detected(&mut self, landed: Landed, now: Time) {
        self.landed = Some((now, landed));
    }

    /// A command goes out: whatever the status says about the mode will soon be history.
    pub fn commanded(&mut self) {
        self.status_is_settled = false;
    }

    /// What may be decided by at this moment.
    pub fn view(&self, now: Time) -> View {
        let motion = newer_than(self.limits.position, self.motion, now);
        let status = newer_than(self.limits.status, self.status, now);
        let landed = newer_than(self.limits.landed, self.landed, now);
        View {
            motion: motion.filter(|it| it.horizontal_valid && it.vertical_valid),
            vertical: motion.filter(|it| it.vertical_valid),
            status: status.filter(|_| self.status_is_settled),
            landed: landed.map(|it| it.landed),
            landed_timestamp_us: landed.map_or(0, |it| it.timestamp_us),
        }
    }
}

impl View {
    /// Whether it is on the ground and nothing is about to lift it; `None` when that cannot be told.
    ///
    /// The land detector alone does not tell: it still says "landed" while a takeoff spools up.
    pub fn at_rest_on_ground(&self) -> Option<bool> {
        if !self.landed? {
            return Some(false);
        }
        let status = self.status?;
        Some(!status.armed || !matches!(status.intended, FlightMode::Takeoff | FlightMode::Offboard))
    }
}

/// A limit on something whose rate keeps to the wall clock at any speed factor: never less than so
/// much wall time.
pub fn at_wall_rate(pace: Pace, limit: Duration) -> Duration {
    limit.max(pace.wall(limit))
}

fn newer_than<T>(limit: Duration, sample: Option<(Time, T)>, now: Time) -> Option<T> {
    sample.filter(|(at, _)| now - *at <= limit).map(|(_, it)| it)
}
