//! Answers: a document, or a problem.

use std::sync::Arc;

use axum::body::Bytes;
use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE};
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
    dated_document(snapshot.mission_time_s(vehicle), snapshot.now.utc_ms, message)
}

/// The same for a message that is of an earlier moment.
pub(crate) fn dated_document<M: Message + Name>(mission_time_s: Option<f64>, utc_ms: i64, message: &M) -> Response {
    json_document(view::stamped(mission_time_s, utc_ms, to_json(message)))
}

/// The answer to an order, with its outcome for the audit record.
pub(crate) fn with_outcome(mut response: Response, text: &str) -> Response {
    response.extensions_mut().insert(Outcome(text.into()));
    response
}

fn json_document(json: Value) -> Response {
    // Boxed: without the room for more that a text that grew has, and that nobody would count.
    let text = json.to_string().into_boxed_str().into_boxed_bytes();
    ([(CACHE_CONTROL, "no-store"), (CONTENT_TYPE, "application/json")], Bytes::from(text)).into_response()
}
