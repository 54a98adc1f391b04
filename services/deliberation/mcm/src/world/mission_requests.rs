//! Requests about the mission. What one comes to the planner works out, which has the time; the mission is changed here, by its answer.
//!
//! An answer counts for the mission that was asked about, and for what the tower had closed then: if either has changed, the planner is asked again. A request that is
//! repeated under its id gets the answer to the first one.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::geometry::Ned;
use domain::mission::MissionAreas;
use domain::state::State;
use domain::wire::InvalidMessage;
use domain::wire::plan::{course, same_protocol};
use kittiwake_proto::topics::{Request, Response, Service};
use kittiwake_proto::v1;
use node::{Answers, CallError, Token};
use v1::mission_request::Request as Ask;

use super::World;
use crate::outbox::Purpose;

/// The planner needs seconds for a mission with many areas. (ENG: ten times the slowest that was measured.)
const LIMIT: Duration = Duration::from_secs(60);
/// A mission that goes on faster than it is asked about is not changed.
const MOST_TRIES: u32 = 8;

/// Requests that wait for the planner, by number, and the previous answers.
#[derive(Debug, Default)]
pub(super) struct MissionRequests {
    last: u64,
    open: BTreeMap<u64, Open>,
    answers: Answers<v1::MissionReply>,
}

#[derive(Debug)]
struct Open {
    token: Token,
    request: v1::MissionRequest,
    closed: Vec<v1::ClosedArea>,
    /// Of the mission that was asked about, and how many of its steps were flown.
    version: u64,
    flown: usize,
    tries: u32,
}

impl World {
    pub(crate) fn take_request(&mut self, token: Token, request: v1::MissionRequest) {
        if let Some(Ask::Read(_)) = request.request {
            let text = "the mission as it stands".to_owned();
            return self.answer(token, v1::MissionReply { accepted: true, text, ..Default::default() });
        }
        let id = &request.request_id;
        if let Some(reply) = self.people.requests.answers.get(id.as_str()) {
            return self.answer(token, reply.clone());
        }
        self.ask_what_it_comes_to(token, request, 1);
    }

    /// Whether the reply to this request comes once the planner has answered.
    pub(crate) fn answers_later(&self, token: Token) -> bool {
        self.people.requests.open.values().any(|it| it.token == token)
    }

    fn ask_what_it_comes_to(&mut self, token: Token, request: v1::MissionRequest, tries: u32) {
        let state = self.planning_state().unwrap_or_else(|| State::new(Ned::default(), false));
        let viewpoint = self.viewpoint_in(state);
        let (basis, _) = self.planner.basis_from(viewpoint);
        let next_waits = self.awaited_order().is_some();
        let edit = v1::EditRequest {
            basis: Some(basis.into()),
            request: Some(request.clone()),
            ends: self.ending().unwrap_or_default(),
            is_flown: self.report().is_none() && !next_waits,
            next_waits,
            closed: self.closed(),
        };
        self.people.requests.last += 1;
        let mission = &self.planner.mission;
        let (version, flown) = (mission.version(), mission.flown());
        let open = Open { token, request, closed: edit.closed.clone(), version, flown, tries };
        self.people.requests.open.insert(self.people.requests.last, open);
        self.out.outbox.call(Purpose::Edit(self.people.requests.last), Request::Edit(edit), LIMIT);
    }

    /// The planner has answered request `number`, or has not.
    pub(super) fn take_edit_reply(&mut self, number: u64, result: Result<Response, CallError>) {
        let Some(open) = self.people.requests.open.remove(&number) else { return };
        let refused = |text: String| v1::MissionReply { text, ..Default::default() };
        let edited = match result {
            Ok(Response::Edit(edited)) => edited,
            Ok(_) => return self.answer(open.token, refused("the planner has answered something else".to_owned())),
            Err(error) => return self.answer(open.token, refused(format!("the planner {error}"))),
        };
        let has_changed = open.version != self.planner.mission.version() || open.closed != self.closed();
        let is_outdated = edited.mission.is_some() && has_changed;
        if (is_outdated || edited.areas_unknown) && open.tries < MOST_TRIES {
            if edited.areas_unknown {
                self.planner.mission.areas_are_unknown();
            }
            return self.ask_what_it_comes_to(open.token, open.request, open.tries + 1);
        }
        let reply = edited.reply.clone().unwrap_or_default();
        let taken = match is_outdated {
            true => Err("the mission and its areas change faster than the answer comes: try again".to_owned()),
            false => self.change_mission(edited, open.flown).map_err(|invalid| {
                self.out.outbox.refuse(Service::Edit, &invalid);
                format!("the planner gave an invalid answer: {invalid}")
            }),
        };
        let reply = taken.map_or_else(refused, |()| reply);
        if !open.request.request_id.is_empty() {
            self.people.requests.answers.remember(open.request.request_id, reply.clone());
        }
        self.answer(open.token, reply);
    }

    /// The areas that no upload leaves out because of the tower.
    fn closed(&self) -> Vec<v1::ClosedArea> {
        self.permissions.closed(self.planner.areas())
    }

    /// The mission is changed as the planner says, if it is.
    fn change_mission(&mut self, edited: v1::EditReply, flown: usize) -> Result<(), InvalidMessage> {
        same_protocol("planner", edited.protocol)?;
        let v1::EditReply { mission, notes, areas, voids_plan, .. } = edited;
        let Some(course) = course(mission, notes)? else { return Ok(()) };
        let areas = areas.map(MissionAreas::decode).transpose()?;
        self.planner.on_change(course, areas, flown, voids_plan);
        if let Some(over) = self.mission.over.as_mut().filter(|it| voids_plan && it.report.is_some()) {
            over.is_next_uploaded = true;
        }
        self.watch.airspace.invalidate();
        Ok(())
    }

    /// Answers with the mission as it stands.
    fn answer(&mut self, token: Token, reply: v1::MissionReply) {
        let status = Some(self.planner.told().into());
        self.out.outbox.reply(token, Response::Mission(v1::MissionReply { status, ..reply }));
    }
}
