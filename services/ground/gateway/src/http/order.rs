//! Carries out orders, each in a task of its own: a client that leaves neither stops its order nor leaves it without a
//! record.

use std::time::Instant;

use axum::body::Body;
use axum::extract::Request;
use axum::http::StatusCode;
use axum::http::request::Parts;
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use tracing::Instrument;

use crate::http::guard::AuthorizedRequest;
use crate::http::idempotency::Fingerprint;
use crate::http::problem::{Kind, Problem};
use crate::http::record::with_outcome;
use crate::http::routes::{Access, Route};
use crate::http::site::Site;
use crate::http::standstill::since_boot;
use crate::http::trace;

/// Carries out an order that its client may give, and returns the answer. What was answered before under the same key is
/// answered again.
pub(crate) async fn carry_out(
    site: Site,
    route: Route,
    authorized: AuthorizedRequest,
    parts: Parts,
    next: Next,
) -> Response {
    let fingerprint = Fingerprint::of(&route, &authorized.target, &authorized.body);
    if let Some(known) = authorized.id.as_ref().and_then(|id| site.answers.get(id, fingerprint)) {
        return known;
    }
    let task = tokio::spawn(async move {
        let record = authorized.record();
        let asked = site.api.audit.asked(&record).await;
        let since = Instant::now();
        let answering = answer(&site, route, authorized.clone(), fingerprint, parts, next);
        let response = match tokio::time::timeout(site.api.config.request_timeout_s.seconds(), answering).await {
            Ok(response) => response,
            Err(_) => {
                let detail = "the answer took too long; it is not known whether it was done";
                Problem::unavailable(detail).of(Kind::OutcomeUnknown).into_response()
            }
        };
        site.latencies.ended(&route, response.status().as_u16(), since.elapsed());
        let record = with_outcome(record, &response);
        site.ended(asked, record, &authorized).await;
        response
    });
    // Dropped with its client, the handle leaves the task alone.
    let detail = "the order failed; its outcome is not known";
    let failed = |_| Problem::new(StatusCode::INTERNAL_SERVER_ERROR, detail).of(Kind::OutcomeUnknown);
    task.await.map_err(failed).into_response()
}

async fn answer(
    site: &Site,
    route: Route,
    mut authorized: AuthorizedRequest,
    fingerprint: Fingerprint,
    mut parts: Parts,
    next: Next,
) -> Response {
    let span = trace::span(&route.method.name().to_uppercase(), route.path, &parts.headers);
    if let Some(traceparent) = trace::traceparent(&span) {
        authorized.trace = traceparent;
    }
    let response = match is_new(site, &authorized).and_then(|()| has_command(site, route.access, &authorized)) {
        // Another answer may follow under the same key, once the client has command or asks again.
        Err(problem) => problem.into_response(),
        Ok(()) => {
            let id = authorized.id.clone();
            parts.extensions.insert(authorized);
            let response = next.run(Request::from_parts(parts, Body::empty())).instrument(span.clone()).await;
            match id {
                Some(id) => site.answers.keep(id, fingerprint, response).await,
                None => response,
            }
        }
    };
    trace::answered(&span, response.status().as_u16());
    response
}

/// Whether the order was read when it arrived: one that waited while the gateway stood still is not what its client wants now.
fn is_new(site: &Site, request: &AuthorizedRequest) -> Result<(), Problem> {
    match site.api.standstill.may_have_waited(request.begun, since_boot()) {
        None => Ok(()),
        Some(gap) => {
            let detail = format!("the gateway stood still for {:.1} s; nothing was done: ask again", gap.as_secs_f64());
            Err(Problem::unavailable(detail))
        }
    }
}

/// Whether the client has command of the vehicle, where the route needs that. The refusal says who has it, so that a
/// program can tell it from a refusal by the vehicle.
#[expect(clippy::disallowed_methods, reason = "command authority is leased on the wall clock")]
fn has_command(site: &Site, access: Access, request: &AuthorizedRequest) -> Result<(), Problem> {
    match access {
        Access::InCommand(or) if !request.who.has_one_of(or) => {
            let (vehicle, now) = (request.vehicle()?, Instant::now());
            site.api.authorities.check(vehicle, &request.who.name, now).map_err(|refusal| {
                let authority = site.api.authorities.of(vehicle, now);
                Problem::new(StatusCode::CONFLICT, refusal)
                    .of(Kind::CommandNeeded)
                    .with(|it| it.command = Some(authority))
            })
        }
        _ => Ok(()),
    }
}
