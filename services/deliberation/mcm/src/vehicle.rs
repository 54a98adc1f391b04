//! The monitor's introspection, as far as missions depend on it.

use std::time::Duration;

use domain::flight_state::{Evidence, FlightState, Motors};
use domain::fmu::{FlightMode, LocalPosition};
use domain::geometry::{Ned, NedVelocity};
use domain::quantity::Fraction;
use domain::skill::{SkillEvent, SkillKind, SkillOutcome, SkillPhase};
use domain::time::{Pace, Time};
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
    /// The charge of the battery as it was heard last, however long ago.
    pub(crate) charge: Option<Fraction>,
    /// When this introspection arrived.
    pub(crate) seen_at: Time,
    /// When the position was measured, by the vehicle's clock.
    position_us: u64,
    /// When the land detector made its statement, by the same clock.
    landed_us: u64,
}

/// Whether the vehicle flies, by the rule that all processes share.
#[derive(Debug)]
pub(crate) struct FlightJudge {
    state: FlightState,
    pace: Pace,
}

impl FlightJudge {
    /// Nothing is known yet.
    pub(crate) fn new(pace: Pace) -> FlightJudge {
        FlightJudge { state: FlightState::default(), pace }
    }
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
        // Where the land detector was silent, motors or height have shown it: that cannot be compared.
        if let Some((_, flying)) = self.flying.filter(|it| it.0 == 0 || vehicle.landed_us <= it.0) {
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
    pub(crate) fn from_wire(
        now: Time,
        introspection: &v1::Introspection,
        judge: &mut FlightJudge,
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
        let motors = Motors { armed: status.armed, lands: mode == Some(FlightMode::Land) };
        let position = (age("ages.local_position_s", ages.local_position_s)?, place);
        let landed_age = age("ages.land_detected_s", ages.land_detected_s)?;
        let landed = land_detected.as_ref().map(|it| (landed_age, it.landed));
        judge.state.update(now, Evidence::new(judge.pace, Some(motors), Some(position), landed));
        let Some(flying) = judge.state.flying() else { return Ok(None) };
        Ok(Some(Vehicle {
            position: place.position,
            velocity: place.velocity,
            flying,
            armed: status.armed,
            mode,
            status_at: Time::after(now.since_start().saturating_sub(status_age)),
            charge,
            seen_at: now,
            position_us: place.timestamp_us,
            landed_us: land_detected.as_ref().map_or(0, |it| it.timestamp_us),
        }))
    }
}
