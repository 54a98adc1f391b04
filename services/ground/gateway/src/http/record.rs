//! The audit record of an order.

#![expect(clippy::disallowed_methods, reason = "audit records carry UTC")]

use std::time::SystemTime;

use axum::response::Response;
use kittiwake_proto::json::any;
use kittiwake_proto::v1::AuditRecord;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use crate::access::{Identity, to_hex};
use crate::fleet::occurrence::Occurrence;
use crate::http::answer::Outcome;
use crate::http::idempotency::RequestId;
use crate::http::site::Site;
use crate::http::target::Target;
use crate::orders::Order;

/// The longest arguments as text, in bytes; longer ones are recorded by their size and hash.
const MAX_ARGUMENTS: usize = 1024;

impl Site {
    /// Records an order and its outcome; `who` is `None` for an unknown token.
    pub(crate) fn record(
        &self,
        who: Option<&Identity>,
        target: &Target,
        id: Option<&RequestId>,
        arguments: &Value,
        response: &Response,
    ) {
        let outcome = response.extensions().get::<Outcome>();
        let record = AuditRecord {
            utc: humantime::format_rfc3339_millis(SystemTime::now()).to_string(),
            who: who.map(|it| it.name.to_string()),
            roles: who.map(Identity::role_names).unwrap_or_default(),
            vehicle: target.vehicle_name().to_owned(),
            what: target.what.clone(),
            request_id: id.map(|it| it.key().to_owned()).unwrap_or_default(),
            arguments: Some(any(&bounded(arguments))),
            status: response.status().as_u16().into(),
            outcome: outcome.map(|it| it.0.to_string()).unwrap_or_default(),
        };
        self.api.audit.record(record.clone());
        if who.is_some()
            && let Ok(Some(vehicle)) = target.vehicle(&self.snapshot())
        {
            self.api.orders.send(Order::Journal { vehicle, occurrence: Occurrence::Audit(record) });
        }
    }
}

fn bounded(arguments: &Value) -> Value {
    let text = arguments.to_string();
    if text.len() <= MAX_ARGUMENTS {
        return arguments.clone();
    }
    json!({ "bytes": text.len(), "sha256": to_hex(&Sha256::digest(text.as_bytes())) })
}
