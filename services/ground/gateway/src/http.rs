//! The routes, and what each of them answers.

use std::sync::Arc;
use std::time::Instant;

use axum::extract::rejection::PathRejection;
use axum::extract::{Path, Query, Request, State};
use axum::http::header::{CACHE_CONTROL, CONTENT_LENGTH, CONTENT_TYPE};
use axum::http::{HeaderMap, StatusCode, Uri};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{Html, IntoResponse, Response, Sse};
use axum::routing::get;
use axum::{Extension, Json, Router};
use serde_json::{Value, json};
use tokio::sync::{Semaphore, watch};

use crate::access::Tokens;
use crate::audit::Audit;
use crate::config::Config;
use crate::events::{self, Client};
use crate::guard::{Asked, Site};
use crate::helm::Helms;
use crate::journal::{Cursor, Journals};
use crate::limit::Limiter;
use crate::orders::Orders;
use crate::problem::Problem;
use crate::readiness::{Readiness, readiness};
use crate::recording::{self, Recordings};
use crate::routes::{Access, Method, READERS, Route, Routes};
use crate::state::Snapshot;
use crate::status::Statuses;
use crate::view::{self, Ages};
use crate::{commands, metrics, page};

const DOCS: &str = include_str!("docs.html");

/// What the gateway's loop shares with the HTTP side.
#[derive(Debug, Clone)]
pub struct Api {
    pub(crate) config: Config,
    pub(crate) ages: Ages,
    pub(crate) snapshot: watch::Receiver<Arc<Snapshot>>,
    pub(crate) journals: watch::Receiver<Journals>,
    pub(crate) tokens: Arc<Tokens>,
    pub(crate) audit: Arc<Audit>,
    pub(crate) helms: Arc<Helms>,
    pub(crate) orders: Orders,
    pub(crate) recordings: Recordings,
    pub(crate) statuses: Arc<Statuses>,
}

/// The routes; event streams end when the sender of `closing` is dropped.
pub fn router(api: Api, closing: watch::Receiver<()>) -> Router {
    let (config, simulation) = (&api.config, api.config.simulation);
    let site = Site {
        closing,
        streams: Arc::new(Semaphore::new(usize::from(config.max_event_streams.get()))),
        limiter: Arc::new(Limiter::new(config.requests_per_s.get(), config.requests_at_once.get())),
        answers: Arc::default(),
        api,
    };
    let routes = Routes::new(site.clone())
        .add(read("/docs", Access::Anyone, "This document, to be browsed", "text/html"), docs)
        .add(read("/healthz", Access::Anyone, "The process lives", ""), healthz)
        .add(read("/readyz", Access::Anyone, "Every service and its data are seen, or what is missing", ""), readyz)
        .add(read("/metrics", READERS, "OpenMetrics", metrics::CONTENT_TYPE), metrics)
        .add(read("/api/v1/session", READERS, "Who asks", "Session"), session)
        .add(read("/api/v1/audit", READERS, "What was ordered, by whom, and what became of it", "Audit"), audit)
        .add(read("/api/v1/vehicles", READERS, "The vehicles", "Fleet"), vehicles)
        .add(read("/api/v1/vehicles/{id}", READERS, "Everything about one vehicle", "Vehicle"), vehicle)
        .add(
            read(
                "/api/v1/vehicles/{id}/events",
                READERS,
                "What happens, as server-sent events; Last-Event-ID resumes",
                "text/event-stream",
            ),
            vehicle_events,
        )
        .add(
            read(
                "/api/v1/vehicles/{id}/mission",
                READERS,
                "The mission as the planner has it",
                "kittiwake.v1.PlannerStatus",
            ),
            commands::read_mission,
        );
    let routes = recording::routes::add_to(routes);
    let (router, document) = commands::add_to(routes, simulation).finish();
    let openapi: Arc<str> = document.to_string().into();
    router
        .merge(page::routes())
        .route("/openapi.json", get(move || async move { ([(CONTENT_TYPE, "application/json")], openapi.to_string()) }))
        .fallback(no_such_route)
        .method_not_allowed_fallback(method_not_allowed)
        .layer(from_fn_with_state(site.clone(), within_limits))
        .with_state(site)
}

fn read(path: &'static str, access: Access, summary: &'static str, answer: &'static str) -> Route {
    Route { method: Method::Get, path, access, summary, body: "", answer }
}

impl Site {
    /// Taken out at once: a snapshot held would hold up the gateway's loop.
    pub(crate) fn snapshot(&self) -> Arc<Snapshot> {
        self.api.snapshot.borrow().clone()
    }
}

async fn docs() -> Html<&'static str> {
    Html(DOCS)
}

async fn metrics(State(site): State<Site>) -> Response {
    let text = metrics::text(&site.snapshot(), site.api.ages, &site.api.audit, site.api.recordings.gauges.as_deref());
    ([(CONTENT_TYPE, metrics::CONTENT_TYPE)], text).into_response()
}

async fn session(State(site): State<Site>, Extension(asked): Extension<Asked>) -> Response {
    let roles: Vec<&str> = asked.who.roles.iter().map(|it| it.name()).collect();
    document(json!({ "name": &*asked.who.name, "roles": roles, "simulation": site.api.config.simulation }))
}

#[derive(serde::Deserialize)]
struct Most {
    limit: Option<usize>,
}

async fn audit(State(site): State<Site>, Query(most): Query<Most>) -> Response {
    document(json!({ "records": site.api.audit.newest(most.limit.unwrap_or(100)) }))
}

async fn healthz(State(site): State<Site>) -> Response {
    // The sending half lives in the gateway's loop.
    match site.api.snapshot.has_changed() {
        Ok(_) => document(json!({ "status": "ok", "recordings": site.api.recordings.state() })),
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
    let helm = site.api.helms.of(&id, Instant::now());
    view::vehicle(&site.snapshot(), &id, site.api.ages, &helm).map(document).ok_or_else(|| no_such_vehicle(&id))
}

async fn vehicle_events(
    State(site): State<Site>,
    id: Result<Path<String>, PathRejection>,
    Extension(asked): Extension<Asked>,
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
        helms: site.api.helms,
        who: asked.who.name,
        ages: site.api.ages,
        statuses: site.api.statuses,
        closing: site.closing,
        status_period: site.api.config.status_rate_hz.period(),
        permit,
    };
    Ok(Sse::new(events::stream(client)).into_response())
}

async fn no_such_route(uri: Uri) -> Problem {
    Problem::new(StatusCode::NOT_FOUND, format!("there is no `{}`; `/docs` lists what there is", uri.path()))
}

async fn method_not_allowed() -> Problem {
    Problem::new(StatusCode::METHOD_NOT_ALLOWED, "this is not done to it; `/docs` lists what is")
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

pub(crate) fn document(json: Value) -> Response {
    ([(CACHE_CONTROL, "no-store")], Json(json)).into_response()
}

pub(crate) fn no_such_vehicle(id: &str) -> Problem {
    Problem::new(StatusCode::NOT_FOUND, format!("vehicle `{id}` was never seen"))
}

fn unavailable(detail: impl Into<String>) -> Problem {
    Problem::new(StatusCode::SERVICE_UNAVAILABLE, detail)
}
