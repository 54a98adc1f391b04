//! The newest data of the vehicle with their ages. Data that are too old are left out.

use std::time::Duration;

use domain::flight_state::{Evidence, FlightState, Motors, detector_limit};
use domain::fmu::{Command, FailsafeReason, FlightMode, Gripper, LandDetected, LocalPosition, PreEmption, Status};
use domain::time::{Pace, Time};

use crate::config::Config;

/// What the autopilot does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FlightStatus {
    /// Whether the motors may turn.
    pub(crate) armed: bool,
    /// The mode that was asked for; `None`: one without a name here, which is never one of ours.
    pub(crate) intended: Option<FlightMode>,
    /// The mode that is flown; `None` as for the intended one.
    pub(crate) actual: Option<FlightMode>,
    /// Whether one of the autopilot's own failsafes flies.
    pub(crate) failsafe: bool,
    /// It waits for setpoints of ours, and for nothing else.
    pub(crate) waits_for_us: bool,
    /// What its gripper does, if that is known.
    pub(crate) gripper: Option<Gripper>,
    /// Whether a pilot or another ground station flies.
    pub(crate) of_other: bool,
    /// Whether it would arm now; `None` where it does not say.
    pub(crate) can_arm: Option<bool>,
    /// Positions of different epochs cannot be compared.
    pub(crate) frame_epoch: u64,
}

impl From<&Status> for FlightStatus {
    fn from(status: &Status) -> FlightStatus {
        FlightStatus {
            armed: status.armed,
            intended: status.intended,
            actual: status.actual,
            failsafe: status.failsafe,
            waits_for_us: status.failsafe_reason == Some(FailsafeReason::Setpoints),
            gripper: status.gripper,
            of_other: status.is_flown_by_other(),
            can_arm: status.can_arm,
            frame_epoch: status.frame_epoch,
        }
    }
}

impl FlightStatus {
    /// Whether it flies in this mode, and was asked to.
    pub(crate) fn is_in(&self, mode: FlightMode) -> bool {
        self.intended == Some(mode) && self.actual == Some(mode)
    }

    /// Whether the autopilot itself flies something else than what was asked for.
    pub(crate) fn is_pre_empted(&self) -> bool {
        self.failsafe || self.actual != self.intended
    }

    /// One of a vehicle that loiters in the air.
    #[cfg(test)]
    pub(crate) fn flying() -> FlightStatus {
        let mode = Some(FlightMode::Loiter);
        let (failsafe, waits_for_us, of_other, gripper, can_arm, frame_epoch) = (false, false, false, None, None, 0);
        FlightStatus {
            armed: true,
            intended: mode,
            actual: mode,
            failsafe,
            waits_for_us,
            gripper,
            of_other,
            can_arm,
            frame_epoch,
        }
    }
}

/// A position that was repeated this often in a row, while armed, counts as none. (The monitor's `position_frozen_samples`.)
const POSITION_FROZEN_SAMPLES: u32 = 60;

/// The newest of each topic, with the time at which it arrived.
#[derive(Debug)]
pub(crate) struct Vehicle {
    limits: AgeLimits,
    position: Option<(Time, LocalPosition)>,
    /// How often in a row the position has come unchanged while armed.
    repetitions: u32,
    status: Option<(Time, FlightStatus)>,
    landed: Option<(Time, LandDetected)>,
    flight: FlightState,
    pre_emption: PreEmption,
    pace: Pace,
    /// The status came after the newest command was settled.
    status_is_settled: bool,
    /// The newest status, in full.
    told: Option<Status>,
    /// The newest status that came while a command was in flight.
    during_command: Option<FlightStatus>,
    /// When a command to release the load was sent last; when an earlier process may have sent one, at the latest.
    release_sent: Option<Time>,
    /// Until then after it the gripper may open.
    release_limit: Duration,
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
    /// The same, if the estimator vouches at least for the vertical part, and it is not frozen: while an armed vehicle repeats itself, how
    /// high it is is not known. (What flies sideways is stopped by the monitor's flag; a landing goes on.)
    pub(crate) vertical: Option<LocalPosition>,
    /// The status, if it is newer than the answer to the newest command.
    pub(crate) status: Option<FlightStatus>,
    /// A status was heard since the start of this process.
    pub(crate) is_heard: bool,
    /// The status while one of the autopilot's own failsafes flies, for a reason of its own.
    pub(crate) failsafe: Option<FlightStatus>,
    /// Whether the vehicle flies, by the rule that all processes share.
    pub(crate) flying: Option<bool>,
    /// It stands still on the ground, motors on or off.
    pub(crate) stands_still: bool,
    /// It stands, or has not been far above the ground since it stood.
    pub(crate) is_near_ground: bool,
    /// When the land detector spoke last, by the vehicle's clock; 0 while it is silent.
    pub(crate) landed_timestamp_us: u64,
    /// A command to release the load was sent so recently, or may have been, that the gripper may be about to open, until then.
    pub(crate) may_release_until: Option<Time>,
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
            repetitions: 0,
            status: None,
            landed: None,
            flight,
            pre_emption: PreEmption::default(),
            pace,
            status_is_settled: false,
            told: None,
            during_command: None,
            release_sent: None,
            release_limit: pace.limit(config.release_limit_s.seconds()),
        }
    }

    /// A position has arrived.
    pub(crate) fn moved(&mut self, position: LocalPosition, now: Time) {
        let is_armed = self.status.is_some_and(|(_, it)| it.armed);
        let repeats = is_armed && self.position.is_some_and(|(_, before)| position.repeats(&before));
        self.repetitions = if repeats { self.repetitions.saturating_add(1) } else { 0 };
        self.position = Some((now, position));
        self.judge_flight(now);
    }

    /// Takes in a status that repeats the newest one; returns whether it does. The newest one keeps its age, and shows nothing of what was
    /// commanded since; only the reason and whether the vehicle would arm may have changed, since a backend adds those.
    pub(crate) fn take_repetition(&mut self, told: &Status) -> bool {
        let repeats = self.told.as_ref().is_some_and(|before| told.repeats(before));
        if let Some((_, status)) = self.status.as_mut().filter(|_| repeats) {
            status.can_arm = told.can_arm;
            self.told = Some(told.clone());
        }
        repeats
    }

    /// A status has arrived, while a command was in flight or not. Returns whether the local frame moved, or the autopilot was started
    /// again: positions before and after it cannot be compared.
    pub(crate) fn reported(&mut self, told: &Status, command_in_flight: bool, now: Time) -> bool {
        self.pre_emption.update(now, told.reported());
        let status = FlightStatus::from(told);
        let has_moved = self.status.is_some_and(|(_, before)| before.frame_epoch != status.frame_epoch);
        if has_moved {
            // Until the next one comes.
            self.position = None;
            self.flight.frame_moved();
        }
        if self.status.is_none() && status.armed {
            // Nothing is known of the process before this one: it may have sent one, and been killed.
            self.release_sent = Some(now);
        }
        self.told = Some(told.clone());
        self.status = Some((now, status));
        self.status_is_settled = !command_in_flight;
        self.during_command = Some(status).filter(|_| command_in_flight);
        self.judge_flight(now);
        has_moved
    }

    /// Why the autopilot pre-empts, or would not arm, in its own words; empty where it does not say.
    pub(crate) fn reason(&self) -> &str {
        self.told.as_ref().map_or("", |it| &it.reason)
    }

    /// A statement of the land detector has arrived.
    pub(crate) fn land_detected(&mut self, landed: LandDetected, now: Time) {
        self.landed = Some((now, landed));
        self.judge_flight(now);
    }

    fn judge_flight(&mut self, now: Time) {
        let heard = self.status.map(|(at, _)| now - at);
        let status = heard.zip(self.told.as_ref().map(Motors::from));
        // One that is frozen shows neither height nor speed.
        let position = self.position.filter(|_| self.repetitions < POSITION_FROZEN_SAMPLES);
        let position = position.map(|(at, it)| (now - at, it));
        let landed = self.landed.map(|(at, it)| (now - at, it.landed));
        self.flight.update(now, Evidence::new(self.pace, status, position, landed));
    }

    /// A command is sent: the mode in the newest status will soon be out of date.
    pub(crate) fn commanded(&mut self, command: Command, now: Time) {
        self.status_is_settled = false;
        self.during_command = None;
        if command == Command::Release {
            self.release_sent = Some(now);
        }
    }

    /// The autopilot does not obey a command.
    pub(crate) fn rejected(&mut self, command: Command) {
        if command == Command::Release {
            self.release_sent = None;
        }
    }

    /// Whether a status that came since `command` was sent shows that the vehicle does what it says.
    pub(crate) fn obeys(&self, command: Command) -> bool {
        let Some(status) = self.during_command else { return false };
        let FlightStatus { armed, gripper, .. } = status;
        match (command, command.mode()) {
            (_, Some(mode)) => status.is_in(mode),
            (Command::Release, None) => gripper == Some(Gripper::Released),
            (_, None) => armed == (command == Command::Arm),
        }
    }

    /// The data that are recent enough at this moment.
    pub(crate) fn view(&self, now: Time) -> View {
        let position = newer_than(self.limits.position, self.position, now);
        let status = newer_than(self.limits.status, self.status, now);
        let landed = newer_than(self.limits.landed, self.landed, now);
        let failsafe = status.filter(|it| it.armed && it.failsafe && self.pre_emption.holds());
        View {
            motion: position.filter(|it| it.horizontal_valid && it.vertical_valid),
            vertical: position.filter(|it| it.vertical_valid && self.repetitions < POSITION_FROZEN_SAMPLES),
            status: status.filter(|_| self.status_is_settled),
            is_heard: self.status.is_some(),
            failsafe,
            flying: self.flight.flying(),
            stands_still: self.flight.stands_still(),
            is_near_ground: self.flight.is_near_ground(),
            landed_timestamp_us: landed.map_or(0, |it| it.timestamp_us),
            may_release_until: self.release_sent.map(|sent| sent + self.release_limit).filter(|until| now < *until),
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
        let lifts_off = matches!(status.intended, Some(FlightMode::Takeoff | FlightMode::Offboard));
        Some(!status.armed || !(lifts_off || status.of_other))
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
