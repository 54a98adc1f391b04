//! Turns objectives into plans: what to fly, and which permissions to get on the way.
//!
//! A function in a process of its own: a question brings the mission as far as it has come, the vehicle's state and the tower's answers,
//! and the answer says what has become of the mission. What is kept between questions are caches. It never waits: where there is nothing
//! to fly it says how long to hold. It does not fly, and it does not ask the control tower: the mission manager does both, step by step.
//!
//! Messages become domain types here and in `wire` and `notes`; nothing below knows of them.

use std::sync::Arc;

use domain::aircraft::Aircraft;
use domain::declared_skill::DeclaredSkills;
use domain::geometry::Ned;
use domain::mission::{Mission, MissionAreas};
use domain::plan::{Answered, Basis, Course, FlownStep, PlanReply, PlanRequest};
use domain::state::State;
use domain::time::{Now, Pace, Time};
use domain::wire::InvalidMessage;
use kittiwake_proto::topics::{Request, Response, Service, Topic};
use kittiwake_proto::{PLANNING_PROTOCOL, v1};
use node::{Answers, Effect, Event, Node};

mod actions;
mod airspace;
mod along;
mod alternates;
mod asking_ahead;
mod back_chaining;
mod coming_back;
mod communication;
pub mod config;
mod drafting;
mod energy;
mod forecast;
mod free_order;
mod grant_lengths;
mod hold;
mod known_areas;
mod lasting_areas;
mod mission_planner;
mod mission_request;
mod new_airspace;
mod notes;
mod objectives;
mod ordering;
mod permissions;
mod plan;
mod repair;
mod routing;
mod rules;
mod stuck;
mod survey;
mod wire;

#[cfg(test)]
mod tests;

use config::Config;
use known_areas::KnownAreas;
use mission_planner::{Answer, Brought, MissionPlanner, Question};
use rules::Rules;

/// The planner as a process: its parameters, and caches.
#[derive(Debug)]
pub struct Planner {
    rules: Rules,
    pace: Pace,
    areas: KnownAreas,
    /// A question may be repeated while it is being answered.
    plans: Answers<v1::ReplanReply>,
}

/// Why a question cannot be answered.
#[derive(Debug, thiserror::Error)]
enum Unanswerable {
    #[error(transparent)]
    InvalidMessage(#[from] InvalidMessage),
    #[error(transparent)]
    InvalidObjective(#[from] domain::mission::InvalidObjective),
}

impl Planner {
    /// A planner for vehicles like `aircraft`.
    pub fn new(config: &Config, aircraft: &Aircraft, pace: Pace) -> Planner {
        let (areas, plans) = (KnownAreas::default(), Answers::default());
        Planner { rules: Rules::new(config.clone(), *aircraft), pace, areas, plans }
    }

    /// The same with declared skills, which missions may use.
    #[must_use]
    pub fn with_skills(mut self, skills: DeclaredSkills) -> Planner {
        self.rules.skills = Arc::new(skills);
        self
    }

    /// What `request` comes to where nothing of `mission` has been attempted.
    pub fn try_out(&mut self, mission: &Mission, request: v1::MissionRequest, now: Now) -> v1::MissionReply {
        let basis = Basis::beginning(mission, State::new(Ned::default(), false), now);
        let request = v1::EditRequest { basis: Some(basis.into()), request: Some(request), ..Default::default() };
        self.edit(request, &mut Vec::new()).reply.unwrap_or_default()
    }

    fn replan(&mut self, request: v1::ReplanRequest, effects: &mut Vec<Effect>) -> v1::ReplanReply {
        let request_id = request.request_id.clone();
        if let Some(reply) = self.plans.get(&request_id) {
            return reply.clone();
        }
        let answered = self.plan(request).unwrap_or_else(|why| {
            effects.push(Effect::refused(Service::Replan, &why));
            Answered { reply: PlanReply::Refused(why.to_string()), course: None }
        });
        let reply = v1::ReplanReply::from(answered);
        if !request_id.is_empty() {
            self.plans.remember(request_id, reply.clone());
        }
        reply
    }

    fn plan(&mut self, request: v1::ReplanRequest) -> Result<Answered, Unanswerable> {
        let PlanRequest { basis, grants, failed, denials, .. } = request.try_into()?;
        let (now, state, areas_id) = (basis.at, basis.state.clone(), basis.areas_id.clone());
        let Some(mut core) = self.go_on(basis)? else {
            return Ok(Answered { reply: PlanReply::AreasUnknown, course: None });
        };
        let reply = match core.replan(Question { state, grants, failed, denials }, now) {
            Answer::Plan(_) => PlanReply::Plan(core.plan()),
            Answer::Hold { wait, reason, planned } => PlanReply::Hold { wait, reason, planned },
            Answer::Finished => PlanReply::Finished,
        };
        let (mission, notes) = core.course();
        self.areas.put_back(core.into_areas(areas_id));
        Ok(Answered { reply, course: Some(Course { mission, notes: notes.into() }) })
    }

    fn edit(&mut self, request: v1::EditRequest, effects: &mut Vec<Effect>) -> v1::EditReply {
        let reply = self.edited(request).unwrap_or_else(|why| {
            effects.push(Effect::refused(Service::Edit, &why));
            let reply = v1::MissionReply { text: why.to_string(), ..Default::default() };
            v1::EditReply { reply: Some(reply), ..Default::default() }
        });
        v1::EditReply { protocol: PLANNING_PROTOCOL, ..reply }
    }

    fn edited(&mut self, request: v1::EditRequest) -> Result<v1::EditReply, Unanswerable> {
        let v1::EditRequest { basis, request, ends, is_flown, next_waits, closed } = request;
        let basis = Basis::try_from(basis.unwrap_or_default())?;
        let (now, seen, mut areas_id) = (basis.at, basis.state.clone(), basis.areas_id.clone());
        let Some(mut core) = self.go_on(basis)? else {
            return Ok(v1::EditReply { areas_unknown: true, ..Default::default() });
        };
        let end = mission_request::End { why: ends, is_flown, next_waits };
        let closed = closed.into_iter().map(|it| (it.area, it.decision)).collect();
        let result = wire::mission_request(request.unwrap_or_default()).and_then(|(state, request)| {
            let state = state.as_ref().unwrap_or(&seen);
            mission_request::answer(&mut core, request, state, (&end, &closed), now)
        });
        let mut reply = v1::EditReply { reply: Some(wire::mission_reply(result)), ..Default::default() };
        if let Some(edited) = core.edited {
            let (mission, notes) = core.course();
            (reply.mission, reply.notes) = (Some(mission.into()), Some(notes.into()));
            reply.voids_plan = edited.voids_plan;
            if edited.areas {
                let areas = MissionAreas::of(&core.mission().areas, &core.mission().feeds);
                areas.id().clone_into(&mut areas_id);
                reply.areas = Some(areas.encoded().clone());
            }
        }
        self.areas.put_back(core.into_areas(areas_id));
        Ok(reply)
    }

    /// A planner for the mission of a question, up to its last flown step; `None` if its areas are not known.
    fn go_on(&mut self, basis: Basis) -> Result<Option<MissionPlanner>, Unanswerable> {
        let Some(areas) = self.areas.take(&basis.areas_id, basis.areas)? else { return Ok(None) };
        let notes = basis.notes.unwrap_or_default().try_into()?;
        let Basis { mission, vehicle_origin, wind, rest, flown, .. } = basis;
        let is_end = rest.is_empty();
        let brought = Brought { mission, notes, areas, vehicle_origin, wind, rest };
        let mut core = MissionPlanner::going_on(&self.rules, self.pace, brought)?;
        let last = flown.len().saturating_sub(1);
        for (index, FlownStep { step, state, at, along_failure }) in flown.into_iter().enumerate() {
            if let Some(reason) = along_failure {
                core.along_failed(reason);
            }
            core.flown(&step, is_end && index == last, &state, at);
        }
        Ok(Some(core))
    }
}

impl Node for Planner {
    fn name(&self) -> &'static str {
        "planner"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[]
    }

    fn serves(&self) -> &'static [Service] {
        &[Service::Replan, Service::Edit]
    }

    fn on(&mut self, _: Now, event: Event, effects: &mut Vec<Effect>) {
        let Event::Request { token, request, .. } = event else { return };
        let response = match request {
            Request::Replan(request) => Response::Replan(self.replan(request, effects)),
            Request::Edit(request) => Response::Edit(self.edit(request, effects)),
            _ => return,
        };
        effects.push(Effect::Reply { token, response });
    }

    fn deadline(&self) -> Option<Time> {
        None
    }
}
