//! Calls the vehicle's services, and makes answers of their replies.

#![expect(clippy::disallowed_methods, reason = "command authority is leased on the wall clock")]

use std::time::Instant;

use axum::http::StatusCode;
use kittiwake_proto::json::{from_json, wrong_coordinate, wrong_member};
use kittiwake_proto::topics::{Request, Response as Reply};
use kittiwake_proto::v1;
use node::CallError;
use serde_json::Value;
use v1::mission_request::Request as MissionCall;
use v1::operator_command::Verb;

use crate::fleet::occurrence::Occurrence;
use crate::http::answer::{Answer, document, stamped_document, with_outcome};
use crate::http::guard::AuthorizedRequest;
use crate::http::problem::{Kind, Problem};
use crate::http::site::Site;
use crate::orders::Order;
use crate::view;

impl Site {
    /// Calls one of the vehicle's services.
    pub(super) async fn call(&self, request: &AuthorizedRequest, call: Request) -> Result<Reply, Problem> {
        let (service, is_decision) = (call.service().key(), matches!(call, Request::Decide(_)));
        let result = self.api.orders.call(request.vehicle()?, call, request.trace.clone()).await;
        // Whatever has no key only asks.
        if request.id.is_some() {
            self.missions.may_have_changed(request.vehicle()?);
        }
        result.ok_or_else(busy)?.map_err(|error| no_reply(service, error, is_decision))
    }

    /// Gives an order to the mission manager.
    pub(super) async fn order(&self, request: &AuthorizedRequest, word: &str, verb: Verb) -> Answer {
        let request_id = wire_id(request);
        let command = v1::OperatorCommand { request_id, operator: request.who.name.to_string(), verb: Some(verb) };
        match self.call(request, Request::OperatorCommand(command)).await? {
            Reply::OperatorCommand(reply) if reply.done => self.done(request, word, reply.text),
            Reply::OperatorCommand(reply) => Err(refused(request, word, reply.text)),
            _ => Err(invalid_reply(request)),
        }
    }

    /// Asks the mission manager about the mission, from where the vehicle is now.
    pub(super) async fn mission(&self, request: &AuthorizedRequest, call: MissionCall) -> Answer {
        let mission_request = v1::MissionRequest {
            request_id: wire_id(request),
            operator: request.who.name.to_string(),
            state: self.planning_state(request.vehicle()?),
            request: Some(call),
        };
        let Reply::Mission(reply) = self.call(request, Request::Mission(mission_request)).await? else {
            return Err(invalid_reply(request));
        };
        if reply.accepted {
            return Ok(with_outcome(stamped_document(&self.snapshot(), request.vehicle()?, &reply), &reply.text));
        }
        let status = if reply.mistakes.is_empty() { StatusCode::CONFLICT } else { StatusCode::UNPROCESSABLE_ENTITY };
        Err(Problem::new(status, reply.text).with(|problem| {
            problem.mistakes = reply.mistakes;
            problem.forecast = reply.forecast;
        }))
    }

    /// Where the vehicle is, as the monitor saw it last.
    fn planning_state(&self, vehicle: &str) -> Option<v1::PlanningState> {
        let snapshot = self.snapshot();
        let state = snapshot.fleet.vehicles.get(vehicle)?;
        let introspection = &state.introspection.as_ref()?.message;
        let permissions = state.ledger.iter().flat_map(|ledger| &ledger.message.permissions);
        let granted = permissions.filter(|it| it.state() == v1::PermissionState::Granted);
        Some(v1::PlanningState {
            position: Some(introspection.local_position.as_ref()?.position?),
            flying: introspection.derived.as_ref()?.flying,
            mode: 0,
            permissions: granted.map(|it| it.area.clone()).collect(),
            charge: introspection.battery.as_ref().map(|it| it.remaining),
            gripper: introspection.status.as_ref().map_or(v1::Gripper::Unspecified, |it| it.gripper()) as i32,
            done: Vec::new(),
        })
    }

    /// The answer to an order that was carried out.
    pub(super) fn done(&self, request: &AuthorizedRequest, verb: &str, text: String) -> Answer {
        let (snapshot, vehicle) = (self.snapshot(), request.vehicle()?.to_string());
        let (mission_time_s, utc) = (snapshot.mission_time_s(&vehicle), view::utc(snapshot.now.utc_ms));
        let (verb, request_id) = (verb.to_owned(), request.key());
        let done = v1::OrderDone { mission_time_s, utc, vehicle, verb, request_id, text };
        Ok(with_outcome(document(&done), &done.text))
    }

    /// The answer to an order about command, which also goes into the journal.
    pub(super) fn command_changed(&self, request: &AuthorizedRequest, changed: Result<(), String>) -> Answer {
        changed.map_err(|refusal| Problem::new(StatusCode::CONFLICT, refusal))?;
        let vehicle = request.vehicle()?;
        let authority = self.api.authorities.of(vehicle, Instant::now());
        let occurrence = Occurrence::Command(authority.clone());
        self.api.orders.send(Order::Journal { vehicle: vehicle.clone(), occurrence });
        let text = match (&authority.holder, &authority.offered_to) {
            (None, _) => "nobody has command".to_owned(),
            (Some(holder), None) => format!("{holder} has command"),
            (Some(holder), Some(to)) => format!("{holder} has command and offers it to {to}"),
        };
        Ok(with_outcome(document(&authority), &text))
    }
}

/// The request id as the services receive it; empty for a request that needs no key.
fn wire_id(request: &AuthorizedRequest) -> String {
    request.id.as_ref().map(ToString::to_string).unwrap_or_default()
}

pub(super) fn read<M: prost::Message + prost::Name + Default>(body: &Value) -> Result<M, Problem> {
    let read = from_json(body).map_err(|error| invalid_body(&error).with(|it| it.member = wrong_member::<M>(body)))?;
    match wrong_coordinate::<M>(body) {
        Some(pointer) => Err(invalid_member(&pointer, &format!("{pointer} is missing, or no finite number"))),
        None => Ok(read),
    }
}

/// Reads a body that may be left out.
pub(super) fn read_optional<M: prost::Message + prost::Name + Default>(body: &Value) -> Result<M, Problem> {
    if body.is_null() { Ok(M::default()) } else { read(body) }
}

fn invalid_body(why: &str) -> Problem {
    Problem::new(StatusCode::BAD_REQUEST, format!("the body is invalid: {why}")).of(Kind::InvalidBody)
}

/// One member of the body, which a JSON pointer names, is not what it must be.
pub(super) fn invalid_member(pointer: &str, why: &str) -> Problem {
    invalid_body(why).with(|it| it.member = Some(pointer.to_owned()))
}

/// The vehicle's service refused the order.
pub(super) fn refused(request: &AuthorizedRequest, verb: &str, why: String) -> Problem {
    Problem::new(StatusCode::CONFLICT, why).with(|problem| {
        problem.verb = Some(verb.to_owned());
        problem.request_id = Some(request.key());
    })
}

/// Why there is no reply of `service`, and what to do then.
pub(super) fn no_reply(service: &str, error: CallError, is_decision: bool) -> Problem {
    let (effect, kind) = match error {
        CallError::Unavailable | CallError::Late => ("nothing was done", Kind::Unavailable),
        CallError::Unanswered | CallError::Malformed => ("it is not known whether it was done", Kind::OutcomeUnknown),
    };
    // The control tower recognises no key, and somebody else may have decided since.
    let advice = match kind {
        Kind::OutcomeUnknown if is_decision => "look at the permission before you decide again",
        _ => "repeat the order with the same key",
    };
    Problem::unavailable(format!("`{service}`: {error}; {effect}; {advice}")).of(kind)
}

pub(super) fn busy() -> Problem {
    Problem::unavailable("too many orders at once; nothing was done")
}

/// A service sent the reply of another one. It was called, so what was ordered may have been done.
pub(super) fn invalid_reply(request: &AuthorizedRequest) -> Problem {
    let foreign = "the service's reply does not belong to the request";
    // Whatever has no key only asks.
    match request.id {
        None => Problem::new(StatusCode::BAD_GATEWAY, foreign),
        Some(_) => Problem::new(StatusCode::BAD_GATEWAY, format!("{foreign}; it is not known whether it was done"))
            .of(Kind::OutcomeUnknown),
    }
}
