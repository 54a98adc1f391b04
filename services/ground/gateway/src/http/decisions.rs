//! The last decisions of a vehicle, each with what led to it and what was rejected.

use axum::Extension;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Query, State};
use domain::wire::decision;

use crate::http::answer::Answer;
use crate::http::guard::AuthorizedRequest;
use crate::http::problem::Problem;
use crate::http::site::Site;

/// Which decisions are wanted.
#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Window {
    /// At most this many, the newest ones; without it, all that are stored.
    last: Option<usize>,
    /// Only those with a number above this one.
    after: Option<u64>,
}

/// Answers with the decisions of the vehicle.
pub(crate) async fn decisions(
    State(site): State<Site>,
    window: Result<Query<Window>, QueryRejection>,
    Extension(request): Extension<AuthorizedRequest>,
) -> Answer {
    let Query(Window { last, after }) =
        window.map_err(|rejection| Problem::new(rejection.status(), rejection.body_text()))?;
    let (vehicle, documents) = (request.vehicle()?.clone(), site.api.documents.clone());
    let decided = move || {
        let snapshot = site.snapshot();
        let state = snapshot.fleet.vehicles.get(&vehicle).ok_or_else(|| Problem::no_such_vehicle(&vehicle))?;
        Ok(decision::list(state.decisions.newest(last.unwrap_or(usize::MAX), after)))
    };
    documents.make(&request.who, decided).await
}
