//! Errors as problem details (RFC 9457), so that a program can read them and a human too.

use axum::http::header::CONTENT_TYPE;
use axum::http::{HeaderName, StatusCode};
use axum::response::{IntoResponse, Response};
use serde_json::{Map, Value, json};

use crate::guard::Outcome;

/// Why a request got no answer.
#[derive(Debug)]
pub struct Problem {
    status: StatusCode,
    detail: String,
    more: Map<String, Value>,
    header: Option<(HeaderName, String)>,
}

impl Problem {
    /// A problem with its values in `detail`.
    pub fn new(status: StatusCode, detail: impl Into<String>) -> Problem {
        Problem { status, detail: detail.into(), more: Map::new(), header: None }
    }

    /// The same with a header.
    pub fn with_header(mut self, name: HeaderName, value: &str) -> Problem {
        self.header = Some((name, value.to_owned()));
        self
    }

    /// The same with one more member.
    pub fn with(mut self, member: &str, value: Value) -> Problem {
        self.more.insert(member.to_owned(), value);
        self
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let mut body = json!({
            "type": "about:blank",
            "title": self.status.canonical_reason(),
            "status": self.status.as_u16(),
            "detail": &self.detail,
        });
        if let Value::Object(fields) = &mut body {
            fields.extend(self.more);
        }
        let outcome = Outcome(self.detail.into());
        let mut response =
            (self.status, [(CONTENT_TYPE, "application/problem+json")], body.to_string()).into_response();
        if let Some((name, value)) = self.header
            && let Ok(value) = value.parse()
        {
            response.headers_mut().insert(name, value);
        }
        response.extensions_mut().insert(outcome);
        response
    }
}
