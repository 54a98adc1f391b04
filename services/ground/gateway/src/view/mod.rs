//! The documents that leave over HTTP, made of a [`Snapshot`]: messages of `view.proto`.
//!
//! What was never seen is absent, never a default; the rules are in that file.

use std::time::{Duration, SystemTime};

use domain::time::{Now, Pace, Time};
use kittiwake_proto::v1;
use node::VehicleId;
use serde_json::{Value, json};

use crate::fleet::{Snapshot, VehicleState, message_of};

#[cfg(test)]
mod tests;
pub(crate) mod vehicle;

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
    let (mission_time_s, utc) = stamp(snapshot.now);
    let entry =
        |(name, state): (&VehicleId, &VehicleState)| fleet_entry(name, state, contact(state, snapshot.now.time, ages));
    let vehicles = snapshot.fleet.vehicles.iter().map(entry).collect();
    v1::Fleet { mission_time_s, utc, vehicles }
}

fn fleet_entry(name: &str, state: &VehicleState, contact: v1::Contact) -> v1::fleet::Entry {
    let (mcm, planner) = (message_of(&state.mcm), message_of(&state.planner));
    let worst = mcm.and_then(|it| it.contingencies.iter().min_by_key(|row| row.priority));
    let introspection = message_of(&state.introspection);
    let derived = introspection.and_then(|it| it.derived.as_ref());
    v1::fleet::Entry {
        vehicle: name.to_owned(),
        phase: mcm.map(|it| it.phase),
        outcome: mcm.and_then(|it| it.report.as_ref()).map(|report| report.outcome),
        current_objective: planner.map(|it| it.current_objective),
        objectives: planner.map(|it| u32::try_from(it.objectives.len()).unwrap_or(u32::MAX)),
        worst: worst.map(|row| row.flag.clone()),
        flying: derived.map(|it| it.flying),
        contact: Some(contact),
        acting: mcm.map(|it| it.acting.clone()).filter(|it| !it.is_empty()),
        battery_remaining: introspection.and_then(|it| it.battery.as_ref()).map(|it| it.remaining),
        height_m: derived.map(|it| it.height_m),
    }
}

/// Whether a vehicle is heard.
pub(crate) fn contact(state: &VehicleState, now: Time, ages: Ages) -> v1::Contact {
    let wall_age_s = state.silent_for(now).map(|it| ages.pace.to_wall(it).as_secs_f64());
    v1::Contact { wall_age_s, lost: state.is_lost(now, ages.stale_after) }
}

/// `mission_time_s` and `utc` of a document made now.
pub(crate) fn stamp(now: Now) -> (f64, String) {
    (now.time.as_secs_f64(), utc(now.utc_ms))
}

/// A JSON object with the same stamp.
pub(crate) fn stamped(now: Now, mut object: Value) -> Value {
    let (mission_time_s, utc) = stamp(now);
    object["missionTimeS"] = json!(mission_time_s);
    object["utc"] = json!(utc);
    object
}

/// A moment in milliseconds since the Unix epoch, such as `2026-01-01T00:00:00.000Z`.
pub(crate) fn utc(ms: i64) -> String {
    // The text goes no further than the year 9999.
    let since_epoch = Duration::from_millis(u64::try_from(ms).unwrap_or(0).min(253_402_300_799_999));
    let utc = SystemTime::UNIX_EPOCH.checked_add(since_epoch).unwrap_or(SystemTime::UNIX_EPOCH);
    humantime::format_rfc3339_millis(utc).to_string()
}
