//! What an operator asks about the mission: to read it, to try another one on paper, to change it.
//!
//! A change is made whole or not at all: what cannot be flown is refused with its reason, and the
//! present mission and plan stay as they are. One that touches the objective that is flown
//! withdraws the plan (see [`MissionPlanner::epoch`]); any other does not disturb the flight.

use domain::file::Source;
use domain::geometry::Ned;
use domain::mission::{Mission, Objective};
use domain::time::Now;
use kittiwake_proto::v1;
use v1::mission_request::Request;

use crate::forecast::Forecast;
use crate::mission_planner::MissionPlanner;
use crate::objectives::Progress;
use crate::state::State;

/// No mission file that a human wrote is longer.
const LONGEST_TEXT: usize = 64 * 1024;
/// More objectives than a battery reaches.
const MOST_OBJECTIVES: usize = 100;

/// Answers `request`. `known` is the vehicle's state as last heard, for a request without one.
pub fn answer(planner: &mut MissionPlanner, known: &State, request: v1::MissionRequest, now: Now) -> v1::MissionReply {
    let state = match request.state.map(State::try_from) {
        None => known.clone(),
        Some(Ok(state)) => state,
        Some(Err(senseless)) => return *refused(format!("`state`: {senseless}")),
    };
    let operator = request.operator;
    let result = match request.request {
        None => Err(refused("no request in it")),
        Some(Request::Read(_)) => Ok(done("the mission as it stands")),
        Some(Request::Validate(it)) => validate(planner, &it.text, &state, now).map(|(_, reply)| reply),
        Some(Request::Upload(it)) => upload(planner, &it.text, &state, now),
        Some(Request::Insert(it)) => insert(planner, it, &state, now),
        Some(Request::Remove(it)) => remove(planner, &it.name),
        Some(Request::Skip(it)) => skip(planner, &it.name, &operator),
    };
    result.unwrap_or_else(|refusal| *refusal)
}

type Refusal = Box<v1::MissionReply>;

fn done(text: impl Into<String>) -> v1::MissionReply {
    v1::MissionReply { accepted: true, text: text.into(), ..Default::default() }
}

fn refused(text: impl Into<String>) -> Refusal {
    Box::new(v1::MissionReply { accepted: false, text: text.into(), ..Default::default() })
}

/// The mission in `text` and what it takes.
fn validate(
    planner: &MissionPlanner,
    text: &str,
    state: &State,
    now: Now,
) -> Result<(Mission, v1::MissionReply), Refusal> {
    if LONGEST_TEXT < text.len() {
        return Err(refused(format!("the text has {} bytes, at most {LONGEST_TEXT} are taken", text.len())));
    }
    let mission = Mission::read(&Source { path: "mission".into(), text: text.to_owned() }).map_err(|mistakes| {
        let mistakes: Vec<String> = mistakes.0.iter().map(|it| it.to_string()).collect();
        let plural = if mistakes.len() == 1 { "" } else { "s" };
        let text = format!("{} mistake{plural} in the text", mistakes.len());
        Box::new(v1::MissionReply { mistakes, ..*refused(text) })
    })?;
    if MOST_OBJECTIVES < mission.objectives.len() {
        return Err(refused(format!("more than {MOST_OBJECTIVES} objectives")));
    }
    let forecast = planner.forecast(mission.clone(), state, now);
    let reply = match unreachable(&forecast) {
        None => done(format!("every objective of `{}` can be reached", mission.name)),
        Some(why) => *refused(why),
    };
    Ok((mission, v1::MissionReply { forecast: forecast.into_iter().map(Into::into).collect(), ..reply }))
}

fn unreachable(forecast: &[Forecast]) -> Option<String> {
    let words = |it: &Forecast| Some(format!("objective `{}`: {}", it.objective, it.unreachable.as_ref()?));
    let found: Vec<String> = forecast.iter().filter_map(words).collect();
    (!found.is_empty()).then(|| found.join("; "))
}

fn upload(planner: &mut MissionPlanner, text: &str, state: &State, now: Now) -> Result<v1::MissionReply, Refusal> {
    if_not_over(planner)?;
    let (mission, reply) = validate(planner, text, state, now)?;
    if !reply.accepted {
        return Err(Box::new(reply));
    }
    let words = format!("`{}` takes the place of `{}`", mission.name, planner.mission().name);
    planner.take_over(mission);
    Ok(v1::MissionReply { text: words, ..reply })
}

fn insert(
    planner: &mut MissionPlanner,
    request: v1::InsertObjective,
    state: &State,
    now: Now,
) -> Result<v1::MissionReply, Refusal> {
    if_not_over(planner)?;
    let objective = objective(request.objective)?;
    let (all, current) = (planner.objectives().all(), planner.objectives().current_index());
    let index = request.index as usize;
    if index < current {
        return Err(refused(format!("objective {index} is settled; the first place to insert at is {current}")));
    }
    if all.len() < index || MOST_OBJECTIVES <= all.len() {
        return Err(refused(format!("there are {} objectives, of at most {MOST_OBJECTIVES}", all.len())));
    }
    if all.iter().any(|it| it.name == objective.name) {
        return Err(refused(format!("there is an objective `{}` already", objective.name)));
    }
    let mut mission = planner.rest_of_mission();
    let waiting_before = all[..index].iter().filter(|it| it.progress == Progress::Waiting).count();
    mission.objectives.insert(waiting_before, objective.clone());
    let forecast = planner.forecast(mission, state, now);
    if let Some(why) = unreachable(&forecast[waiting_before..=waiting_before]) {
        return Err(refused(why));
    }
    let words = format!("objective `{}` inserted at {index}", objective.name);
    planner.insert(index, objective);
    Ok(v1::MissionReply { forecast: forecast.into_iter().map(Into::into).collect(), ..done(words) })
}

fn remove(planner: &mut MissionPlanner, name: &str) -> Result<v1::MissionReply, Refusal> {
    let index = waiting(planner, name)?;
    if planner.objectives().all().len() == 1 {
        return Err(refused(format!("`{name}` is the only objective; skip it, or upload another mission")));
    }
    planner.remove(index);
    Ok(done(format!("objective `{name}` removed")))
}

fn skip(planner: &mut MissionPlanner, name: &str, operator: &str) -> Result<v1::MissionReply, Refusal> {
    let index = waiting(planner, name)?;
    let by = if operator.is_empty() { "the operator" } else { operator };
    planner.skip(index, format!("skipped by {by}"));
    Ok(done(format!("objective `{name}` skipped")))
}

/// The index of the objective with this name, if it is not settled.
fn waiting(planner: &MissionPlanner, name: &str) -> Result<usize, Refusal> {
    let all = planner.objectives().all();
    let index = all.iter().position(|it| it.name == name);
    let index = index.ok_or_else(|| refused(format!("there is no objective `{name}`")))?;
    match &all[index].progress {
        Progress::Waiting => Ok(index),
        Progress::Success => Err(refused(format!("objective `{name}` has been reached"))),
        Progress::Failure(reason) => Err(refused(format!("objective `{name}` has failed: {reason}"))),
    }
}

/// A settled mission is over for good: the manager lands and reports.
fn if_not_over(planner: &MissionPlanner) -> Result<(), Refusal> {
    let objectives = planner.objectives();
    match objectives.current_index() < objectives.all().len() {
        true => Ok(()),
        false => Err(refused("the mission is over: every objective is settled")),
    }
}

fn objective(wire: Option<v1::NewObjective>) -> Result<Objective, Refusal> {
    let wire = wire.ok_or_else(|| refused("`objective` is missing"))?;
    let position = wire.position.ok_or_else(|| refused("`objective.position` is missing"))?;
    let position = Ned::try_from(position).map_err(|it| refused(format!("`objective.position`: {it}")))?;
    Objective::new(wire.name, position, wire.flying).map_err(|it| refused(it.to_string()))
}
