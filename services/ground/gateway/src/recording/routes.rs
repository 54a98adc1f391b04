//! Recorded missions over HTTP: the list, one in short, and the file itself.

use std::io;
use std::sync::Arc;

use axum::extract::rejection::PathRejection;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode};
use axum::response::Response;
use serde_json::{Value, json};
use tokio::sync::Semaphore;

use crate::guard::Site;
use crate::http::document;
use crate::problem::Problem;
use crate::recording::Recordings;
use crate::recording::download::{self, MEDIA_TYPE};
use crate::recording::id::Id;
use crate::recording::shelf::Shelf;
use crate::routes::{Method, READERS, Route, Routes};

/// Downloads at a time: each holds a file open for as long as its client takes.
const MOST_DOWNLOADS: usize = 16;

/// Adds the routes.
pub(crate) fn add_to(routes: Routes) -> Routes {
    let read = |path, summary, answer| Route { method: Method::Get, path, access: READERS, summary, body: "", answer };
    let downloads = Arc::new(Semaphore::new(MOST_DOWNLOADS));
    routes
        .add(read("/api/v1/recordings", "Recorded missions, newest first", "Recordings"), list)
        .add(
            read(
                "/api/v1/recordings/{recording}",
                "What was to be done, what was decided and how it ended",
                "Recording",
            ),
            summary,
        )
        .add(
            read("/api/v1/recordings/{recording}/file", "The recording itself, for Foxglove and others", MEDIA_TYPE),
            move |site: State<Site>, id: Result<Path<String>, PathRejection>, headers: HeaderMap| {
                file(site, id, headers, downloads.clone())
            },
        )
}

impl Recordings {
    /// `ok`, `off` or `failing`, for anybody who asks.
    pub(crate) fn state(&self) -> &'static str {
        match &self.gauges {
            None => "off",
            Some(gauges) if gauges.problem().is_some() => "failing",
            Some(_) => "ok",
        }
    }

    fn shelf(&self) -> Result<Arc<Shelf>, Problem> {
        self.shelf.clone().ok_or_else(|| {
            Problem::new(StatusCode::NOT_FOUND, "missions are not recorded; `--recordings DIR` names a folder")
        })
    }
}

async fn list(State(site): State<Site>) -> Result<Response, Problem> {
    let recordings = &site.api.recordings;
    let folder = recordings.shelf.as_ref().map(|it| it.folder.display().to_string());
    let found = match recordings.shelf.clone() {
        None => Vec::new(),
        Some(shelf) => unblocked(move || shelf.list()).await?.map_err(|cause| unreadable(&cause))?,
    };
    let gauges = recordings.gauges.as_ref();
    Ok(document(json!({
        "folder": folder,
        "state": recordings.state(),
        "problem": gauges.and_then(|it| it.problem()),
        "dropped": gauges.map_or(0, |it| it.lost()),
        "recordings": found,
    })))
}

async fn summary(State(site): State<Site>, id: Result<Path<String>, PathRejection>) -> Result<Response, Problem> {
    let (id, shelf) = (parse(id)?, site.api.recordings.shelf()?);
    let name = id.clone();
    let found: Option<Value> = unblocked(move || shelf.summary(&id)).await?;
    found.map(document).ok_or_else(|| no_such_recording(&name))
}

async fn file(
    State(site): State<Site>,
    id: Result<Path<String>, PathRejection>,
    headers: HeaderMap,
    downloads: Arc<Semaphore>,
) -> Result<Response, Problem> {
    let (id, shelf) = (parse(id)?, site.api.recordings.shelf()?);
    let permit = downloads.try_acquire_owned().map_err(|_| {
        Problem::new(StatusCode::SERVICE_UNAVAILABLE, format!("all {MOST_DOWNLOADS} downloads are taken; try again"))
    })?;
    let name = id.clone();
    let (file, bytes) = unblocked(move || shelf.file(&id)).await?.map_err(|cause| match cause.kind() {
        io::ErrorKind::NotFound => no_such_recording(&name),
        _ => unreadable(&cause),
    })?;
    Ok(download::answer(file, bytes, &name.file_name(), &headers, permit))
}

/// What waits for a disk is done beside the threads that answer.
async fn unblocked<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Result<T, Problem> {
    let failed = |_| Problem::new(StatusCode::INTERNAL_SERVER_ERROR, "the recordings could not be read");
    tokio::task::spawn_blocking(work).await.map_err(failed)
}

fn parse(id: Result<Path<String>, PathRejection>) -> Result<Id, Problem> {
    let Path(id) = id.map_err(|rejection| Problem::new(rejection.status(), rejection.body_text()))?;
    id.parse().map_err(|expected: String| Problem::new(StatusCode::BAD_REQUEST, expected))
}

fn no_such_recording(id: &Id) -> Problem {
    Problem::new(
        StatusCode::NOT_FOUND,
        format!("there is no recording `{id}`; `/api/v1/recordings` lists what there is"),
    )
}

fn unreadable(cause: &io::Error) -> Problem {
    Problem::new(StatusCode::SERVICE_UNAVAILABLE, format!("the recordings cannot be read: {cause}"))
}
