//! Asks the services, and puts what they say into answers.

use std::sync::Arc;
use std::time::Instant;

use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use kittiwake_proto::json::{from_json, to_json};
use kittiwake_proto::topics::{Request, Response as Reply};
use kittiwake_proto::v1;
use node::{CallError, VehicleId};
use serde_json::{Value, json};
use v1::mission_request::Request as Ask;
use v1::operator_command::Verb;

use super::Outcomes;
use crate::guard::{Asked, Outcome, Site};
use crate::http::{document, no_such_vehicle};
use crate::orders::Wish;
use crate::problem::Problem;
use crate::view;

impl Site {
    pub(super) fn vehicle(&self, id: &str) -> Result<VehicleId, Problem> {
        let snapshot = self.snapshot();
        snapshot.fleet.vehicles.get_key_value(id).map(|(id, _)| id.clone()).ok_or_else(|| no_such_vehicle(id))
    }

    /// Asks one of the vehicle's services.
    pub(super) async fn ask(&self, vehicle: &VehicleId, request: Request, asked: &Asked) -> Result<Reply, Problem> {
        let what = request.service().key();
        match self.api.orders.call(vehicle, request, asked.trace.clone()).await {
            Some(Ok(reply)) => Ok(reply),
            None => Err(busy()),
            Some(Err(error)) => {
                let known = match error {
                    CallError::Unavailable | CallError::Late => "nothing was done",
                    CallError::Unanswered | CallError::Malformed => "whether it was done is not known",
                };
                let detail = format!("`{what}` is {error}; {known}; it may be repeated under the same key");
                Err(Problem::new(StatusCode::SERVICE_UNAVAILABLE, detail))
            }
        }
    }

    /// Orders something of the mission manager.
    pub(super) async fn order(&self, id: &str, asked: Asked, word: &str, verb: Verb) -> Outcomes {
        let vehicle = self.vehicle(id)?;
        let (request_id, operator) = (asked.request_id.clone(), asked.who.name.to_string());
        let command = v1::OperatorCommand { request_id, operator, verb: Some(verb) };
        match self.ask(&vehicle, Request::OperatorCommand(command), &asked).await? {
            Reply::OperatorCommand(it) if it.done => Ok(self.done(&vehicle, word, &asked, &it.text)),
            Reply::OperatorCommand(it) => Err(refused(word, &asked, it.text)),
            _ => Err(senseless()),
        }
    }

    /// Asks the planner about the mission, from where the vehicle is now.
    pub(super) async fn mission(&self, id: &str, asked: &Asked, ask: Ask) -> Outcomes {
        let vehicle = self.vehicle(id)?;
        let request = v1::MissionRequest {
            request_id: asked.request_id.clone(),
            operator: asked.who.name.to_string(),
            state: self.planning_state(&vehicle),
            request: Some(ask),
        };
        let Reply::Mission(reply) = self.ask(&vehicle, Request::Mission(request), asked).await? else {
            return Err(senseless());
        };
        if reply.accepted {
            let answer = view::stamped(self.snapshot().now, to_json(&reply));
            return Ok(with_outcome(document(answer), &reply.text));
        }
        let status = if reply.mistakes.is_empty() { StatusCode::CONFLICT } else { StatusCode::UNPROCESSABLE_ENTITY };
        let forecast: Vec<Value> = reply.forecast.iter().map(to_json).collect();
        let problem = Problem::new(status, reply.text).with("mistakes", json!(reply.mistakes));
        Err(problem.with("forecast", json!(forecast)))
    }

    /// Where the vehicle is, as the monitor saw it last.
    fn planning_state(&self, vehicle: &str) -> Option<v1::PlanningState> {
        let snapshot = self.snapshot();
        let state = snapshot.fleet.vehicles.get(vehicle)?;
        let seen = &state.introspection.as_ref()?.message;
        let granted = state.ledger.iter().flat_map(|it| &it.message.permissions);
        let granted = granted.filter(|it| it.state() == v1::PermissionState::Granted);
        Some(v1::PlanningState {
            position: Some(seen.local_position.as_ref()?.position?),
            flying: seen.derived.as_ref()?.flying,
            mode: 0,
            permissions: granted.map(|it| it.area.clone()).collect(),
        })
    }

    pub(super) fn done(&self, vehicle: &VehicleId, verb: &str, asked: &Asked, text: &str) -> Response {
        let answer = json!({ "vehicle": &**vehicle, "verb": verb, "requestId": key(asked), "text": text });
        with_outcome(document(view::stamped(self.snapshot().now, answer)), text)
    }

    pub(super) fn helm_moved(&self, vehicle: &VehicleId, moved: Result<(), String>) -> Outcomes {
        moved.map_err(|it| Problem::new(StatusCode::CONFLICT, it))?;
        let helm = self.api.helms.of(vehicle, Instant::now());
        let record = helm.to_json();
        self.api.orders.send(Wish::Tell { vehicle: vehicle.clone(), kind: "command", record: record.clone() });
        let words = match (helm.holder, helm.offered_to) {
            (None, _) => "nobody holds command".to_owned(),
            (Some(holder), None) => format!("{holder} holds command"),
            (Some(holder), Some(to)) => format!("{holder} holds command, and offers it to {to}"),
        };
        Ok(with_outcome(document(record), &words))
    }
}

/// The client's own key.
fn key(asked: &Asked) -> &str {
    asked.request_id.split_once(':').map_or("", |(_, key)| key)
}

fn with_outcome(mut response: Response, text: &str) -> Response {
    response.extensions_mut().insert(Outcome(Arc::from(text)));
    response.into_response()
}

pub(super) fn read<M: prost::Message + prost::Name + Default>(body: &Value) -> Result<M, Problem> {
    from_json(body).map_err(|it| bad_body(&it))
}

pub(super) fn bad_body(what: &str) -> Problem {
    Problem::new(StatusCode::BAD_REQUEST, format!("the body makes no sense: {what}"))
}

/// The state forbids it.
pub(super) fn refused(verb: &str, asked: &Asked, why: String) -> Problem {
    Problem::new(StatusCode::CONFLICT, why).with("verb", json!(verb)).with("requestId", json!(key(asked)))
}

pub(super) fn busy() -> Problem {
    Problem::new(StatusCode::SERVICE_UNAVAILABLE, "too much is asked at once; nothing was done")
}

pub(super) fn senseless() -> Problem {
    Problem::new(StatusCode::BAD_GATEWAY, "the answer was not one to the question")
}
