//! The whole state of one vehicle as a document.

use std::time::Duration;

use domain::time::Time;
use kittiwake_proto::v1;
use kittiwake_proto::v1::vehicle as doc;

use crate::fleet::processes::{Health, Process, Processes};
use crate::fleet::{Seen, Snapshot, VehicleState, message_of};
use crate::view::waits::waits_for;
use crate::view::{Ages, contact, utc};

/// Wall time after which the reported wind and traffic are out of date: five periods of a receiver's reports.
const REPORT_LIFETIME: Duration = Duration::from_secs(5);

/// Wall seconds for which the control tower may be silent: a ledger, or a part of one, comes at 1 Hz, and one may be lost.
const LEDGER_LATE_S: f64 = 2.5;

/// Everything about one vehicle; `None` if it was never seen.
pub(crate) fn vehicle(
    snapshot: &Snapshot,
    name: &str,
    ages: Ages,
    authority: &v1::CommandAuthority,
) -> Option<v1::Vehicle> {
    let state = snapshot.fleet.vehicles.get(name)?;
    let now = snapshot.now.time;
    let (mcm, planner) = (message_of(&state.mcm), message_of(&state.mission));
    Some(v1::Vehicle {
        mission_time_s: state.mission_time_s(now),
        utc: utc(snapshot.now.utc_ms),
        vehicle: name.to_owned(),
        command: Some(authority.clone()),
        operator: mcm.map(operator),
        mission: Some(mission(state)),
        plan: planner.and_then(|it| it.plan.as_ref()).map(|it| plan(it, state)),
        skill: Some(skills(state)),
        flags: state.flags.up(now),
        contingencies: mcm.map(contingencies),
        permissions: message_of(&state.ledger).map_or_else(Vec::new, |it| it.permissions.clone()),
        areas: planner.map_or_else(Vec::new, |it| it.areas.clone()),
        sites: planner.map_or_else(Vec::new, |it| it.sites.clone()),
        feeds: planner.map_or_else(Vec::new, |it| it.feeds.clone()),
        alternates: mcm.map_or_else(Vec::new, |it| it.alternates.clone()),
        energy: mcm.and_then(|it| it.energy.clone()),
        awaited: mcm.map_or_else(Vec::new, |it| it.awaited.clone()),
        waits_for: mcm.map_or_else(Vec::new, waits_for),
        tree: tree(state),
        aircraft: aircraft(state),
        traffic: state.traffic.values().filter_map(|it| traffic(it, now, ages)).collect(),
        wind: state.wind.as_ref().filter(|it| ages.wall(it, now) < REPORT_LIFETIME).map(|it| *it.message),
        pictures: state.pictures,
        report: state.report().cloned(),
        processes: processes(state, &snapshot.fleet.ground, now, ages),
        sources: Some(sources(state, now, ages)),
        tower: tower(state, &snapshot.fleet.ground, now, ages),
        contact: Some(contact(state, now, ages)),
    })
}

fn contingencies(mcm: &v1::McmStatus) -> doc::Contingencies {
    doc::Contingencies {
        acting: mcm.acting.clone(),
        active: mcm.contingencies.clone(),
        way: mcm.response_way.clone(),
        ends: mcm.ends.clone(),
    }
}

/// What waits for the operator.
fn operator(mcm: &v1::McmStatus) -> doc::OperatorState {
    let approval = |it: &v1::PlanApproval| doc::Approval {
        plan: it.plan.clone(),
        revision: it.plan.as_ref().map(|plan| plan.revision),
        until_s: it.left_s,
        approve_by_default: it.approved_by_default,
    };
    doc::OperatorState {
        start_awaited: mcm.start_awaited,
        paused: mcm.paused,
        plan_approval: mcm.plan_approval.as_ref().map(approval),
        uninspected_crash: mcm.uninspected_crash.clone(),
    }
}

fn mission(state: &VehicleState) -> doc::MissionState {
    let planner = message_of(&state.mission);
    doc::MissionState {
        name: planner.map(|it| it.mission.clone()),
        phase: message_of(&state.mcm).map(|it| it.phase),
        objectives: planner.map_or_else(Vec::new, |it| it.objectives.clone()),
        current_objective: planner.map(|it| it.current_objective),
        hold: planner.map(|it| it.hold.clone()),
    }
}

fn plan(plan: &v1::Plan, state: &VehicleState) -> doc::PlanState {
    let current = |it: &v1::McmStatus| doc::CurrentStep {
        step_id: it.step.as_ref().map(|step| step.id),
        step_number: it.step_number,
        step_count: it.step_count,
        distance_left_m: it.distance_left_m,
        in_transition: it.in_transition,
    };
    doc::PlanState {
        revision: plan.revision,
        objective: plan.objective,
        current: message_of(&state.mcm).map(current),
        action_track: plan.steps.iter().map(action_step).collect(),
        communication_track: plan.steps.iter().map(|step| communication_step(step, state)).collect(),
    }
}

fn action_step(step: &v1::PlanStep) -> doc::ActionStep {
    doc::ActionStep {
        id: step.id,
        objective: step.objective,
        goal_state: step.goal_state.clone(),
        nominal: step.nominal.clone(),
        auxiliary: step.auxiliary,
        text: step.text.clone(),
    }
}

fn communication_step(step: &v1::PlanStep, state: &VehicleState) -> doc::CommunicationStep {
    let ledger = message_of(&state.ledger).map_or(&[][..], |it| &it.permissions);
    let ask = |area: &String| {
        let permission = ledger.iter().find(|permission| permission.area == *area);
        doc::Ask { area: area.clone(), state: permission.map(|it| it.state) }
    };
    doc::CommunicationStep {
        step_id: step.id,
        ask_permissions: step.ask_permissions.iter().map(ask).collect(),
        ask_ahead: step.ask_ahead.iter().map(|ahead| ask(&ahead.area)).collect(),
    }
}

fn skills(state: &VehicleState) -> doc::Skills {
    let (skills, running) = (&state.skills, state.skills.running());
    doc::Skills {
        running: running.cloned(),
        feedback: running.and_then(|it| skills.feedback_of(it.skill_id)).cloned(),
        active: skills.active().cloned().collect(),
        last_ended: skills.last_ended.clone(),
    }
}

fn tree(state: &VehicleState) -> Option<doc::Tree> {
    let (mcm, tree) = (message_of(&state.mcm), message_of(&state.tree));
    if mcm.is_none() && tree.is_none() {
        return None;
    }
    Some(doc::Tree {
        status: mcm.map(|it| it.tree_status.clone()),
        ticks: mcm.map(|it| it.ticks),
        tick_time_ms: mcm.and_then(|it| it.tick_time).map(|it| doc::TickTimeMs { p50: it.p50_ms, max: it.max_ms }),
        nodes: tree.map_or_else(Vec::new, |it| it.nodes.clone()),
    })
}

/// Without the monitor's flags: `Vehicle.flags` has them together with those that were injected.
fn aircraft(state: &VehicleState) -> Option<doc::Aircraft> {
    let aircraft = message_of(&state.introspection).cloned().map(|it| doc::Aircraft {
        status: it.status,
        attitude: it.attitude,
        local_position: it.local_position,
        global_position: it.global_position,
        land_detected: it.land_detected,
        battery: it.battery,
        ages: it.ages,
        derived: it.derived,
    });
    match message_of(&state.status).cloned() {
        Some(status) => Some(doc::Aircraft { status: Some(status), ..aircraft.unwrap_or_default() }),
        None => aircraft,
    }
}

/// `None` for an old report: it does not say where the aircraft is now.
fn traffic(seen: &Seen<v1::TransponderReport>, now: Time, ages: Ages) -> Option<doc::Traffic> {
    let age = ages.wall(seen, now);
    let v1::TransponderReport { id, position, velocity, kind } = v1::TransponderReport::clone(&seen.message);
    (age < REPORT_LIFETIME).then_some(doc::Traffic { id, position, velocity, kind, wall_age_s: age.as_secs_f64() })
}

fn processes(state: &VehicleState, ground: &Processes, now: Time, ages: Ages) -> Vec<doc::Process> {
    let of_vehicle = state.processes.iter().map(|(name, it)| (name, it, state.health(it, now, ages.stale_after)));
    let of_ground = ground.iter().map(|(name, it)| (name, it, it.health(now, ages.stale_after)));
    let process = |(service, it, health): (&str, &Process, Health)| doc::Process {
        service: service.to_owned(),
        instance: it.instance.clone(),
        health: health.name().to_owned(),
        wall_age_s: it.heartbeat.as_ref().map(|(at, _)| ages.pace.to_wall(now - *at).as_secs_f64()),
        heartbeat: it.heartbeat.as_ref().map(|(_, heartbeat)| heartbeat.clone()),
    };
    of_vehicle.chain(of_ground).map(process).collect()
}

/// Why the permissions may not be the tower's present decisions.
fn tower(state: &VehicleState, ground: &Processes, now: Time, ages: Ages) -> Option<doc::Tower> {
    let seen = state.ledger.as_ref()?;
    let memory = seen.message.memory.clone().unwrap_or_default();
    let age_s = ages.wall(seen, now).as_secs_f64();
    let health = ground.get("control-tower").map(|it| it.health(now, ages.stale_after));
    let stale = match (&memory.loss, health) {
        (_, Some(Health::Dead)) => "the control tower is gone".to_owned(),
        _ if LEDGER_LATE_S < age_s => format!("the control tower was heard last {age_s:.0} s ago"),
        (Some(loss), _) => format!("the control tower has lost earlier decisions: {}", loss.why),
        (None, _) => String::new(),
    };
    Some(doc::Tower { stale, memory: Some(memory) })
}

/// The sources with the wall seconds that each may be silent: the slow ones are repeated at 1 or 2 Hz by the contract,
/// the monitor's at 2 Hz over the link and faster on board.
fn sources(state: &VehicleState, now: Time, ages: Ages) -> doc::Sources {
    fn source<M>(seen: &Option<Seen<M>>, late_s: f64, now: Time, ages: Ages) -> Option<doc::Source> {
        Some(doc::Source {
            wall_age_s: seen.as_ref().map(|seen| ages.wall(seen, now).as_secs_f64()),
            stale_after_wall_s: ages.status_period.as_secs_f64() + late_s,
        })
    }
    doc::Sources {
        vehicle_status: source(&state.status, 1.5, now, ages),
        introspection: source(&state.introspection, 0.4, now, ages),
        mission_status: source(&state.mission, 2.5, now, ages),
        mcm_status: source(&state.mcm, 1.5, now, ages),
        permission_ledger: source(&state.ledger, LEDGER_LATE_S, now, ages),
        tree_snapshot: source(&state.tree, 1.5, now, ages),
    }
}

impl Ages {
    /// Wall time since a message arrived.
    pub(crate) fn wall<M>(self, seen: &Seen<M>, now: Time) -> Duration {
        self.pace.to_wall(now - seen.at)
    }
}
