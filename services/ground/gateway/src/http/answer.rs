//! Answers: a document, or a problem.

use std::sync::Arc;

use axum::Json;
use axum::http::header::CACHE_CONTROL;
use axum::response::{IntoResponse, Response};
use kittiwake_proto::json::to_json;
use prost::{Message, Name};
use serde_json::Value;

use crate::fleet::Snapshot;
use crate::http::problem::Problem;
use crate::view;

/// What a handler returns.
pub(crate) type Answer = Result<Response, Problem>;

/// The outcome of an order in words, for the audit record; an extension of the response.
#[derive(Debug, Clone)]
pub(crate) struct Outcome(pub(crate) Arc<str>);

/// A message as a document.
pub(crate) fn document<M: Message + Name>(message: &M) -> Response {
    json_document(to_json(message))
}

/// A message about a vehicle as a document with `missionTimeS` and `utc`, for a message that does not have them.
pub(crate) fn stamped_document<M: Message + Name>(snapshot: &Snapshot, vehicle: &str, message: &M) -> Response {
    json_document(view::stamped(snapshot.mission_time_s(vehicle), snapshot.now.utc_ms, to_json(message)))
}

/// The answer to an order, with its outcome for the audit record.
pub(crate) fn with_outcome(mut response: Response, text: &str) -> Response {
    response.extensions_mut().insert(Outcome(text.into()));
    response
}

fn json_document(json: Value) -> Response {
    ([(CACHE_CONTROL, "no-store")], Json(json)).into_response()
}
