//! The JSON that leaves over HTTP: the contract's messages in canonical proto3 JSON, arranged for
//! a dashboard.
//!
//! Every document carries `missionTimeS` and `utc`, the gateway's mission time and wall clock when
//! it was made. What has not been seen is `null`, never a default. `wallAgeS` is in wall seconds,
//! since it says whether a machine is well; every other duration is in mission seconds.

use std::time::{Duration, SystemTime};

use domain::time::{Now, Pace, Time};
use kittiwake_proto::json::to_json;
use kittiwake_proto::v1;
use serde_json::{Map, Value, json};

use crate::helm::Helm;
use crate::occurrence::Occurrence;
use crate::process::{Process, Processes};
use crate::state::{Seen, Snapshot, Vehicle};

/// Wall time after which other aircraft are no longer where they were: five of a receiver's reports.
const TRAFFIC_SILENCE: Duration = Duration::from_secs(5);

/// How moments become ages.
#[derive(Debug, Clone, Copy)]
pub struct Ages {
    /// Of the gateway's clock.
    pub pace: Pace,
    /// Mission time without a sign of progress after which a process is stale.
    pub stale_after: Duration,
}

/// Every vehicle in a few words.
pub fn fleet(snapshot: &Snapshot) -> Value {
    let vehicles: Vec<_> = snapshot.fleet.vehicles.iter().map(|(name, it)| summary(name, it)).collect();
    stamped(snapshot.now, json!({ "vehicles": vehicles }))
}

/// Everything about one vehicle; `None` if it was never seen.
pub fn vehicle(snapshot: &Snapshot, name: &str, ages: Ages, helm: &Helm) -> Option<Value> {
    let state = snapshot.fleet.vehicles.get(name)?;
    let now = snapshot.now.time;
    let mcm = message(&state.mcm);
    let view = json!({
        "vehicle": name,
        "command": helm.to_json(),
        "operator": mcm.map(operator),
        "mission": mission(state),
        "plan": plan(state),
        "skill": skill(state),
        "flags": flags(state, now),
        "contingencies": mcm.map(|it| json!({ "acting": it.acting, "active": all(&it.contingencies) })),
        "permissions": message(&state.ledger).map_or_else(|| json!([]), |it| all(&it.permissions)),
        "areas": message(&state.planner).map_or_else(|| json!([]), |it| all(&it.areas)),
        "tree": tree(state),
        "aircraft": aircraft(state),
        "traffic": traffic(state, now, ages.pace),
        "wind": wind(state, now, ages.pace),
        "report": mcm.and_then(|it| it.report.as_ref()).map(to_json),
        "processes": processes(&[&state.processes, &snapshot.fleet.ground], now, ages),
        "sources": sources(state, now, ages.pace),
    });
    Some(stamped(snapshot.now, view))
}

/// A line of history.
pub fn occurrence(now: Now, occurrence: &Occurrence) -> Value {
    let record = match occurrence {
        Occurrence::Decision(it) => to_json(it),
        Occurrence::Skill(it) => to_json(it),
        Occurrence::Flag(it) => to_json(it),
        Occurrence::Permission(it) => to_json(it),
        Occurrence::Objective(it) => to_json(it),
        Occurrence::Report(it) => to_json(it),
    };
    stamped(now, record)
}

/// `object` with the time it was made.
pub fn stamped(now: Now, object: Value) -> Value {
    let mut stamped = Map::new();
    stamped.insert("missionTimeS".into(), json!(now.time.as_secs_f64()));
    stamped.insert("utc".into(), json!(utc(now.utc_ms)));
    if let Value::Object(fields) = object {
        stamped.extend(fields);
    }
    Value::Object(stamped)
}

/// A moment in milliseconds since the Unix epoch, such as `2026-01-01T00:00:00.000Z`.
pub fn utc(ms: i64) -> String {
    // The year 9999 is as far as the text goes.
    let since_epoch = Duration::from_millis(u64::try_from(ms).unwrap_or(0).min(253_402_300_799_999));
    let utc = SystemTime::UNIX_EPOCH.checked_add(since_epoch).unwrap_or(SystemTime::UNIX_EPOCH);
    humantime::format_rfc3339_millis(utc).to_string()
}

fn summary(name: &str, state: &Vehicle) -> Value {
    let mcm = message(&state.mcm);
    let planner = message(&state.planner);
    json!({
        "vehicle": name,
        "phase": mcm.map(|it| it.phase().as_str_name()),
        "outcome": mcm.and_then(|it| it.report.as_ref()).map(|it| it.outcome().as_str_name()),
        "currentObjective": planner.map(|it| it.current_objective),
        "objectives": planner.map(|it| it.objectives.len()),
        "worst": mcm.and_then(|it| it.contingencies.iter().min_by_key(|it| it.priority)).map(|it| &it.flag),
        "flying": message(&state.introspection).and_then(|it| it.derived.as_ref()).map(|it| it.flying),
    })
}

/// What waits for the operator.
fn operator(mcm: &v1::McmStatus) -> Value {
    let approval = mcm.plan_approval.as_ref().map(|it| {
        json!({
            "plan": it.plan.as_ref().map(to_json),
            "revision": it.plan.as_ref().map(|plan| plan.revision.to_string()),
            "untilS": it.left_s,
            "approveByDefault": it.approved_by_default,
        })
    });
    json!({ "startAwaited": mcm.start_awaited, "paused": mcm.paused, "planApproval": approval })
}

fn mission(state: &Vehicle) -> Value {
    let mcm = message(&state.mcm);
    let planner = message(&state.planner);
    json!({
        "name": planner.map(|it| &it.mission),
        "phase": mcm.map(|it| it.phase().as_str_name()),
        "objectives": planner.map_or_else(|| json!([]), |it| all(&it.objectives)),
        "currentObjective": planner.map(|it| it.current_objective),
        "hold": planner.map(|it| &it.hold),
    })
}

/// Both tracks in the order they are flown: the first entry of each belongs to the first step.
fn plan(state: &Vehicle) -> Value {
    let Some(plan) = message(&state.planner).and_then(|it| it.plan.as_ref()) else { return Value::Null };
    let plan_json = to_json(plan);
    let communication: Vec<_> = plan.steps.iter().map(|step| communication_step(step, state)).collect();
    let action = match &plan_json["steps"] {
        Value::Array(steps) => steps.iter().map(action_step).collect(),
        _ => Vec::new(),
    };
    json!({
        "revision": plan_json["revision"],
        "objective": plan_json["objective"],
        "current": message(&state.mcm).map(|it| json!({
            "stepId": it.step.as_ref().map(|step| step.id.to_string()),
            "stepNumber": it.step_number,
            "stepCount": it.step_count,
            "distanceLeftM": it.distance_left_m,
            "inTransition": it.in_transition,
        })),
        "actionTrack": action,
        "communicationTrack": communication,
    })
}

/// The step without what belongs to the other track.
fn action_step(step: &Value) -> Value {
    let mut step = step.clone();
    if let Value::Object(fields) = &mut step {
        fields.remove("askPermissions");
    }
    step
}

fn communication_step(step: &v1::PlanStep, state: &Vehicle) -> Value {
    let ledger = message(&state.ledger).map_or(&[][..], |it| &it.permissions);
    let ask = |area: &String| {
        let permission = ledger.iter().find(|it| it.area == *area);
        json!({ "area": area, "state": permission.map(|it| it.state().as_str_name()) })
    };
    json!({ "stepId": step.id.to_string(), "askPermissions": step.ask_permissions.iter().map(ask).collect::<Vec<_>>() })
}

fn skill(state: &Vehicle) -> Value {
    let skills = &state.skills;
    json!({
        "running": skills.running().map(to_json),
        "feedback": skills.running().and_then(|it| skills.feedback_of(it.skill_id)).map(to_json),
        "active": skills.active().map(to_json).collect::<Vec<_>>(),
        "lastEnded": skills.last_ended.as_ref().map(to_json),
    })
}

fn flags(state: &Vehicle, now: Time) -> Value {
    let flag = |it: &crate::flags::Flag| json!({ "name": it.name, "sinceS": it.since_s, "reason": it.reason, "source": it.source });
    state.flags.up(now).iter().map(flag).collect()
}

fn tree(state: &Vehicle) -> Value {
    let (mcm, tree) = (message(&state.mcm), message(&state.tree));
    if mcm.is_none() && tree.is_none() {
        return Value::Null;
    }
    json!({
        "status": mcm.map(|it| &it.tree_status),
        "ticks": mcm.map(|it| it.ticks.to_string()),
        "tickTimeMs": mcm.and_then(|it| it.tick_time).map(|it| json!({ "p50": it.p50_ms, "max": it.max_ms })),
        "nodes": tree.map_or_else(|| json!([]), |it| all(&it.nodes)),
    })
}

/// The monitor's aggregate with the autopilot's own status, which comes on every change.
fn aircraft(state: &Vehicle) -> Value {
    let mut aircraft = message(&state.introspection).map_or(Value::Null, to_json);
    if let Some(status) = message(&state.status) {
        aircraft["status"] = to_json(status);
    }
    // Flags have a place of their own, with those that were injected.
    if let Value::Object(fields) = &mut aircraft {
        fields.remove("flags");
    }
    aircraft
}

/// Other aircraft that have been reported lately: an old report says nothing of where one is.
fn traffic(state: &Vehicle, now: Time, pace: Pace) -> Value {
    let report = |it: &Seen<v1::TransponderReport>| {
        let age = pace.to_wall(now - it.at);
        let mut report = to_json(&*it.message);
        report["wallAgeS"] = json!(age.as_secs_f64());
        (age < TRAFFIC_SILENCE).then_some(report)
    };
    state.traffic.values().filter_map(report).collect()
}

/// Null unless it was told lately: the wind of a while ago blows nowhere.
fn wind(state: &Vehicle, now: Time, pace: Pace) -> Value {
    let told = state.wind.as_ref().filter(|it| pace.to_wall(now - it.at) < TRAFFIC_SILENCE);
    told.map_or(Value::Null, |it| to_json(&*it.message))
}

fn processes(of: &[&Processes], now: Time, ages: Ages) -> Value {
    let process = |(service, it): (&str, &Process)| {
        let heartbeat = it.heartbeat.as_ref();
        json!({
            "service": service,
            "instance": it.instance,
            "health": it.health(now, ages.stale_after).name(),
            "wallAgeS": heartbeat.map(|(at, _)| ages.pace.to_wall(now - *at).as_secs_f64()),
            "heartbeat": heartbeat.map(|(_, it)| to_json(it)),
        })
    };
    of.iter().flat_map(|it| it.iter()).map(process).collect()
}

fn sources(state: &Vehicle, now: Time, pace: Pace) -> Value {
    fn age<M>(it: &Option<Seen<M>>, now: Time, pace: Pace) -> Value {
        json!({ "wallAgeS": it.as_ref().map(|it| pace.to_wall(now - it.at).as_secs_f64()) })
    }
    json!({
        "vehicleStatus": age(&state.status, now, pace),
        "introspection": age(&state.introspection, now, pace),
        "plannerStatus": age(&state.planner, now, pace),
        "mcmStatus": age(&state.mcm, now, pace),
        "permissionLedger": age(&state.ledger, now, pace),
        "treeSnapshot": age(&state.tree, now, pace),
    })
}

fn message<M>(seen: &Option<Seen<M>>) -> Option<&M> {
    seen.as_ref().map(|it| it.message.as_ref())
}

fn all<M: prost::Message + prost::Name>(messages: &[M]) -> Value {
    messages.iter().map(to_json).collect()
}
