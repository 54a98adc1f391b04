//! What every request passes on its way to its handler: who asks, how often, from where, in which role, about which vehicle.
//! An order goes on to [`order`]; a refusal is recorded here.

#![expect(clippy::disallowed_methods, reason = "requests and their limits are on the wall clock")]

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::body::{Body, HttpBody as _, to_bytes};
use axum::extract::Request;
use axum::http::header::{AUTHORIZATION, RETRY_AFTER, WWW_AUTHENTICATE};
use axum::http::request::Parts;
use axum::http::{HeaderMap, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use kittiwake_proto::v1;
use node::VehicleId;
use prost::Name as _;
use serde_json::Value;

use crate::access::{Identity, utc_ms_now};
use crate::http::caller::Caller;
use crate::http::idempotency::RequestId;
use crate::http::limit::Budget;
use crate::http::order;
use crate::http::problem::{Kind, Problem};
use crate::http::routes::{Access, Method, Route};
use crate::http::site::Site;
use crate::http::standstill::since_boot;
use crate::http::target::Target;
use crate::http::unprintable;
use crate::shares::Share;

/// A request that its client may make.
#[derive(Debug, Clone)]
pub(crate) struct AuthorizedRequest {
    pub(crate) who: Identity,
    pub(crate) caller: Caller,
    /// When its head was read, after the start of the machine.
    pub(crate) begun: Duration,
    pub(crate) target: Target,
    pub(crate) body: Value,
    /// The id of an order that needs a key.
    pub(crate) id: Option<RequestId>,
    /// The W3C trace that the request belongs to; empty for one that begins here.
    pub(crate) trace: String,
    /// The share that a large body takes.
    pub(crate) _share: Option<Arc<Share>>,
}

impl AuthorizedRequest {
    /// The vehicle that the path names.
    pub(crate) fn vehicle(&self) -> Result<&VehicleId, Problem> {
        let none = || Problem::new(StatusCode::INTERNAL_SERVER_ERROR, "the route names no vehicle");
        self.target.vehicle.as_ref().ok_or_else(none)
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
    let (now, begun) = (Instant::now(), since_boot());
    let (mut parts, body) = request.into_parts();
    let (caller, who) = (Caller::of(&parts), identify(&site, &parts.headers));
    let budget = match &who {
        Err(_) => Budget::Strangers,
        Ok(who) if route.method == Method::Get => Budget::Reads(who.name.clone()),
        Ok(who) => Budget::Orders(who.name.clone()),
    };
    if let Err(wait) = site.limiter.admit(budget, now) {
        let problem = too_many(wait);
        // Only counted, so that a flood does not displace what is known of others.
        site.refused_too_many(&caller, &problem);
        return problem.into_response();
    }
    let known = who.as_ref().ok().cloned();
    if let Some(who) = &known {
        site.api.authorities.heard_from(&who.name, now);
    }
    let authorized = match who {
        Ok(who) => authorize(&site, route, (who, begun), &caller, &mut parts, body).await,
        Err(problem) => Err(problem),
    };
    let mut response = match authorized {
        Err(problem) => {
            site.refused(known.as_ref(), &caller, &parts, &problem);
            problem.into_response()
        }
        Ok(authorized) if route.method == Method::Get => {
            parts.extensions.insert(authorized);
            next.run(Request::from_parts(parts, Body::empty())).await
        }
        Ok(authorized) => order::carry_out(site, route, authorized, parts, next).await,
    };
    // Whose memory the answer takes.
    known.map(|who| response.extensions_mut().insert(who));
    response
}

fn identify(site: &Site, headers: &HeaderMap) -> Result<Identity, Problem> {
    // The scheme in any case: RFC 9110, section 11.1.
    let split = headers.get(AUTHORIZATION).and_then(|it| it.to_str().ok()?.split_once(' '));
    let token = split.filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer")).map(|(_, token)| token);
    let valid = site.api.tokens.get();
    let found = token.and_then(|it| valid.identify(it.trim(), utc_ms_now()));
    found
        .cloned()
        .ok_or_else(|| unidentified(if token.is_some() { NO_TOKEN_OF_NOW } else { "a bearer token is needed" }))
}

const NO_TOKEN_OF_NOW: &str = "the token is unknown or has expired";

fn unidentified(why: &str) -> Problem {
    Problem::new(StatusCode::UNAUTHORIZED, why).with_header(WWW_AUTHENTICATE, "Bearer")
}

/// Checks seat, role and vehicle, and for an order key and body.
async fn authorize(
    site: &Site,
    route: Route,
    (who, begun): (Identity, Duration),
    caller: &Caller,
    parts: &mut Parts,
    body: Body,
) -> Result<AuthorizedRequest, Problem> {
    caller.identified_as(&who)?;
    let roles = route.access.roles();
    if !who.has_one_of(&roles) {
        let needs: Vec<String> = roles.iter().map(|role| role.name().to_owned()).collect();
        let detail = format!("{} may not do this; it needs the role {}", who.name, needs.join(" or "));
        return Err(Problem::new(StatusCode::FORBIDDEN, detail).with(|it| it.needs = needs));
    }
    let target = Target::read(&route, parts, &site.snapshot()).await?;
    let trace = parts.headers.get("traceparent").and_then(|it| it.to_str().ok()).unwrap_or_default().to_owned();
    let is_order = route.method != Method::Get;
    let needs_key = is_order && route.access.needs_key();
    let id = needs_key.then(|| RequestId::read(&who.name, &parts.headers)).transpose()?;
    let share = if is_order { share_for(site, route, &who, &body)? } else { None };
    let body = if is_order { read_body(site, route, body, share.is_some()).await? } else { Value::Null };
    // The body came when its sender pleased, and the token may have been taken away meanwhile.
    if is_order && !site.api.tokens.get().still_has(&who, utc_ms_now()) {
        return Err(unidentified(NO_TOKEN_OF_NOW));
    }
    Ok(AuthorizedRequest { who, caller: caller.clone(), begun, target, body, id, trace, _share: share.map(Arc::new) })
}

/// Whether the body is the text of a mission.
fn takes_mission(route: Route) -> bool {
    route.body == Some(v1::MissionText::NAME)
}

/// What a body takes that may be larger than most. Its sender has to say its size before.
fn share_for(site: &Site, route: Route, who: &Identity, body: &Body) -> Result<Option<Share>, Problem> {
    let is_large = u64::from(site.api.config.max_body_bytes.get()) < body.size_hint().lower();
    if !is_large || !takes_mission(route) {
        return Ok(None);
    }
    site.large_bodies.take_for(who).map(Some).map_err(|taken| taken.problem("large missions"))
}

async fn read_body(site: &Site, route: Route, body: Body, may_be_large: bool) -> Result<Value, Problem> {
    let config = &site.api.config;
    let limit = u64::from(config.max_body_bytes.get());
    let limit = if may_be_large { limit.max(config.max_mission_bytes.get() as u64) } else { limit };
    let declared = body.size_hint().lower();
    if limit < declared {
        let detail = format!("the body has {declared} bytes, more than the limit of {limit}");
        return Err(Problem::new(StatusCode::PAYLOAD_TOO_LARGE, detail));
    }
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
    let bad_request = |detail: String| Problem::new(StatusCode::BAD_REQUEST, detail).of(Kind::InvalidBody);
    match (bytes.is_empty(), route.body) {
        (true, Some(_)) if !route.body_is_optional => Err(bad_request("a body is needed".to_owned())),
        (true, _) => Ok(Value::Null),
        (false, _) => {
            let body = serde_json::from_slice(&bytes)
                .map_err(|error| bad_request(format!("the body is not JSON: {error}")))?;
            // A mission is a file of many lines; its reader checks the names in it.
            match unprintable::member(&body).filter(|_| !takes_mission(route)) {
                Some(pointer) => {
                    let detail = "the body is invalid: names and texts may not have control characters".to_owned();
                    Err(bad_request(detail).with(|it| it.member = Some(pointer)))
                }
                None => Ok(body),
            }
        }
    }
}

fn too_many(wait: Duration) -> Problem {
    let seconds = wait.as_secs_f64().ceil().max(1.0) as u64;
    Problem::new(StatusCode::TOO_MANY_REQUESTS, format!("too many requests; wait {seconds} s"))
        .with_header(RETRY_AFTER, &seconds.to_string())
}
