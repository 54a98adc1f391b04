//! What stands before every handler: who asks, how often, in which role, holding command or not;
//! and behind it: the record of what was ordered and what became of it.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant, SystemTime};

use axum::body::{Body, Bytes, to_bytes};
use axum::extract::Request;
use axum::http::header::{AUTHORIZATION, CONTENT_TYPE, RETRY_AFTER, WWW_AUTHENTICATE};
use axum::http::{HeaderMap, HeaderValue, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use tokio::sync::{Semaphore, watch};
use tracing::Instrument;

use crate::access::{Identity, Role};
use crate::http::Api;
use crate::limit::Limiter;
use crate::orders::Wish;
use crate::problem::Problem;
use crate::routes::{Access, Method, Route};
use crate::trace;

/// Answers remembered for repeated keys: far more than are repeated within a minute.
const MOST_ANSWERS: usize = 512;
/// Longer arguments are recorded by their length and hash.
const LONGEST_ARGUMENTS: usize = 1024;

/// What the handlers share.
#[derive(Clone)]
pub(crate) struct Site {
    pub(crate) api: Api,
    pub(crate) closing: watch::Receiver<()>,
    /// As many permits as there may be event streams.
    pub(crate) streams: Arc<Semaphore>,
    pub(crate) limiter: Arc<Limiter>,
    pub(crate) answers: Arc<Mutex<VecDeque<Answered>>>,
}

/// Who asks for what, as the guard found it.
#[derive(Debug, Clone)]
pub(crate) struct Asked {
    pub(crate) who: Identity,
    pub(crate) body: Value,
    /// The client's key, made unique among clients; empty where none is asked for.
    pub(crate) request_id: String,
    /// The W3C trace that the request belongs to; empty for one that begins here.
    pub(crate) trace: String,
}

/// What became of a request, in words, for the record; travels with the response.
#[derive(Debug, Clone)]
pub(crate) struct Outcome(pub(crate) Arc<str>);

/// An answer that was given under a key.
pub(crate) struct Answered {
    request_id: String,
    /// Of method, path and body: what the key was used for.
    hash: [u8; 32],
    status: StatusCode,
    kind: HeaderValue,
    body: Bytes,
}

/// Lets `request` through to its handler if `route` may be used by whoever asks.
pub(crate) async fn guard(site: Site, route: Route, mut request: Request, next: Next) -> Response {
    if let Access::Anyone = route.access {
        return next.run(request).await;
    }
    let now = Instant::now();
    let is_order = route.method != Method::Get;
    let path = request.uri().path().to_owned();
    let who = match identify(&site, request.headers()) {
        Ok(who) => who,
        Err(problem) => {
            let response = problem.into_response();
            // Refused floods are not worth a record each.
            if is_order && site.limiter.admit("", now).is_ok() {
                site.note(None, &path, "", &Value::Null, &response);
            }
            return response;
        }
    };
    if let Err(wait) = site.limiter.admit(&who.name, now) {
        return too_many(wait);
    }
    site.api.helms.heard(&who.name, now);
    let asked = match prepare(&site, route, &who, &mut request).await {
        Ok(asked) => asked,
        Err(problem) => {
            let response = problem.into_response();
            if is_order {
                site.note(Some(&who), &path, "", &Value::Null, &response);
            }
            return response;
        }
    };
    if !is_order {
        request.extensions_mut().insert(asked);
        return next.run(request).await;
    }
    let hash = hash(&route, &path, &asked.body);
    if let Some(known) = site.known(&asked.request_id, hash) {
        return known;
    }
    let (request_id, arguments) = (asked.request_id.clone(), asked.body.clone());
    let span = trace::span(&route.method.name().to_uppercase(), route.path, request.headers());
    let mut asked = asked;
    asked.trace = trace::parent_of_more(&span).unwrap_or(asked.trace);
    let response = match at_the_helm(&site, route.access, &who, &path, now) {
        // With who holds it, so that a program can tell this from a refusal of the vehicle's.
        Err(refusal) => {
            let helm = site.api.helms.of(vehicle_in(&path), now).to_json();
            Problem::new(StatusCode::CONFLICT, refusal).with("command", helm).into_response()
        }
        Ok(()) => {
            request.extensions_mut().insert(asked);
            let response = next.run(request).instrument(span.clone()).await;
            site.remember(request_id.clone(), hash, response).await
        }
    };
    trace::answered(&span, response.status().as_u16());
    site.note(Some(&who), &path, &request_id, &arguments, &response);
    response
}

fn identify(site: &Site, headers: &HeaderMap) -> Result<Identity, Problem> {
    let token = headers.get(AUTHORIZATION).and_then(|it| it.to_str().ok()?.strip_prefix("Bearer "));
    let utc_ms = utc().0;
    let found = token.and_then(|it| site.api.tokens.identify(it.trim(), utc_ms));
    found.cloned().ok_or_else(|| {
        let detail =
            if token.is_some() { "the token is not known, or has expired" } else { "a bearer token is needed" };
        Problem::new(StatusCode::UNAUTHORIZED, detail).with_header(WWW_AUTHENTICATE, "Bearer")
    })
}

/// Checks role, body and key.
async fn prepare(site: &Site, route: Route, who: &Identity, request: &mut Request) -> Result<Asked, Problem> {
    let roles = route.access.roles();
    if !who.has_one_of(&roles) {
        let needs: Vec<&str> = roles.iter().map(|it| it.name()).collect();
        let detail = format!("{} may not do this; it takes the role {}", who.name, needs.join(" or "));
        return Err(Problem::new(StatusCode::FORBIDDEN, detail).with("needs", json!(needs)));
    }
    let trace = request.headers().get("traceparent").and_then(|it| it.to_str().ok()).unwrap_or_default().to_owned();
    let mut asked = Asked { who: who.clone(), body: Value::Null, request_id: String::new(), trace };
    if route.method == Method::Get {
        return Ok(asked);
    }
    if route.access.is_keyed() {
        let key = request.headers().get("idempotency-key").and_then(|it| it.to_str().ok()).map(str::trim);
        let key = key.filter(|it| !it.is_empty() && it.len() <= 64).ok_or_else(|| {
            Problem::new(
                StatusCode::BAD_REQUEST,
                "the header Idempotency-Key is missing, or not 1 to 64 characters long",
            )
        })?;
        asked.request_id = format!("{}:{key}", who.name);
    }
    let most = usize::try_from(site.api.config.max_body_bytes.get()).unwrap_or(usize::MAX);
    let reading = to_bytes(std::mem::take(request.body_mut()), most);
    let limit = site.api.config.request_timeout_s.seconds().mul_f64(0.8);
    let body = match tokio::time::timeout(limit, reading).await {
        Ok(Ok(body)) => body,
        Ok(Err(_)) => {
            let detail = format!("the body cannot be read, or has more than {most} bytes");
            return Err(Problem::new(StatusCode::PAYLOAD_TOO_LARGE, detail));
        }
        Err(_) => return Err(Problem::new(StatusCode::REQUEST_TIMEOUT, "the body did not come in time")),
    };
    if !body.is_empty() {
        asked.body = serde_json::from_slice(&body)
            .map_err(|it| Problem::new(StatusCode::BAD_REQUEST, format!("the body is no JSON: {it}")))?;
    } else if !route.body.is_empty() {
        return Err(Problem::new(StatusCode::BAD_REQUEST, "a body is needed"));
    }
    Ok(asked)
}

/// Whether `who` holds command of the vehicle in `path`, where that is asked for.
fn at_the_helm(site: &Site, access: Access, who: &Identity, path: &str, now: Instant) -> Result<(), String> {
    match access {
        Access::Helm(or) if !who.has_one_of(or) => site.api.helms.check(vehicle_in(path), &who.name, now),
        _ => Ok(()),
    }
}

fn too_many(wait: Duration) -> Response {
    let seconds = wait.as_secs_f64().ceil().max(1.0) as u64;
    Problem::new(StatusCode::TOO_MANY_REQUESTS, format!("too many requests; wait {seconds} s"))
        .with_header(RETRY_AFTER, &seconds.to_string())
        .into_response()
}

impl Site {
    /// The answer that was given under this key.
    fn known(&self, request_id: &str, hash: [u8; 32]) -> Option<Response> {
        let answers = self.answers();
        let known = answers.iter().find(|it| !request_id.is_empty() && it.request_id == request_id)?;
        if known.hash != hash {
            let detail = "the key was used for another request";
            return Some(Problem::new(StatusCode::UNPROCESSABLE_ENTITY, detail).into_response());
        }
        Some((known.status, [(CONTENT_TYPE, known.kind.clone())], known.body.clone()).into_response())
    }

    /// Remembers an answer that would be the same if it were asked for again.
    async fn remember(&self, request_id: String, hash: [u8; 32], response: Response) -> Response {
        let status = response.status();
        let is_final = status.is_success() || matches!(status, StatusCode::CONFLICT | StatusCode::UNPROCESSABLE_ENTITY);
        if request_id.is_empty() || !is_final {
            return response;
        }
        let (head, body) = response.into_parts();
        // Bodies of ours: whole, and in memory.
        let body = to_bytes(body, usize::MAX).await.unwrap_or_default();
        let kind = head.headers.get(CONTENT_TYPE).cloned().unwrap_or(HeaderValue::from_static("application/json"));
        let mut answers = self.answers();
        answers.push_back(Answered { request_id, hash, status, kind, body: body.clone() });
        while MOST_ANSWERS < answers.len() {
            answers.pop_front();
        }
        Response::from_parts(head, Body::from(body))
    }

    fn answers(&self) -> std::sync::MutexGuard<'_, VecDeque<Answered>> {
        // Plain data: a thread that panicked while it held the lock has left it whole.
        self.answers.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// Records what was ordered and what became of it.
    fn note(&self, who: Option<&Identity>, path: &str, request_id: &str, arguments: &Value, response: &Response) {
        let vehicle = vehicle_in(path);
        let text = arguments.to_string();
        let arguments = if text.len() <= LONGEST_ARGUMENTS {
            arguments.clone()
        } else {
            json!({ "bytes": text.len(), "sha256": hex(&Sha256::digest(text.as_bytes())) })
        };
        let outcome = response.extensions().get::<Outcome>().map(|it| it.0.to_string()).unwrap_or_default();
        let roles: Vec<&str> = who.map(|it| it.roles.iter().map(|it: &Role| it.name()).collect()).unwrap_or_default();
        let record = json!({
            "utc": utc().1,
            "who": who.map(|it| it.name.to_string()),
            "roles": roles,
            "vehicle": vehicle,
            "what": what_in(path),
            "requestId": request_id.split_once(':').map_or("", |(_, key)| key),
            "arguments": arguments,
            "status": response.status().as_u16(),
            "outcome": outcome,
        });
        self.api.audit.record(record.clone());
        if who.is_some() && !vehicle.is_empty() && self.snapshot().fleet.vehicles.contains_key(vehicle) {
            self.api.orders.send(Wish::Tell { vehicle: vehicle.into(), kind: "audit", record });
        }
    }
}

/// The vehicle that a path is about; empty for none.
fn vehicle_in(path: &str) -> &str {
    path.strip_prefix("/api/v1/vehicles/").and_then(|it| it.split('/').next()).unwrap_or_default()
}

/// What is asked of it.
fn what_in(path: &str) -> &str {
    let rest = path.strip_prefix("/api/v1/vehicles/").and_then(|it| it.split_once('/'));
    rest.map_or(path, |(_, what)| what)
}

fn hash(route: &Route, path: &str, body: &Value) -> [u8; 32] {
    Sha256::digest(format!("{:?} {path} {body}", route.method).as_bytes()).into()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|it| format!("{it:02x}")).collect()
}

/// Now, in milliseconds and in words.
fn utc() -> (i64, String) {
    let now = SystemTime::now();
    let since_epoch = now.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    (i64::try_from(since_epoch.as_millis()).unwrap_or(i64::MAX), humantime::format_rfc3339_millis(now).to_string())
}
