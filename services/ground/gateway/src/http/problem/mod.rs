//! Errors as problem details (RFC 9457), for programs and for people.

use axum::http::header::CONTENT_TYPE;
use axum::http::{HeaderName, StatusCode};
use axum::response::{IntoResponse, Response};
use kittiwake_proto::json::to_json;
use kittiwake_proto::v1;

use crate::audit::refusals::cut;
use crate::http::answer::Outcome;
pub(crate) use kind::Kind;

mod kind;

/// Characters of a detail. Some repeat what the client has sent: a name that is unknown may be as long as the body.
const MAX_DETAIL: usize = 1000;

/// Why a request was not carried out.
#[derive(Debug)]
pub(crate) struct Problem {
    status: StatusCode,
    // A problem is the error of every handler: it should not make their results large.
    document: Box<v1::Problem>,
    header: Option<(HeaderName, String)>,
}

impl Problem {
    /// A problem; `detail` says what happened, with values, and is cut if it is long.
    pub(crate) fn new(status: StatusCode, detail: impl Into<String>) -> Problem {
        let document = v1::Problem {
            r#type: Kind::of(status).uri(),
            title: status.canonical_reason().unwrap_or_default().to_owned(),
            status: status.as_u16().into(),
            detail: cut(&detail.into(), MAX_DETAIL),
            ..Default::default()
        };
        Problem { status, document: Box::new(document), header: None }
    }

    /// Nothing can be done at the moment.
    pub(crate) fn unavailable(detail: impl Into<String>) -> Problem {
        Problem::new(StatusCode::SERVICE_UNAVAILABLE, detail)
    }

    /// The vehicle is unknown.
    pub(crate) fn no_such_vehicle(name: &str) -> Problem {
        Problem::new(StatusCode::NOT_FOUND, format!("vehicle `{name}` was never seen")).of(Kind::NoSuchVehicle)
    }

    /// This problem as one of a certain kind.
    pub(crate) fn of(mut self, kind: Kind) -> Problem {
        self.document.r#type = kind.uri();
        self
    }

    /// The title of its status.
    pub(crate) fn title(&self) -> &str {
        &self.document.title
    }

    /// What happened.
    pub(crate) fn detail(&self) -> &str {
        &self.document.detail
    }

    /// This problem with a header.
    pub(crate) fn with_header(mut self, name: HeaderName, value: &str) -> Problem {
        self.header = Some((name, value.to_owned()));
        self
    }

    /// This problem with the members that `set` sets.
    pub(crate) fn with(mut self, set: impl FnOnce(&mut v1::Problem)) -> Problem {
        set(&mut self.document);
        self
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let body = to_json(&*self.document).to_string();
        let mut response = (self.status, [(CONTENT_TYPE, "application/problem+json")], body).into_response();
        if let Some((name, value)) = self.header
            && let Ok(value) = value.parse()
        {
            response.headers_mut().insert(name, value);
        }
        response.extensions_mut().insert(Outcome(self.document.detail.into()));
        response
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_detail_is_cut_in_the_answer_and_in_the_outcome() {
        #[track_caller]
        fn check(detail: &str, expected: &str) {
            let problem = Problem::new(StatusCode::BAD_REQUEST, detail);
            assert_eq!(problem.detail(), expected);
            assert_eq!(problem.into_response().extensions().get::<Outcome>().map(|it| &*it.0), Some(expected));
        }
        check("the body is invalid", "the body is invalid");
        let most = "ä".repeat(MAX_DETAIL);
        check(&most, &most);
        check(&format!("{most}ä"), &format!("{most}…"));
        check(&"ä".repeat(100 * MAX_DETAIL), &format!("{most}…"));
    }
}
