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
}

impl Vehicle {
    /// `None` while a source that decisions need has not spoken, or says what makes no sense.
    pub(crate) fn from_wire(now: Time, it: &v1::Introspection) -> Option<Vehicle> {
        let status = it.status.as_ref()?;
        let place = it.local_position.as_ref()?;
        let landed = it.land_detected.as_ref()?.landed;
        let age = it.ages.as_ref()?.status_s?;
        let age = Duration::try_from_secs_f64(age).ok()?;
        Some(Vehicle {
            position: place.position?.try_into().ok()?,
            velocity: place.velocity?.try_into().ok()?,
            flying: !landed,
            armed: status.armed,
            mode: status.actual_mode(),
            status_at: Time::after(now.since_start().saturating_sub(age)),
            seen_at: now,
        })
    }
    /// A skill that succeeded has been seen in the vehicle's data by the skill manager; the next
    /// introspection says the same up to 10 ms later, too late for what follows at once.
    pub(crate) fn learn_from(&mut self, event: &v1::SkillEvent) {
        if event.outcome() == v1::SkillOutcome::Succeeded {
            match event.kind() {
                v1::SkillKind::Land => self.flying = false,
                v1::SkillKind::Takeoff => self.flying = true,
                _ => {}
            }
            if let Some(Ok(position)) = event.position.map(Ned::try_from) {
                self.position = position;
            }
        }
    }
}
