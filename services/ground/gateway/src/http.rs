//! The routes, and what each of them answers.

use std::sync::Arc;

use axum::extract::rejection::PathRejection;
use axum::extract::{Path, Request, State};
use axum::http::header::{CACHE_CONTROL, CONTENT_LENGTH};
use axum::http::{HeaderMap, StatusCode, Uri};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response, Sse};
use axum::routing::get;
use axum::{Json, Router};
use serde_json::{Value, json};
use tokio::sync::{Semaphore, watch};

use crate::config::Config;
use crate::events::{self, Client};
use crate::journal::{Cursor, Journals};
use crate::page;
use crate::problem::Problem;
use crate::readiness::{Readiness, readiness};
use crate::state::Snapshot;
use crate::view::{self, Ages};

/// What the gateway's loop shares with the HTTP side: read-only, always the newest.
#[derive(Debug, Clone)]
pub struct Api {
    pub(crate) config: Config,
    pub(crate) ages: Ages,
    pub(crate) snapshot: watch::Receiver<Arc<Snapshot>>,
    pub(crate) journals: watch::Receiver<Journals>,
}

/// The routes; event streams end when the sender of `closing` is dropped.
pub fn router(api: Api, closing: watch::Receiver<()>) -> Router {
    let streams = Arc::new(Semaphore::new(usize::from(api.config.max_event_streams.get())));
    let site = Site { api, closing, streams };
    Router::new()
        .merge(page::routes())
        .route("/healthz", get(healthz))
        .route("/readyz", get(readyz))
        .route("/api/v1/vehicles", get(vehicles))
        .route("/api/v1/vehicles/{id}", get(vehicle))
        .route("/api/v1/vehicles/{id}/events", get(vehicle_events))
        .fallback(no_such_route)
        .method_not_allowed_fallback(method_not_allowed)
        .layer(from_fn_with_state(site.clone(), within_limits))
        .with_state(site)
}

#[derive(Clone)]
struct Site {
    api: Api,
    closing: watch::Receiver<()>,
    /// As many permits as there may be event streams.
    streams: Arc<Semaphore>,
}

impl Site {
    /// Taken out at once: a snapshot held would hold up the gateway's loop.
    fn snapshot(&self) -> Arc<Snapshot> {
        self.api.snapshot.borrow().clone()
    }
}

async fn healthz(State(site): State<Site>) -> Response {
    // The sending half lives in the gateway's loop.
    match site.api.snapshot.has_changed() {
        Ok(_) => document(json!({ "status": "ok" })),
        Err(_) => unavailable("the gateway's loop has ended").into_response(),
    }
}

async fn readyz(State(site): State<Site>) -> Response {
    match readiness(&site.snapshot(), site.api.ages.stale_after) {
        Readiness::Ready(vehicles) => {
            let vehicles: Vec<&str> = vehicles.iter().map(|it| it.as_ref()).collect();
            document(json!({ "status": "ready", "vehicles": vehicles }))
        }
        Readiness::NotReady(lacks) if lacks.is_empty() => {
            unavailable("no vehicle seen yet").with("missing", json!({})).into_response()
        }
        Readiness::NotReady(lacks) => {
            let missing: serde_json::Map<_, _> = lacks.iter().map(|(name, it)| (name.to_string(), json!(it))).collect();
            unavailable("no vehicle's system is complete").with("missing", missing.into()).into_response()
        }
    }
}

async fn vehicles(State(site): State<Site>) -> Response {
    document(view::fleet(&site.snapshot()))
}

async fn vehicle(State(site): State<Site>, id: Result<Path<String>, PathRejection>) -> Result<Response, Problem> {
    let id = parse(id)?;
    view::vehicle(&site.snapshot(), &id, site.api.ages).map(document).ok_or_else(|| no_such_vehicle(&id))
}

async fn vehicle_events(
    State(site): State<Site>,
    id: Result<Path<String>, PathRejection>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let id = parse(id)?;
    if !site.snapshot().fleet.vehicles.contains_key(id.as_str()) {
        return Err(no_such_vehicle(&id));
    }
    let permit = site
        .streams
        .try_acquire_owned()
        .map_err(|_| unavailable(format!("all {} event streams are taken", site.api.config.max_event_streams)))?;
    let cursor = headers.get("last-event-id").and_then(|it| it.to_str().ok()).map_or(Cursor::Start, Cursor::after);
    let client = Client {
        vehicle: id.into(),
        cursor,
        journals: site.api.journals,
        snapshot: site.api.snapshot,
        ages: site.api.ages,
        closing: site.closing,
        status_period: site.api.config.status_rate_hz.period(),
        permit,
    };
    Ok(Sse::new(events::stream(client)).into_response())
}

async fn no_such_route(uri: Uri) -> Problem {
    Problem::new(StatusCode::NOT_FOUND, format!("there is no `{}`", uri.path()))
}

async fn method_not_allowed() -> Problem {
    Problem::new(StatusCode::METHOD_NOT_ALLOWED, "only GET and HEAD are served")
}

/// Refuses bodies that are too large and gives up on answers that take too long.
async fn within_limits(State(site): State<Site>, request: Request, next: Next) -> Response {
    let config = &site.api.config;
    let most = u64::from(config.max_body_bytes.get());
    let declared = request.headers().get(CONTENT_LENGTH).and_then(|it| it.to_str().ok()?.parse::<u64>().ok());
    if let Some(declared) = declared.filter(|it| most < *it) {
        let detail = format!("the body has {declared} bytes, at most {most} are taken");
        return Problem::new(StatusCode::PAYLOAD_TOO_LARGE, detail).into_response();
    }
    match tokio::time::timeout(config.request_timeout_s.seconds(), next.run(request)).await {
        Ok(response) => response,
        Err(_) => unavailable("the answer took too long").into_response(),
    }
}

fn parse(id: Result<Path<String>, PathRejection>) -> Result<String, Problem> {
    id.map(|Path(id)| id).map_err(|rejection| Problem::new(rejection.status(), rejection.body_text()))
}

fn document(json: Value) -> Response {
    ([(CACHE_CONTROL, "no-store")], Json(json)).into_response()
}

fn no_such_vehicle(id: &str) -> Problem {
    Problem::new(StatusCode::NOT_FOUND, format!("vehicle `{id}` was never seen"))
}

fn unavailable(detail: impl Into<String>) -> Problem {
    Problem::new(StatusCode::SERVICE_UNAVAILABLE, detail)
}
