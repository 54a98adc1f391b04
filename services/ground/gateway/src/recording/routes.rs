//! Recorded missions over HTTP: the list, one in short, and the file itself.

use std::io;
use std::sync::Arc;

use axum::Extension;
use axum::extract::rejection::PathRejection;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode};
use kittiwake_proto::v1;
use prost::Name;

use crate::http::answer::Answer;
use crate::http::guard::AuthorizedRequest;
use crate::http::problem::Problem;
use crate::http::routes::{READERS, Reply, Route, Routes};
use crate::http::site::Site;
use crate::recording::Recordings;
use crate::recording::download::{self, MEDIA_TYPE};
use crate::recording::id::RecordingId;
use crate::recording::index::RecordingIndex;
use crate::shares::{Share, Shares};

/// Downloads at a time: each holds a file open until its client has it.
const MAX_DOWNLOADS: usize = 16;
/// Lists and recordings that are read at a time, those included that wait for a thread.
const MAX_READINGS: usize = 16;

/// The name in a path, which may not decode.
type Id = Result<Path<String>, PathRejection>;

/// Adds the routes; a token may have `per_token` downloads at a time, and as many recordings read.
pub(crate) fn add_to(routes: Routes, per_token: usize) -> Routes {
    let downloads = Shares::new(MAX_DOWNLOADS, per_token);
    let readings = Shares::new(MAX_READINGS, per_token);
    let of_list = readings.clone();
    let list_of = Reply::Document(v1::RecordingList::NAME);
    let one = Reply::Document(v1::Recording::NAME);
    routes
        .add(
            Route::read("/api/v1/recordings", READERS, "Recorded missions, newest first", list_of),
            move |site: State<Site>, request: Extension<AuthorizedRequest>| list(site, request, of_list.clone()),
        )
        .add(
            Route::read(
                "/api/v1/recordings/{recording}",
                READERS,
                "A recorded mission: what was to be done, what was decided and how it ended",
                one,
            ),
            move |site: State<Site>, request: Extension<AuthorizedRequest>, id: Id| {
                recording(site, request, id, readings.clone())
            },
        )
        .add(
            Route::read(
                "/api/v1/recordings/{recording}/file",
                READERS,
                "The recording itself, for Foxglove and other readers of MCAP",
                Reply::Media(MEDIA_TYPE),
            ),
            move |site: State<Site>, request: Extension<AuthorizedRequest>, id: Id, headers: HeaderMap| {
                file(site, request, id, headers, downloads.clone())
            },
        )
}

impl Recordings {
    /// `ok`, `off` or `failing`.
    pub(crate) fn state(&self) -> &'static str {
        match &self.writer {
            None => "off",
            Some(writer) if writer.problem().is_some() => "failing",
            Some(_) => "ok",
        }
    }

    fn index(&self) -> Result<Arc<RecordingIndex>, Problem> {
        self.index.clone().ok_or_else(|| {
            Problem::new(StatusCode::NOT_FOUND, "missions are not recorded; `--recordings DIR` names a folder")
        })
    }
}

async fn list(
    State(site): State<Site>,
    Extension(request): Extension<AuthorizedRequest>,
    readings: Arc<Shares>,
) -> Answer {
    let Recordings { writer, index } = &site.api.recordings;
    let (recordings, share) = match index.clone() {
        None => (Vec::new(), None),
        Some(index) => {
            let share = share_of(&readings, &request, "readings of recordings")?;
            let (listed, share) = unblocked(share, move || index.list()).await?;
            (listed.map_err(|cause| unreadable(&cause))?, Some(share))
        }
    };
    let dropped = writer.as_ref().map_or(0, |writer| writer.dropped());
    let list = v1::RecordingList {
        folder: index.as_ref().map(|index| index.folder.display().to_string()),
        state: site.api.recordings.state().to_owned(),
        problem: writer.as_ref().and_then(|writer| writer.problem()),
        dropped: u32::try_from(dropped).unwrap_or(u32::MAX),
        recordings,
    };
    site.api.documents.make(&request.who, in_memory(list, share)).await
}

async fn recording(
    State(site): State<Site>,
    Extension(request): Extension<AuthorizedRequest>,
    id: Id,
    readings: Arc<Shares>,
) -> Answer {
    let (id, index) = (parse(id)?, site.api.recordings.index()?);
    let share = share_of(&readings, &request, "readings of recordings")?;
    let name = id.clone();
    let (found, share) = unblocked(share, move || index.recording(&id)).await?;
    let recording = found.ok_or_else(|| no_such_recording(&name))?;
    site.api.documents.make(&request.who, in_memory(recording, Some(share))).await
}

/// A message that was read and waits for its turn. It has the share until then: else a client could have any number of them in memory.
fn in_memory<M>(message: M, share: Option<Share>) -> impl FnOnce() -> Result<M, Problem> {
    move || {
        drop(share);
        Ok(message)
    }
}

async fn file(
    State(site): State<Site>,
    Extension(request): Extension<AuthorizedRequest>,
    id: Id,
    headers: HeaderMap,
    downloads: Arc<Shares>,
) -> Answer {
    let (id, index) = (parse(id)?, site.api.recordings.index()?);
    let share = share_of(&downloads, &request, "downloads")?;
    let name = id.clone();
    let (found, share) = unblocked(share, move || index.file(&id)).await?;
    let (file, bytes) = found.map_err(|cause| match cause.kind() {
        io::ErrorKind::NotFound => no_such_recording(&name),
        _ => unreadable(&cause),
    })?;
    Ok(download::answer(file, bytes, &name.file_name(), &headers, share))
}

fn share_of(shares: &Arc<Shares>, request: &AuthorizedRequest, what: &str) -> Result<Share, Problem> {
    shares.take_for(&request.who).map_err(|taken| taken.problem(what))
}

/// Work that waits for a disk is done beside the threads that answer. It has the share for as long as it waits and works: a client
/// that leaves, or whose request takes too long, does not end it, so that more would be waiting than there are shares.
async fn unblocked<T: Send + 'static>(
    share: Share,
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<(T, Share), Problem> {
    let failed = |_| Problem::new(StatusCode::INTERNAL_SERVER_ERROR, "the recordings could not be read");
    tokio::task::spawn_blocking(move || (work(), share)).await.map_err(failed)
}

fn parse(id: Id) -> Result<RecordingId, Problem> {
    let Path(id) = id.map_err(|rejection| Problem::new(rejection.status(), rejection.body_text()))?;
    id.parse().map_err(|expected: String| Problem::new(StatusCode::BAD_REQUEST, expected))
}

fn no_such_recording(id: &RecordingId) -> Problem {
    Problem::new(StatusCode::NOT_FOUND, format!("there is no recording `{id}`; `/api/v1/recordings` lists them"))
}

fn unreadable(cause: &io::Error) -> Problem {
    Problem::unavailable(format!("the recordings cannot be read: {cause}"))
}
