//! The HTTP half: the router, and the routes that only read.

#![expect(clippy::disallowed_methods, reason = "requests and their limits are on the wall clock")]

use std::sync::Arc;
use std::time::Instant;

use axum::body::Body;
use axum::extract::{Query, Request, State};
use axum::http::header::{CACHE_CONTROL, CONTENT_LENGTH, CONTENT_TYPE};
use axum::http::{HeaderMap, HeaderName, Method, StatusCode, Uri};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::{Extension, Router};
use kittiwake_proto::v1;
use prost::Name;
use tokio::sync::watch;
use tower_http::CompressionLevel;
use tower_http::compression::CompressionLayer;
use tower_http::compression::predicate::{DefaultPredicate, NotForContentType, Predicate, SizeAbove};

use crate::access::CurrentTokens;
use crate::audit::Audit;
use crate::config::Config;
use crate::fleet::Snapshot;
use crate::http::answer::{Answer, document};
use crate::http::answer_memory::{AnswerMemory, within_memory};
use crate::http::command_authority::CommandAuthorities;
use crate::http::documents::Documents;
use crate::http::events::{Client, EVENT_STREAM};
use crate::http::guard::AuthorizedRequest;
use crate::http::latency::Latencies;
use crate::http::limit::RateLimiter;
use crate::http::problem::Problem;
use crate::http::readiness::readiness;
use crate::http::routes::{Access, READERS, Reply, Route, Routes};
use crate::http::site::Site;
use crate::http::standstill::Standstill;
use crate::http::status::StatusCache;
use crate::journal::{Cursor, Journals};
use crate::orders::OrderSender;
use crate::recording::{self, Recordings};
use crate::shares::Shares;
use crate::tls::ShownCertificate;
use crate::view::{self, Ages};

pub(crate) mod answer;
pub(crate) mod answer_memory;
pub(crate) mod caller;
pub(crate) mod command_authority;
mod commands;
mod decisions;
pub(crate) mod documents;
pub(crate) mod events;
pub(crate) mod guard;
mod health;
mod idempotency;
mod latency;
mod limit;
mod metrics;
mod openapi;
mod order;
mod page;
pub(crate) mod problem;
mod readiness;
mod record;
pub(crate) mod routes;
#[cfg(test)]
pub(crate) mod served;
pub(crate) mod session;
pub(crate) mod site;
pub(crate) mod standstill;
mod status;
mod target;
mod trace;
mod unprintable;

/// What the gateway's loop shares with the HTTP half.
#[derive(Debug, Clone)]
pub struct Api {
    pub(crate) config: Config,
    /// The part of every session that comes from the contingency table.
    pub(crate) of_table: Arc<v1::Session>,
    pub(crate) ages: Ages,
    pub(crate) snapshot: watch::Receiver<Arc<Snapshot>>,
    pub(crate) journals: watch::Receiver<Journals>,
    pub(crate) tokens: Arc<CurrentTokens>,
    pub(crate) audit: Arc<Audit>,
    pub(crate) authorities: Arc<CommandAuthorities>,
    pub(crate) orders: OrderSender,
    pub(crate) recordings: Recordings,
    pub(crate) statuses: Arc<StatusCache>,
    pub(crate) documents: Arc<Documents>,
    pub(crate) standstill: Standstill,
    pub(crate) certificate: Option<Arc<ShownCertificate>>,
}

/// Bodies larger than `max_body_bytes` that are read or carried out at a time, in all and of one token. It is there as it
/// came, as JSON, as a message and as what is sent. (Measured: 14 MB for one of 1.6 MB.)
const LARGE_BODIES: usize = 4;
const LARGE_BODIES_PER_TOKEN: usize = 2;

/// Bytes of the shortest answer that is compressed: a shorter one fits into one packet.
const LEAST_COMPRESSED: u16 = 1024;

/// Every route; event streams end when the sender of `closing` is dropped.
pub fn router(api: Api, closing: watch::Receiver<()>) -> Router {
    let (config, simulation) = (&api.config, api.config.simulation);
    let downloads_per_token = usize::from(config.clients.downloads_per_token.get());
    let site = Site {
        closing,
        streams: Shares::new(config.max_event_streams.get().into(), config.clients.streams_per_token.get().into()),
        large_bodies: Shares::new(LARGE_BODIES, LARGE_BODIES_PER_TOKEN),
        limiter: Arc::new(RateLimiter::new(config.requests_per_s.get(), config.requests_at_once.get())),
        answers: Arc::default(),
        missions: Arc::default(),
        memory: AnswerMemory::default(),
        latencies: Latencies::default(),
        api,
    };
    let routes = page::add_to(Routes::new(site.clone()));
    let routes = recording::routes::add_to(add_to(routes), downloads_per_token);
    commands::add_to(routes, simulation)
        .finish()
        .fallback(no_such_route)
        .method_not_allowed_fallback(method_not_allowed)
        .layer(from_fn_with_state(site.clone(), within_limits))
        .layer(from_fn_with_state(site.clone(), within_memory))
        .layer(compression())
        .with_state(site)
}

/// Texts are compressed for who takes that: a state is a tenth then, and the page a third. Events would wait in the compressor, and recordings are
/// compressed already.
fn compression() -> CompressionLayer<impl Predicate> {
    let when = DefaultPredicate::new()
        .and(SizeAbove::new(LEAST_COMPRESSED))
        .and(NotForContentType::const_new(recording::download::MEDIA_TYPE));
    CompressionLayer::new().quality(CompressionLevel::Fastest).compress_when(when)
}

fn add_to(routes: Routes) -> Routes {
    use Access::Anyone;
    use Reply::{Document, Media};
    let read = Route::read;
    let events = "Its events as server-sent events, and its state as `status` at a fixed rate; Last-Event-ID resumes. A `status` may \
        overtake events that wait: those with an earlier `utc` tell what it knows already";
    let decided = "The last decisions with value, rejected alternatives and the decision that led to each, oldest first: \
        `?last=N` for the last N of 500, `?after=NUMBER` for those with higher numbers";
    let flown = "Where it has flown its present mission, and how, also before the gateway was started again";
    let readyz = "Whether every service and its data were seen, or what is missing";
    routes
        .add(read("/healthz", Anyone, "Whether the gateway's loop runs", Document(v1::GatewayHealth::NAME)), healthz)
        .add(read("/readyz", Anyone, readyz, Document(v1::Readiness::NAME)), self::readyz)
        .add(read("/metrics", READERS, "OpenMetrics", Media(metrics::CONTENT_TYPE)), metrics)
        .add(
            read("/api/v1/session", READERS, "The client's roles and configuration", Document(v1::Session::NAME)),
            session::session,
        )
        .add(read("/api/v1/audit", READERS, "The orders and their outcomes", Document(v1::AuditLog::NAME)), audit)
        .add(
            read("/api/v1/audit/refusals", READERS, "The requests that were refused", Document(v1::RefusalLog::NAME)),
            refusals,
        )
        .add(read("/api/v1/vehicles", READERS, "The vehicles", Document(v1::Fleet::NAME)), vehicles)
        .add(
            read("/api/v1/vehicles/{id}", READERS, "The whole state of one vehicle", Document(v1::Vehicle::NAME)),
            vehicle,
        )
        .add(
            read("/api/v1/vehicles/{id}/decisions", READERS, decided, Document(v1::DecisionList::NAME)),
            decisions::decisions,
        )
        .add(read("/api/v1/vehicles/{id}/track", READERS, flown, Document(v1::Track::NAME)), track)
        .add(read("/api/v1/vehicles/{id}/events", READERS, events, Media(EVENT_STREAM)), vehicle_events)
}

async fn metrics(State(site): State<Site>) -> Response {
    let writer = site.api.recordings.writer.as_deref();
    let text = metrics::text(&site.snapshot(), site.api.ages, &site.api.audit, writer, &site.latencies);
    ([(CONTENT_TYPE, metrics::CONTENT_TYPE)], text).into_response()
}

#[derive(serde::Deserialize)]
struct Count {
    limit: Option<usize>,
}

async fn audit(
    State(site): State<Site>,
    Query(count): Query<Count>,
    Extension(request): Extension<AuthorizedRequest>,
) -> Answer {
    let (audit, count) = (site.api.audit.clone(), count.limit.unwrap_or(100));
    let records = move || Ok(v1::AuditLog { records: audit.newest(count) });
    site.api.documents.make(&request.who, records).await
}

async fn refusals(
    State(site): State<Site>,
    Query(count): Query<Count>,
    Extension(request): Extension<AuthorizedRequest>,
) -> Answer {
    let (audit, count) = (site.api.audit.clone(), count.limit.unwrap_or(100));
    site.api.documents.make(&request.who, move || Ok(audit.refusals.newest(count))).await
}

async fn healthz(State(site): State<Site>) -> Answer {
    // The gateway's loop owns the sender.
    match site.api.snapshot.has_changed() {
        Ok(_) => {
            let recordings = site.api.recordings.state().to_owned();
            let audit = site.api.audit.state().to_owned();
            let memory = health::memory_problems(&site.snapshot());
            let own = site.api.audit.problems().into_iter().chain(site.api.tokens.problem());
            let own = own.chain(site.api.certificate.as_ref().and_then(|it| it.problem()));
            let problems: Vec<String> = own.chain(memory).collect();
            // Still 200: starting the gateway again would remedy nothing.
            let status = if problems.is_empty() { "ok" } else { "degraded" }.to_owned();
            Ok(document(&v1::GatewayHealth { status, recordings, audit, problems }))
        }
        Err(_) => Err(Problem::unavailable("the gateway's loop has ended")),
    }
}

async fn readyz(State(site): State<Site>) -> Answer {
    readiness(&site.snapshot(), site.api.ages.stale_after).map(|ready| document(&ready))
}

async fn vehicles(State(site): State<Site>) -> Response {
    document(&view::fleet(&site.snapshot(), site.api.ages))
}

async fn vehicle(State(site): State<Site>, Extension(request): Extension<AuthorizedRequest>) -> Answer {
    let vehicle = request.vehicle()?;
    let authority = site.api.authorities.of(vehicle, Instant::now());
    let found = view::vehicle::vehicle(&site.snapshot(), vehicle, site.api.ages, &authority);
    found.map(|it| document(&it)).ok_or_else(|| Problem::no_such_vehicle(vehicle))
}

async fn track(State(site): State<Site>, Extension(request): Extension<AuthorizedRequest>) -> Answer {
    let (vehicle, documents) = (request.vehicle()?.clone(), site.api.documents.clone());
    let flown = move || {
        let snapshot = site.snapshot();
        let state = snapshot.fleet.vehicles.get(&vehicle).ok_or_else(|| Problem::no_such_vehicle(&vehicle))?;
        Ok(v1::Track { vehicle: vehicle.to_string(), points: state.track.points().to_vec() })
    };
    documents.make(&request.who, flown).await
}

async fn vehicle_events(
    State(site): State<Site>,
    Extension(request): Extension<AuthorizedRequest>,
    headers: HeaderMap,
) -> Answer {
    let share = site.streams.take_for(&request.who).map_err(|taken| taken.problem("event streams"))?;
    let id = headers.get("last-event-id").and_then(|it| it.to_str().ok());
    let client = Client {
        vehicle: request.vehicle()?.clone(),
        who: request.who.clone(),
        cursor: id.map_or(Cursor::Start, Cursor::after),
        journals: site.api.journals.clone(),
        snapshot: site.api.snapshot.clone(),
        site,
        _share: share,
    };
    // The last one tells a proxy (nginx's, and those that follow it) to pass on each event as it comes.
    let unbuffered = HeaderName::from_static("x-accel-buffering");
    let headers = [(CONTENT_TYPE, EVENT_STREAM), (CACHE_CONTROL, "no-cache"), (unbuffered, "no")];
    Ok((headers, Body::from_stream(events::stream(client))).into_response())
}

async fn no_such_route(uri: Uri) -> Problem {
    Problem::new(StatusCode::NOT_FOUND, format!("there is no `{}`; `/docs` lists the routes", uri.path()))
}

async fn method_not_allowed(method: Method, uri: Uri) -> Problem {
    let detail = format!("`{}` does not take {method}; `/docs` lists the routes", uri.path());
    Problem::new(StatusCode::METHOD_NOT_ALLOWED, detail)
}

/// Whether a request may change something.
pub(crate) fn is_order(method: &Method) -> bool {
    !matches!(*method, Method::GET | Method::HEAD)
}

/// Refuses bodies that are too large, and ends readings whose answer takes too long. An order is not ended here, where nobody knows
/// whether it was carried out: its body has a limit (`guard`), and from there on its answer (`order`).
async fn within_limits(State(site): State<Site>, request: Request, next: Next) -> Response {
    let config = &site.api.config;
    // That of the route is lower, if it takes no mission: see `guard`.
    let limit = u64::from(config.max_body_bytes.get()).max(config.max_mission_bytes.get() as u64);
    let declared = request.headers().get(CONTENT_LENGTH).and_then(|it| it.to_str().ok()?.parse::<u64>().ok());
    if let Some(declared) = declared.filter(|declared| limit < *declared) {
        let detail = format!("the body has {declared} bytes, more than the limit of {limit}");
        return Problem::new(StatusCode::PAYLOAD_TOO_LARGE, detail).into_response();
    }
    if is_order(request.method()) {
        return next.run(request).await;
    }
    match tokio::time::timeout(config.request_timeout_s.seconds(), next.run(request)).await {
        Ok(response) => response,
        Err(_) => Problem::unavailable("the answer took too long").into_response(),
    }
}

#[cfg(test)]
mod tests {
    use axum::body::to_bytes;
    use axum::http::header::{ACCEPT_ENCODING, CONTENT_ENCODING};

    use super::served::{Served, WATCHER};
    use super::*;

    #[tokio::test]
    async fn texts_are_compressed_for_clients_that_take_that() {
        let served = Served::new(&[]);
        let check = async |path: &str, taken: Option<&str>, expected: Option<&str>| {
            let mut request = Request::builder().uri(path);
            if let Some(taken) = taken {
                request = request.header(ACCEPT_ENCODING, taken);
            }
            let response = served.ask(request, WATCHER).await;
            let encoding = response.headers().get(CONTENT_ENCODING).map(|it| it.to_str().unwrap().to_owned());
            assert_eq!((response.status(), encoding.as_deref()), (StatusCode::OK, expected), "{path} {taken:?}");
            response
        };
        let whole = check("/page/store.js", None, None).await;
        let whole = to_bytes(whole.into_body(), usize::MAX).await.unwrap();
        let small = check("/page/store.js", Some("gzip, br"), Some("gzip")).await;
        let small = to_bytes(small.into_body(), usize::MAX).await.unwrap();
        assert!(2 * small.len() < whole.len(), "{} of {}", small.len(), whole.len());
        check("/page/store.js", Some("br"), None).await;
        check("/api/v1/vehicles", Some("gzip"), None).await;
        check("/api/v1/vehicles/uav1/events", Some("gzip"), None).await;
    }
}
