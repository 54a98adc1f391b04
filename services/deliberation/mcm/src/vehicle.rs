//! What the monitor says about the vehicle, as far as missions depend on it.

use domain::geometry::{Ned, NedVelocity};
use domain::time::Time;
use kittiwake_proto::v1;
use std::time::Duration;

/// The newest introspection, reduced to what decisions here look at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Vehicle {
    pub(crate) position: Ned,
    pub(crate) velocity: NedVelocity,
    pub(crate) flying: bool,
    pub(crate) armed: bool,
    /// The mode that is flown, not the one that was asked for.
    pub(crate) mode: v1::FlightMode,
    /// When the status that told the mode was sent, as well as its age tells.
    pub(crate) status_at: Time,
    /// When this introspection arrived.
    pub(crate) seen_at: Time,
    /// When the position was measured, by the vehicle's clock.
    position_us: u64,
    /// When the land detector spoke, by the same clock.
    landed_us: u64,
}

/// What the last skill that succeeded has shown of the vehicle. The skill manager hears the vehicle directly; an
/// introspection from before that may come later, and must not take it back.
#[derive(Debug, Default)]
pub(crate) struct Shown {
    at: Time,
    position: Option<(u64, Ned)>,
    flying: Option<(u64, bool)>,
}

impl Shown {
    /// Learns from news of a skill.
    pub(crate) fn learn_from(&mut self, now: Time, event: &v1::SkillEvent) {
        if event.outcome() != v1::SkillOutcome::Succeeded {
            return;
        }
        self.at = now;
        self.flying = match event.kind() {
            v1::SkillKind::Land => Some((event.landed_timestamp_us, false)),
            v1::SkillKind::Takeoff => Some((event.landed_timestamp_us, true)),
            _ => self.flying,
        };
        if let Some(Ok(position)) = event.position.map(Ned::try_from) {
            self.position = Some((event.position_timestamp_us, position));
        }
    }

    /// `vehicle` with what has been shown, where that is no older. It counts for as long as `limit`: the clock of a
    /// vehicle that was started again begins anew.
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
    /// `None` while a source that decisions need has not spoken, or says what makes no sense.
    pub(crate) fn from_wire(now: Time, it: &v1::Introspection) -> Option<Vehicle> {
        let status = it.status.as_ref()?;
        let place = it.local_position.as_ref()?;
        let land_detected = it.land_detected.as_ref()?;
        let age = it.ages.as_ref()?.status_s?;
        let age = Duration::try_from_secs_f64(age).ok()?;
        Some(Vehicle {
            position: place.position?.try_into().ok()?,
            velocity: place.velocity?.try_into().ok()?,
            flying: !land_detected.landed,
            armed: status.armed,
            mode: status.actual_mode(),
            status_at: Time::after(now.since_start().saturating_sub(age)),
            seen_at: now,
            position_us: place.timestamp_us,
            landed_us: land_detected.timestamp_us,
        })
    }
}
