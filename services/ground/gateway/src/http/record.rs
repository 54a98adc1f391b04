//! What is recorded of requests: of an order before it is sent and after it has ended, of a refusal once.

use axum::http::request::Parts;
use axum::response::Response;
use kittiwake_proto::json::{MAX_DEPTH, any, depth};
use kittiwake_proto::v1::{AuditRecord, RefusalRecord};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use crate::access::{Identity, to_hex};
use crate::fleet::occurrence::Occurrence;
use crate::http::answer::Outcome;
use crate::http::caller::Caller;
use crate::http::guard::AuthorizedRequest;
use crate::http::problem::Problem;
use crate::http::site::Site;
use crate::orders::Order;

/// The longest arguments as text, in bytes; longer ones, and those that are nested too deep, are recorded by their size and hash.
const MAX_ARGUMENTS: usize = 1024;

impl AuthorizedRequest {
    /// The order as the audit trail has it.
    pub(crate) fn record(&self) -> AuditRecord {
        AuditRecord {
            who: Some(self.who.name.to_string()),
            roles: self.who.role_names(),
            vehicle: self.target.vehicle.as_ref().map(ToString::to_string).unwrap_or_default(),
            what: self.target.what.clone(),
            request_id: self.key(),
            arguments: any(&bounded(&self.body)),
            address: self.caller.address(),
            ..Default::default()
        }
    }
}

impl Site {
    /// Records what came of an order, also in the journal of its vehicle.
    pub(crate) async fn ended(&self, asked: u64, record: AuditRecord, order: &AuthorizedRequest) {
        let record = self.api.audit.ended(asked, record).await;
        if let Some(vehicle) = order.target.vehicle.clone() {
            self.api.orders.send(Order::Journal { vehicle, occurrence: Occurrence::Audit(record) });
        }
    }

    /// Records a request that was refused before anything was asked.
    pub(crate) fn refused(&self, who: Option<&Identity>, caller: &Caller, parts: &Parts, problem: &Problem) {
        self.api.audit.refusals.record(RefusalRecord {
            reason: problem.title().to_owned(),
            address: caller.network(),
            who: who.map(|it| it.name.to_string()),
            what: format!("{} {}", parts.method, parts.uri.path()),
            detail: problem.detail().to_owned(),
            ..Default::default()
        });
    }

    /// Counts a request of a client that asks too often.
    pub(crate) fn refused_too_many(&self, caller: &Caller, problem: &Problem) {
        self.api.audit.refusals.count(problem.title(), &caller.network());
    }
}

/// The record of an order with its answer.
pub(crate) fn with_outcome(record: AuditRecord, response: &Response) -> AuditRecord {
    let outcome = response.extensions().get::<Outcome>().map(|it| it.0.to_string()).unwrap_or_default();
    AuditRecord { status: response.status().as_u16().into(), outcome, ..record }
}

fn bounded(arguments: &Value) -> Value {
    let text = arguments.to_string();
    if text.len() <= MAX_ARGUMENTS && depth(arguments) <= MAX_DEPTH {
        return arguments.clone();
    }
    json!({ "bytes": text.len(), "sha256": to_hex(&Sha256::digest(text.as_bytes())) })
}
