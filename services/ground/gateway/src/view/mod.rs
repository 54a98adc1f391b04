//! The documents that leave over HTTP, made of a [`Snapshot`]: messages of `view.proto`.
//!
//! What was never seen is absent, never a default; the rules are in that file.

use std::cmp::Reverse;
use std::time::Duration;

use domain::time::{Pace, Time, utc_text_with_millis};
use kittiwake_proto::v1;
use node::VehicleId;
use serde_json::{Value, json};

use crate::fleet::{Snapshot, VehicleState, message_of};

#[cfg(test)]
mod tests;
pub(crate) mod vehicle;
mod waits;

/// How moments become ages.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ages {
    /// The pace of the gateway's clock.
    pub(crate) pace: Pace,
    /// Mission time without a sign of progress after which a process is stale.
    pub(crate) stale_after: Duration,
    /// Wall time between two `status` events.
    pub(crate) status_period: Duration,
}

/// Every vehicle in a few words.
pub(crate) fn fleet(snapshot: &Snapshot, ages: Ages) -> v1::Fleet {
    let entry = |(name, state): (&VehicleId, &VehicleState)| fleet_entry(name, state, snapshot.now.time, ages);
    let vehicles = snapshot.fleet.vehicles.iter().map(entry).collect();
    v1::Fleet { mission_time_s: snapshot.now.time.as_secs_f64(), utc: utc(snapshot.now.utc_ms), vehicles }
}

/// A slower vehicle has no course, in m/s: what is left of its speed is noise.
const AT_REST_M_S: f64 = 0.5;

fn fleet_entry(name: &str, state: &VehicleState, now: Time, ages: Ages) -> v1::fleet::Entry {
    let (mcm, planner) = (message_of(&state.mcm), message_of(&state.mission));
    let worst = mcm.and_then(|it| it.contingencies.iter().min_by_key(|row| (Reverse(row.alarm), row.priority)));
    let introspection = message_of(&state.introspection);
    let derived = introspection.and_then(|it| it.derived.as_ref());
    v1::fleet::Entry {
        vehicle: name.to_owned(),
        phase: mcm.map(|it| it.phase),
        outcome: state.report().map(|report| report.outcome),
        current_objective: planner.map(|it| it.current_objective),
        objectives: planner.map(|it| u32::try_from(it.objectives.len()).unwrap_or(u32::MAX)),
        worst: worst.map(|row| row.flag.clone()),
        flying: derived.map(|it| it.flying),
        contact: Some(contact(state, now, ages)),
        acting: mcm.map(|it| it.acting.clone()).filter(|it| !it.is_empty()),
        battery_remaining: introspection.and_then(|it| it.battery.as_ref()).map(|it| it.remaining),
        height_m: derived.map(|it| it.height_m),
        worst_alarm: worst.map(|row| row.alarm),
        mission_time_s: state.mission_time_s(now),
        contingencies: mcm.map_or_else(Vec::new, |it| it.contingencies.clone()),
        global_position: introspection.and_then(|it| it.global_position),
        course_deg: introspection.and_then(|it| it.local_position.as_ref()?.velocity).and_then(course_deg),
        waits_for: mcm.map_or_else(Vec::new, waits::waits_for),
    }
}

/// The direction of a movement over ground, in degrees from north over east.
fn course_deg(v1::NedVelocity { north_m_s, east_m_s, .. }: v1::NedVelocity) -> Option<f64> {
    (AT_REST_M_S <= north_m_s.hypot(east_m_s)).then(|| east_m_s.atan2(north_m_s).to_degrees().rem_euclid(360.0))
}

/// Whether a vehicle is heard.
pub(crate) fn contact(state: &VehicleState, now: Time, ages: Ages) -> v1::Contact {
    let wall_age_s = state.silent_for(now).map(|it| ages.pace.to_wall(it).as_secs_f64());
    v1::Contact { wall_age_s, lost: state.is_lost(now, ages.stale_after) }
}

/// A JSON object with `utc`, and with `missionTimeS` where the vehicle's mission time is known.
pub(crate) fn stamped(mission_time_s: Option<f64>, utc_ms: i64, mut object: Value) -> Value {
    if let Some(mission_time_s) = mission_time_s {
        object["missionTimeS"] = json!(mission_time_s);
    }
    object["utc"] = json!(utc(utc_ms));
    object
}

/// A moment in milliseconds since the Unix epoch, such as `2026-01-01T00:00:00.000Z`.
pub(crate) fn utc(ms: i64) -> String {
    utc_text_with_millis(ms)
}
