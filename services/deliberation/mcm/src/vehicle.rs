//! The monitor's introspection, as far as missions depend on it.

use std::time::Duration;

use domain::flight_state::{Evidence, FlightState, Motors};
use domain::fmu::{FlightMode, Gripper, LocalPosition, PreEmption, Reported};
use domain::geodesy::Origin;
use domain::geometry::{Ned, NedVelocity};
use domain::quantity::Fraction;
use domain::skill::{SkillEvent, SkillKind, SkillOutcome, SkillPhase};
use domain::time::{Pace, Time};
use domain::wire::{InvalidMessage, duration, failsafe_reason, flight_mode, gripper};
use kittiwake_proto::v1;

use crate::config::Limits;

/// A battery that was heard longer ago, in seconds, does not show what is taken now.
const BATTERY_FRESH_S: f64 = 0.5;

/// The newest introspection, reduced to what decisions depend on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Vehicle {
    pub(crate) position: Ned,
    pub(crate) velocity: NedVelocity,
    pub(crate) flying: bool,
    /// It stands or touches the ground, or has just lifted off.
    pub(crate) near_ground: bool,
    /// It may stand, although it counts as flying: [`FlightState::may_have_drifted`].
    pub(crate) may_have_drifted: bool,
    pub(crate) armed: bool,
    /// The actual mode; `None`: one that has no name here.
    pub(crate) mode: Option<FlightMode>,
    /// When the status with that mode was sent, by its age.
    pub(crate) status_at: Time,
    /// The charge of the battery as it was heard last, however long ago.
    pub(crate) charge: Option<Fraction>,
    /// What the gripper does; `None` where that is not known.
    pub(crate) gripper: Option<Gripper>,
    /// Whether the autopilot itself flies something else than what was asked for, for a reason of its own.
    pub(crate) pre_empted: bool,
    /// Positions of different epochs cannot be compared.
    pub(crate) frame_epoch: u64,
    pub(crate) origin: Option<Origin>,
    /// The wind as it is estimated, towards north and east in m/s; `None` where it is not.
    pub(crate) wind: Option<(f64, f64)>,
    /// What the battery gives, in W; `None` where it is not heard.
    pub(crate) power_w: Option<f64>,
    pub(crate) heard: Heard,
}

/// How old what is known of the vehicle is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Heard {
    pub(crate) at: Time,
    /// When the position was measured, by the vehicle's clock.
    position_us: u64,
    /// When the land detector made its statement, by the same clock.
    landed_us: u64,
}

/// Whether the vehicle flies, by the rule that all processes share.
#[derive(Debug, Default)]
pub(crate) struct FlightJudge {
    state: FlightState,
    frame_epoch: Option<u64>,
    pre_emption: PreEmption,
}

impl FlightJudge {
    /// The autopilot has pre-empted what was asked for, for a reason of its own.
    pub(crate) fn remember_pre_emption(&mut self) {
        self.pre_emption = PreEmption::remembered();
    }
}

/// The vehicle's state as confirmed by the last skill that succeeded. The skill manager hears the vehicle directly; an
/// older introspection may come later, and must not undo what was confirmed.
#[derive(Debug, Default)]
pub(crate) struct ConfirmedState {
    at: Time,
    position: Option<(u64, Ned)>,
    flying: Option<(u64, bool)>,
    /// When the load was seen released.
    released: Option<Time>,
}

impl ConfirmedState {
    pub(crate) fn learn_from(&mut self, now: Time, event: &SkillEvent) {
        if event.phase != SkillPhase::Ended(SkillOutcome::Succeeded) {
            return;
        }
        self.at = now;
        self.flying = match event.kind {
            SkillKind::Land => Some((event.landed_timestamp_us, false)),
            SkillKind::Takeoff => Some((event.landed_timestamp_us, true)),
            _ => self.flying,
        };
        if event.kind == SkillKind::Release {
            self.released = Some(now);
        }
        if let Some(position) = event.position {
            self.position = Some((event.position_timestamp_us, position));
        }
    }

    /// `vehicle` with what has been confirmed, if that is not older. It counts only for a while, because the clock of a
    /// vehicle that was started again starts at zero.
    pub(crate) fn correct(&self, mut vehicle: Vehicle, now: Time, limits: &Limits) -> Vehicle {
        // Where the land detector was silent, motors or height have shown it: that cannot be compared, and counts shortly.
        let counts = |heard_us: u64| match heard_us {
            0 => now <= self.at + limits.introspection,
            _ => vehicle.heard.landed_us <= heard_us && now <= self.at + limits.land_detector,
        };
        if let Some((_, flying)) = self.flying.filter(|it| counts(it.0)) {
            vehicle.flying = flying;
        }
        if self.at + limits.introspection < now {
            return vehicle;
        }
        if let Some((_, position)) = self.position.filter(|it| vehicle.heard.position_us <= it.0) {
            vehicle.position = position;
        }
        if self.released.is_some_and(|at| vehicle.status_at <= at) {
            vehicle.gripper = Some(Gripper::Released);
        }
        vehicle
    }
}

impl Vehicle {
    /// How fast it moves, in whatever direction.
    pub(crate) fn speed_m_s(&self) -> f64 {
        self.velocity.ground_speed_m_s().hypot(self.velocity.climb_rate_m_s())
    }

    /// `None` while a source on which decisions depend has not been heard.
    ///
    /// # Errors
    /// If the content of one of them makes no sense.
    pub(crate) fn from_wire(
        now: Time,
        introspection: &v1::Introspection,
        (judge, pace): (&mut FlightJudge, Pace),
    ) -> Result<Option<Vehicle>, InvalidMessage> {
        let v1::Introspection { status: Some(status), local_position: Some(place), land_detected, ages, .. } =
            introspection
        else {
            return Ok(None);
        };
        let ages = ages.unwrap_or_default();
        let Some(status_age) = ages.status_s else { return Ok(None) };
        let status_age = duration("ages.status_s", status_age)?;
        let age = |field, seconds: Option<f64>| seconds.map_or(Ok(Duration::ZERO), |it| duration(field, it));
        let place = LocalPosition::try_from(*place)?;
        // One that makes no sense is not known: it must not hide where the vehicle is.
        let battery = introspection.battery.filter(|_| ages.battery_s.is_some());
        let charge = battery.and_then(|it| Fraction::try_from(it.remaining).ok());
        let mode = flight_mode(status.actual_mode());
        let intended = flight_mode(status.intended_mode());
        // An old value says nothing about the current power.
        let is_fresh = ages.battery_s.is_some_and(|it| it < BATTERY_FRESH_S);
        let power_w = introspection.battery.filter(|_| is_fresh).and_then(|it| Some(it.voltage_v * it.current_a?));
        let wind = introspection.wind.map(|it| (it.north_m_s, it.east_m_s));
        let motors = Motors { armed: status.armed, lands: mode == Some(FlightMode::Land) };
        if judge.frame_epoch.replace(status.frame_epoch).is_some_and(|before| before != status.frame_epoch) {
            judge.state.frame_moved();
        }
        let signal_lost = status.failures().any(|it| it == v1::FailureFlag::OffboardSignalLost);
        let reason = failsafe_reason(status.failsafe_reason());
        let reported = Reported { failsafe: status.failsafe, intended, actual: mode, signal_lost, reason };
        judge.pre_emption.update(now, reported);
        let position = (age("ages.local_position_s", ages.local_position_s)?, place);
        let landed_age = age("ages.land_detected_s", ages.land_detected_s)?;
        let landed = land_detected.as_ref().map(|it| (landed_age, it.landed));
        judge.state.update(now, Evidence::new(pace, Some((status_age, motors)), Some(position), landed));
        let Some(flying) = judge.state.flying() else { return Ok(None) };
        Ok(Some(Vehicle {
            position: place.position,
            velocity: place.velocity,
            flying,
            near_ground: judge.state.is_near_ground(),
            may_have_drifted: judge.state.may_have_drifted(),
            armed: status.armed,
            mode,
            status_at: Time::after(now.since_start().saturating_sub(status_age)),
            charge,
            gripper: gripper(status.gripper()),
            pre_empted: judge.pre_emption.holds(),
            frame_epoch: status.frame_epoch,
            // One that no place on Earth has is not known.
            origin: status.origin.and_then(|it| Origin::try_from(it).ok()),
            wind: wind.filter(|(north_m_s, east_m_s)| north_m_s.is_finite() && east_m_s.is_finite()),
            power_w: power_w.filter(|it| it.is_finite()),
            heard: Heard {
                at: now,
                position_us: place.timestamp_us,
                landed_us: land_detected.as_ref().map_or(0, |it| it.timestamp_us),
            },
        }))
    }
}
