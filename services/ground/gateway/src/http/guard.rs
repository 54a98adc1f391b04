//! What every request passes on its way to its handler: who asks, how often, in which role, with command or
//! without; and on the way back, the audit record of an order.

#![expect(clippy::disallowed_methods, reason = "requests, their limits and the expiry of tokens are on the wall clock")]

use std::time::{Duration, Instant, SystemTime};

use axum::body::{Body, to_bytes};
use axum::extract::Request;
use axum::http::header::{AUTHORIZATION, RETRY_AFTER, WWW_AUTHENTICATE};
use axum::http::{HeaderMap, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use node::VehicleId;
use serde_json::Value;
use tracing::Instrument;

use crate::access::Identity;
use crate::http::idempotency::{Fingerprint, RequestId};
use crate::http::problem::Problem;
use crate::http::routes::{Access, Method, Route};
use crate::http::site::Site;
use crate::http::target::Target;
use crate::http::trace;

/// All requests without a valid token share one rate limit.
const UNIDENTIFIED: &str = "";

/// A request that its client may make.
#[derive(Debug, Clone)]
pub(crate) struct AuthorizedRequest {
    pub(crate) who: Identity,
    /// The vehicle it is about, if its path names one.
    vehicle: Option<VehicleId>,
    pub(crate) body: Value,
    /// The id of an order that needs a key.
    pub(crate) id: Option<RequestId>,
    /// The W3C trace that the request belongs to; empty for one that begins here.
    pub(crate) trace: String,
}

impl AuthorizedRequest {
    /// The vehicle that the path names.
    pub(crate) fn vehicle(&self) -> Result<&VehicleId, Problem> {
        let none = || Problem::new(StatusCode::INTERNAL_SERVER_ERROR, "the route names no vehicle");
        self.vehicle.as_ref().ok_or_else(none)
    }

    /// The client's own key; empty if it needs none.
    pub(crate) fn key(&self) -> String {
        self.id.as_ref().map(|it| it.key().to_owned()).unwrap_or_default()
    }
}

/// Lets `request` through to its handler if its client may use `route`.
pub(crate) async fn guard(site: Site, route: Route, request: Request, next: Next) -> Response {
    if let Access::Anyone = route.access {
        return next.run(request).await;
    }
    let now = Instant::now();
    let is_order = route.method != Method::Get;
    let (mut parts, body) = request.into_parts();
    let target = Target::read(&route, &mut parts).await;
    let who = match identify(&site, &parts.headers) {
        Ok(who) => who,
        Err(problem) => {
            // Beyond the limit they leave no audit record, so that a flood does not displace those of orders.
            if let Err(wait) = site.limiter.admit(UNIDENTIFIED, now) {
                return too_many(wait);
            }
            let response = problem.into_response();
            if is_order {
                site.record(None, &target, None, &Value::Null, &response);
            }
            return response;
        }
    };
    if let Err(wait) = site.limiter.admit(&who.name, now) {
        return too_many(wait);
    }
    site.api.authorities.heard_from(&who.name, now);
    let mut authorized = match authorize(&site, route, &who, &target, &parts.headers, body).await {
        Ok(authorized) => authorized,
        Err(problem) => {
            let response = problem.into_response();
            if is_order {
                site.record(Some(&who), &target, None, &Value::Null, &response);
            }
            return response;
        }
    };
    if !is_order {
        parts.extensions.insert(authorized);
        return next.run(Request::from_parts(parts, Body::empty())).await;
    }
    let (id, arguments) = (authorized.id.clone(), authorized.body.clone());
    let fingerprint = Fingerprint::of(&route, &target, &arguments);
    if let Some(known) = id.as_ref().and_then(|id| site.answers.get(id, fingerprint)) {
        return known;
    }
    let span = trace::span(&route.method.name().to_uppercase(), route.path, &parts.headers);
    if let Some(traceparent) = trace::traceparent(&span) {
        authorized.trace = traceparent;
    }
    let response = match has_command(&site, route.access, &authorized, now) {
        Err(problem) => problem.into_response(),
        Ok(()) => {
            parts.extensions.insert(authorized);
            let response = next.run(Request::from_parts(parts, Body::empty())).instrument(span.clone()).await;
            match &id {
                Some(id) => site.answers.keep(id.clone(), fingerprint, response).await,
                None => response,
            }
        }
    };
    trace::answered(&span, response.status().as_u16());
    site.record(Some(&who), &target, id.as_ref(), &arguments, &response);
    response
}

fn identify(site: &Site, headers: &HeaderMap) -> Result<Identity, Problem> {
    let token = headers.get(AUTHORIZATION).and_then(|it| it.to_str().ok()?.strip_prefix("Bearer "));
    let since_epoch = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    let utc_ms = i64::try_from(since_epoch.as_millis()).unwrap_or(i64::MAX);
    let found = token.and_then(|it| site.api.tokens.identify(it.trim(), utc_ms));
    found.cloned().ok_or_else(|| {
        let detail = if token.is_some() { "the token is unknown or has expired" } else { "a bearer token is needed" };
        Problem::new(StatusCode::UNAUTHORIZED, detail).with_header(WWW_AUTHENTICATE, "Bearer")
    })
}

/// Checks role and vehicle, and for an order key and body.
async fn authorize(
    site: &Site,
    route: Route,
    who: &Identity,
    target: &Target,
    headers: &HeaderMap,
    body: Body,
) -> Result<AuthorizedRequest, Problem> {
    let roles = route.access.roles();
    if !who.has_one_of(&roles) {
        let needs: Vec<String> = roles.iter().map(|role| role.name().to_owned()).collect();
        let detail = format!("{} may not do this; it needs the role {}", who.name, needs.join(" or "));
        return Err(Problem::new(StatusCode::FORBIDDEN, detail).with(|it| it.needs = needs));
    }
    let vehicle = target.vehicle(&site.snapshot())?;
    let trace = headers.get("traceparent").and_then(|it| it.to_str().ok()).unwrap_or_default().to_owned();
    let mut authorized = AuthorizedRequest { who: who.clone(), vehicle, body: Value::Null, id: None, trace };
    if route.method != Method::Get {
        if route.access.needs_key() {
            authorized.id = Some(RequestId::read(&who.name, headers)?);
        }
        authorized.body = read_body(site, route, body).await?;
    }
    Ok(authorized)
}

async fn read_body(site: &Site, route: Route, body: Body) -> Result<Value, Problem> {
    let limit = site.api.config.max_body_bytes.get();
    let reading = to_bytes(body, usize::try_from(limit).unwrap_or(usize::MAX));
    // Shorter than the limit of the whole request, so that the client gets the reason.
    let timeout = site.api.config.request_timeout_s.seconds().mul_f64(0.8);
    let bytes = match tokio::time::timeout(timeout, reading).await {
        Ok(Ok(bytes)) => bytes,
        Ok(Err(_)) => {
            let detail = format!("the body cannot be read, or has more than {limit} bytes");
            return Err(Problem::new(StatusCode::PAYLOAD_TOO_LARGE, detail));
        }
        Err(_) => return Err(Problem::new(StatusCode::REQUEST_TIMEOUT, "the body did not arrive in time")),
    };
    let bad_request = |detail: String| Problem::new(StatusCode::BAD_REQUEST, detail);
    match (bytes.is_empty(), route.body) {
        (true, Some(_)) if !route.body_is_optional => Err(bad_request("a body is needed".to_owned())),
        (true, _) => Ok(Value::Null),
        (false, _) => {
            serde_json::from_slice(&bytes).map_err(|error| bad_request(format!("the body is not JSON: {error}")))
        }
    }
}

/// Whether the client has command of the vehicle, where the route needs that. The refusal says who has it, so that a
/// program can tell it from a refusal by the vehicle.
fn has_command(site: &Site, access: Access, request: &AuthorizedRequest, now: Instant) -> Result<(), Problem> {
    match access {
        Access::InCommand(or) if !request.who.has_one_of(or) => {
            let vehicle = request.vehicle()?;
            site.api.authorities.check(vehicle, &request.who.name, now).map_err(|refusal| {
                let authority = site.api.authorities.of(vehicle, now);
                Problem::new(StatusCode::CONFLICT, refusal).with(|it| it.command = Some(authority))
            })
        }
        _ => Ok(()),
    }
}

fn too_many(wait: Duration) -> Response {
    let seconds = wait.as_secs_f64().ceil().max(1.0) as u64;
    Problem::new(StatusCode::TOO_MANY_REQUESTS, format!("too many requests; wait {seconds} s"))
        .with_header(RETRY_AFTER, &seconds.to_string())
        .into_response()
}
