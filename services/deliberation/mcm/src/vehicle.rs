//! The monitor's introspection, as far as missions depend on it.

use std::time::Duration;

use domain::fmu::FlightMode;
use domain::geometry::{Ned, NedVelocity};
use domain::skill::{SkillEvent, SkillKind, SkillOutcome, SkillPhase};
use domain::time::Time;
use domain::wire::{InvalidMessage, duration, flight_mode};
use kittiwake_proto::v1;

/// The newest introspection, reduced to what decisions depend on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Vehicle {
    pub(crate) position: Ned,
    pub(crate) velocity: NedVelocity,
    pub(crate) flying: bool,
    pub(crate) armed: bool,
    /// The actual mode; `None`: one that has no name here.
    pub(crate) mode: Option<FlightMode>,
    /// When the status with that mode was sent, by its age.
    pub(crate) status_at: Time,
    /// When this introspection arrived.
    pub(crate) seen_at: Time,
    /// When the position was measured, by the vehicle's clock.
    position_us: u64,
    /// When the land detector made its statement, by the same clock.
    landed_us: u64,
}

/// The vehicle's state as confirmed by the last skill that succeeded. The skill manager hears the vehicle directly; an
/// older introspection may come later, and must not undo what was confirmed.
#[derive(Debug, Default)]
pub(crate) struct ConfirmedState {
    at: Time,
    position: Option<(u64, Ned)>,
    flying: Option<(u64, bool)>,
}

impl ConfirmedState {
    /// Takes in an event of a skill.
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
        if let Some(position) = event.position {
            self.position = Some((event.position_timestamp_us, position));
        }
    }

    /// `vehicle` with what has been confirmed, if that is not older. It counts only for `limit`, because the clock of a
    /// vehicle that was started again starts at zero.
    pub(crate) fn correct(&self, mut vehicle: Vehicle, now: Time, limit: Duration) -> Vehicle {
        if self.at + limit < now {
            return vehicle;
        }
        if let Some((_, position)) = self.position.filter(|it| vehicle.position_us <= it.0) {
            vehicle.position = position;
        }
        if let Some((_, flying)) = self.flying.filter(|it| vehicle.landed_us <= it.0) {
            vehicle.flying = flying;
        }
        vehicle
    }
}

impl Vehicle {
    /// `None` while a source on which decisions depend has not been heard.
    ///
    /// # Errors
    /// If the content of one of them makes no sense.
    pub(crate) fn from_wire(now: Time, introspection: &v1::Introspection) -> Result<Option<Vehicle>, InvalidMessage> {
        let v1::Introspection { status: Some(status), local_position: Some(place), land_detected, ages, .. } =
            introspection
        else {
            return Ok(None);
        };
        let (Some(land_detected), Some(age)) = (land_detected, ages.as_ref().and_then(|it| it.status_s)) else {
            return Ok(None);
        };
        let age = duration("ages.status_s", age)?;
        let land_detected_age_s = ages.as_ref().and_then(|it| it.land_detected_s);
        let is_newer = land_detected_age_s.is_none_or(|it| age.as_secs_f64() < it);
        // A vehicle whose motors stand does not fly, although its land detector has fallen silent.
        let is_disarmed = !status.armed && is_newer;
        Ok(Some(Vehicle {
            position: place.position.ok_or(InvalidMessage::Missing("local_position.position"))?.try_into()?,
            velocity: place.velocity.ok_or(InvalidMessage::Missing("local_position.velocity"))?.try_into()?,
            flying: !land_detected.landed && !is_disarmed,
            armed: status.armed,
            mode: flight_mode(status.actual_mode()),
            status_at: Time::after(now.since_start().saturating_sub(age)),
            seen_at: now,
            position_us: place.timestamp_us,
            landed_us: land_detected.timestamp_us,
        }))
    }
}
