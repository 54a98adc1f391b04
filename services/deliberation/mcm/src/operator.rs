//! What an operator orders: each verb in each state, and what became of it in words.
//!
//! What flies on an order is a row of the contingency table like any other (`operator_*`), below
//! those that keep the vehicle safe; an order raises its flag and nothing else. A command that is
//! repeated under its request id gets the first one's answer and does nothing.

use std::collections::VecDeque;

use domain::geometry::Ned;
use domain::route::way_is_clear;
use kittiwake_proto::v1;
use v1::operator_command::Verb;

use crate::clients::planner::Replanning;
use crate::config::Verdict;
use crate::world::World;

/// The rows behind the verbs.
const ABORT: &str = "operator_abort";
const RETURN: &str = "operator_return";
const LAND: &str = "operator_land";
const PAUSE: &str = "operator_pause";
/// Rows that end the mission, the most urgent first.
const ENDINGS: [&str; 3] = [ABORT, RETURN, LAND];

/// Who raises their flags.
pub(crate) const SOURCE: &str = "operator";
/// A command is repeated within seconds, long before so many new ones.
const REMEMBERED: usize = 64;
/// A landing site farther from the origin than this is a mistake of the hand.
const FARTHEST_M: f64 = 100_000.0;

/// What operators have ordered.
#[derive(Debug, Default)]
pub(crate) struct Operator {
    /// The operator has started the mission.
    pub(crate) has_started: bool,
    /// Where to land on an `operator_land`.
    pub(crate) landing_site: Option<Ned>,
    answers: VecDeque<(String, v1::OperatorReply)>,
}

/// Does what `command` says if the state allows it. `ended`: the manager does nothing any more.
pub(crate) fn obey(world: &mut World, command: v1::OperatorCommand, ended: bool) -> v1::OperatorReply {
    let v1::OperatorCommand { request_id, operator, verb } = command;
    let known = world.operator.answers.iter().find(|(id, _)| *id == request_id);
    if let Some((_, reply)) = known.filter(|_| !request_id.is_empty()) {
        return reply.clone();
    }
    let by = if operator.is_empty() { "the operator".to_owned() } else { operator };
    let (name, result) = match verb {
        _ if request_id.is_empty() => ("a command", Err("it has no request id".to_owned())),
        None => ("a command", Err("it has no verb".to_owned())),
        Some(Verb::Start(_)) => ("start", start(world, ended)),
        Some(Verb::Pause(_)) => ("pause", pause(world, &by, ended)),
        Some(Verb::Resume(_)) => ("resume", resume(world, ended)),
        Some(Verb::Abort(_)) => ("abort", abort(world, &by, ended)),
        Some(Verb::Return(_)) => ("return", return_home(world, &by, ended)),
        Some(Verb::LandAt(it)) => ("land at", land_at(world, it, &by, ended)),
        Some(Verb::Replan(_)) => ("replan", replan(world, &by, ended)),
        Some(Verb::Acknowledge(it)) => ("acknowledge", acknowledge(world, &it.flag, &by)),
        Some(Verb::DecidePlan(it)) => ("decide about the plan", decide(world, it, &by)),
    };
    let reply = match result {
        Ok(text) => v1::OperatorReply { done: true, text },
        Err(text) => v1::OperatorReply { done: false, text },
    };
    let outcome = if reply.done { "" } else { "refused: " };
    world.say("operator", format!("{by}: {name}: {outcome}{}", reply.text));
    if !request_id.is_empty() {
        world.operator.answers.push_back((request_id, reply.clone()));
        while REMEMBERED < world.operator.answers.len() {
            world.operator.answers.pop_front();
        }
    }
    reply
}

/// Whether the operator has the vehicle hold.
pub(crate) fn is_paused(world: &World) -> bool {
    world.flags.get(PAUSE).is_some_and(|it| it.holds())
}

/// Flies the plan that waits for approval, or holds.
pub(crate) fn decide_plan(world: &mut World, verdict: Verdict, why: &str) {
    let Some(proposal) = world.planner.proposal().cloned() else { return };
    let revision = proposal.plan.revision;
    match verdict {
        Verdict::Approve => {
            world.say("plan", format!("plan {revision} approved: {why}"));
            world.planner.adopt(proposal.plan);
            world.timing.mark(v1::TimingPoint::PlanReady);
        }
        Verdict::Refuse => {
            world.say("plan", format!("plan {revision} refused: {why}"));
            world.planner.replanning = Replanning::Idle;
            world.raise(PAUSE, SOURCE, format!("plan {revision} refused: {why}"));
        }
    }
}

type Outcome = Result<String, String>;

fn start(world: &mut World, ended: bool) -> Outcome {
    if_going_on(world, ended)?;
    if !world.awaits_start() {
        return Err("the mission has started already".into());
    }
    world.operator.has_started = true;
    Ok("the mission starts".into())
}

fn pause(world: &mut World, by: &str, ended: bool) -> Outcome {
    if_under_way(world, ended)?;
    if_not_ending(world, &ENDINGS)?;
    if is_paused(world) {
        return Err("it holds already".into());
    }
    order(world, PAUSE, by)?;
    Ok(match more_urgent(world, PAUSE) {
        None => "holds until resumed".into(),
        Some(other) => format!("holds until resumed, once `{other}` is over"),
    })
}

fn resume(world: &mut World, ended: bool) -> Outcome {
    if_under_way(world, ended)?;
    if !is_paused(world) {
        return Err("it does not hold for an operator".into());
    }
    let raised = world.flags.get(PAUSE).map(|it| it.sources().map(str::to_owned).collect::<Vec<_>>());
    for source in raised.into_iter().flatten() {
        world.flags.condition_gone(PAUSE, &source);
    }
    Ok(match more_urgent(world, PAUSE) {
        None => "goes on with a new plan".into(),
        Some(other) => format!("goes on once `{other}` is over"),
    })
}

fn abort(world: &mut World, by: &str, ended: bool) -> Outcome {
    if_going_on(world, ended)?;
    if_not_ending(world, &ENDINGS[..1])?;
    let flies = world.is_flying();
    order(world, ABORT, by)?;
    Ok(match (more_urgent(world, ABORT), flies) {
        (Some(other), _) => format!("lands and ends the mission, unless `{other}` does first"),
        (None, true) => "lands here and ends the mission".into(),
        (None, false) => "ends the mission on the ground".into(),
    })
}

fn return_home(world: &mut World, by: &str, ended: bool) -> Outcome {
    if_in_the_air(world, ended)?;
    if_not_ending(world, &ENDINGS[..2])?;
    order(world, RETURN, by)?;
    Ok(match more_urgent(world, RETURN) {
        None => "flies home, lands and ends the mission".into(),
        Some(other) => format!("flies home once `{other}` is over"),
    })
}

fn land_at(world: &mut World, request: v1::LandAt, by: &str, ended: bool) -> Outcome {
    if_in_the_air(world, ended)?;
    if_not_ending(world, &ENDINGS)?;
    let position = request.position.ok_or("`position` is missing")?;
    let site = Ned::try_from(v1::Ned { down_m: 0.0, ..position }).map_err(|it| format!("`position`: {it}"))?;
    if FARTHEST_M < site.horizontal_distance_m(Ned::default()) {
        return Err(format!("the site is farther than {FARTHEST_M} m from the origin"));
    }
    let here = world.vehicle.ok_or("where the vehicle is, is not known")?.position;
    let above = site.at_height(here.height_m());
    let (areas, held) = (&world.planner.areas, world.held());
    let clear = |from, to| way_is_clear(from, to, areas, &held, world.now.utc_ms);
    if !clear(here, above) || !clear(above, site) {
        return Err("the straight way there leads through an area that may not be entered".into());
    }
    world.operator.landing_site = Some(site);
    order(world, LAND, by)?;
    let place = format!("({:.0}, {:.0})", site.north_m, site.east_m);
    Ok(match more_urgent(world, LAND) {
        None => format!("flies to {place}, lands there and ends the mission"),
        Some(other) => format!("flies to {place} once `{other}` is over"),
    })
}

fn replan(world: &mut World, by: &str, ended: bool) -> Outcome {
    if_under_way(world, ended)?;
    if let Some((flag, _)) = world.flags.iter().next() {
        return Err(format!("`{flag}` is up; a new plan is made when that is over"));
    }
    world.planner.withdraw(format!("{by} wants a new plan"));
    Ok("a new plan is made".into())
}

fn acknowledge(world: &mut World, flag: &str, by: &str) -> Outcome {
    let Some(it) = world.flags.get(flag) else { return Err(format!("`{flag}` is not up")) };
    if let Some(other) = &it.acknowledged_by {
        return Err(format!("{other} has acknowledged `{flag}` already"));
    }
    world.flags.acknowledge(flag, by);
    Ok(format!("`{flag}` acknowledged"))
}

fn decide(world: &mut World, request: v1::DecidePlan, by: &str) -> Outcome {
    let Some(proposal) = world.planner.proposal() else { return Err("no plan waits for approval".into()) };
    let waiting = proposal.plan.revision;
    if waiting != request.revision {
        return Err(format!("plan {waiting} waits for approval, not plan {}", request.revision));
    }
    let (verdict, words) = match request.approve {
        true => (Verdict::Approve, format!("plan {waiting} is flown")),
        false => (Verdict::Refuse, format!("plan {waiting} is not flown; holds until resumed")),
    };
    decide_plan(world, verdict, &format!("by {by}"));
    Ok(words)
}

/// Raises the flag of an operator's row.
fn order(world: &mut World, flag: &str, by: &str) -> Result<(), String> {
    if world.table.row(flag).is_none() {
        return Err(format!("the contingency table has no row `{flag}`"));
    }
    world.raise(flag, SOURCE, format!("ordered by {by}"));
    Ok(())
}

/// The most urgent flag above `flag` that is up.
fn more_urgent(world: &World, flag: &str) -> Option<String> {
    let row = world.table.row(flag)?;
    let above = world.table.rows().iter().filter(|it| it.priority < row.priority && world.flags.is_up(&it.flag));
    above.min_by_key(|it| it.priority).map(|it| it.flag.clone())
}

fn if_going_on(world: &World, ended: bool) -> Result<(), String> {
    match &world.mission.over {
        Some(over) => Err(format!("the mission is over: {}", over.reason)),
        None if ended => Err("the mission is over".into()),
        None => Ok(()),
    }
}

fn if_under_way(world: &World, ended: bool) -> Result<(), String> {
    if_going_on(world, ended)?;
    if world.awaits_start() {
        return Err("the mission has not started".into());
    }
    Ok(())
}

fn if_in_the_air(world: &World, ended: bool) -> Result<(), String> {
    if_under_way(world, ended)?;
    if !world.is_flying() {
        return Err("the vehicle is on the ground".into());
    }
    Ok(())
}

/// Refuses what is asked while the mission already ends by one of `flags`.
fn if_not_ending(world: &World, flags: &[&str]) -> Result<(), String> {
    match flags.iter().find(|it| world.flags.is_up(it)) {
        Some(flag) => Err(format!("`{flag}` is under way already")),
        None => Ok(()),
    }
}
