//! A recording as a download: the whole file, or the part that is missing after a download broke off.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::RangeInclusive;

use axum::body::{Body, Bytes};
use axum::http::header::{
    ACCEPT_RANGES, CACHE_CONTROL, CONTENT_DISPOSITION, CONTENT_LENGTH, CONTENT_RANGE, CONTENT_TYPE, IF_RANGE, RANGE,
    X_CONTENT_TYPE_OPTIONS,
};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use futures_util::Stream;
use http_range_header::parse_range_header;

use crate::http::problem::Problem;

/// The media type that is registered for MCAP.
pub(crate) const MEDIA_TYPE: &str = "application/vnd.mcap";
/// Bytes read at a time.
const PIECE: usize = 64 * 1024;

/// What is sent of a file.
#[derive(Debug, PartialEq)]
enum Part {
    Whole,
    /// From byte to byte, inclusive.
    Only(RangeInclusive<u64>),
    /// Nothing: the file is shorter.
    Beyond,
}

impl Part {
    /// The part of a file of `bytes` that `headers` request (RFC 9110, section 14). As the RFC allows, the answer to a
    /// range that is not understood, and to several ranges at once, is the whole file. So is the answer to a range
    /// under `If-Range`, because the file has no tag that shows whether it has changed.
    fn requested(headers: &HeaderMap, bytes: u64) -> Part {
        let range = headers.get(RANGE).filter(|_| !headers.contains_key(IF_RANGE));
        let Some(Ok(ranges)) = range.and_then(|it| it.to_str().ok()).map(parse_range_header) else {
            return Part::Whole;
        };
        match ranges.validate(bytes).as_deref() {
            Ok([range]) => Part::Only(range.clone()),
            Ok(_) => Part::Whole,
            Err(_) => Part::Beyond,
        }
    }
}

/// The answer to a request for `file`, which has `bytes` now and may be growing. `permit` is held until the client has
/// all of the answer.
pub(crate) fn answer(file: File, bytes: u64, name: &str, headers: &HeaderMap, permit: impl Send + 'static) -> Response {
    let (status, range, content_range) = match Part::requested(headers, bytes) {
        Part::Whole => (StatusCode::OK, 0..bytes, None),
        Part::Only(it) => {
            let content_range = format!("bytes {}-{}/{bytes}", it.start(), it.end());
            (StatusCode::PARTIAL_CONTENT, *it.start()..it.end() + 1, Some(content_range))
        }
        Part::Beyond => {
            let problem = Problem::new(StatusCode::RANGE_NOT_SATISFIABLE, format!("the recording has {bytes} bytes"));
            return ([(CONTENT_RANGE, format!("bytes */{bytes}"))], problem).into_response();
        }
    };
    let headers = [
        (CONTENT_TYPE, MEDIA_TYPE.to_owned()),
        (CONTENT_LENGTH, (range.end - range.start).to_string()),
        (CONTENT_DISPOSITION, format!("attachment; filename=\"{name}\"")),
        (ACCEPT_RANGES, "bytes".to_owned()),
        (CACHE_CONTROL, "no-store".to_owned()),
        (X_CONTENT_TYPE_OPTIONS, "nosniff".to_owned()),
    ];
    let content_range = content_range.map(|it| [(CONTENT_RANGE, it)]);
    (status, headers, content_range, Body::from_stream(pieces(file, range, permit))).into_response()
}

/// A range of a file, piece by piece; nothing is read ahead of what the client takes.
fn pieces(
    file: File,
    range: std::ops::Range<u64>,
    permit: impl Send + 'static,
) -> impl Stream<Item = io::Result<Bytes>> {
    futures_util::stream::try_unfold((file, range, permit), |(file, range, permit)| async move {
        // With the permit: a client that leaves does not end what waits for a thread.
        let read = move || {
            let mut file = file;
            file.seek(SeekFrom::Start(range.start))?;
            let mut piece = Vec::new();
            let length = file.by_ref().take((range.end - range.start).min(PIECE as u64)).read_to_end(&mut piece)?;
            Ok::<_, io::Error>((piece, file, range.start + length as u64..range.end, permit))
        };
        let (piece, file, rest, permit) = tokio::task::spawn_blocking(read).await.map_err(io::Error::other)??;
        Ok((!piece.is_empty()).then_some((Bytes::from(piece), (file, rest, permit))))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_is_answered_and_an_invalid_one_is_ignored() {
        #[track_caller]
        fn check(range: &str, expected: Part) {
            let headers = HeaderMap::from_iter([(RANGE, range.parse().unwrap())]);
            assert_eq!(Part::requested(&headers, 1000), expected, "{range}");
        }
        check("bytes=0-99", Part::Only(0..=99));
        check("bytes=990-", Part::Only(990..=999));
        check("bytes=-10", Part::Only(990..=999));
        check("bytes=900-5000", Part::Only(900..=999));
        check("bytes=1000-", Part::Beyond);
        check("bytes=0-1,5-6", Part::Whole);
        check("bytes=9-1", Part::Beyond);
        check("lines=1-2", Part::Whole);
        check("bytes=", Part::Whole);
        check("bytes=x-y", Part::Whole);
    }

    #[test]
    fn no_file_counts_as_unchanged() {
        let headers = [(RANGE, "bytes=5-9"), (IF_RANGE, "\"1\"")].map(|(name, it)| (name, it.parse().unwrap()));
        assert_eq!(Part::requested(&HeaderMap::from_iter(headers), 1000), Part::Whole);
    }
}
