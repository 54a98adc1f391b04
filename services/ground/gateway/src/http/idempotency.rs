//! An order that is repeated under the same key gets the answer that is kept for it, and is not carried out again. Only the newest final
//! answers are kept: `openapi` tells clients what else is sent again, and who recognises the key then.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard};

use axum::body::{Body, Bytes, to_bytes};
use axum::http::header::CONTENT_TYPE;
use axum::http::{HeaderMap, HeaderValue, StatusCode};
use axum::response::{IntoResponse, Response};
use node::Answers;
use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::http::problem::{Kind, Problem};
use crate::http::routes::Route;
use crate::http::target::Target;

/// The most answers kept: far more than are requested again within a minute.
const CAPACITY: usize = 512;
/// An answer with more bytes is kept among the large ones, so that it takes no room from the others. Most have some hundred, also what is
/// decided about a permission, whose key nobody else recognises; one with the state of a large mission has a megabyte.
const LARGE: usize = 16 * 1024;
/// The most large ones.
const LARGE_CAPACITY: usize = 8;
/// The longest key, in bytes.
const MAX_KEY: usize = 64;

/// Names an order among those of all operators: who gives it, and the key they chose.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct RequestId {
    who: Arc<str>,
    key: String,
}

impl RequestId {
    /// From the header `Idempotency-Key`.
    pub(crate) fn read(who: &Arc<str>, headers: &HeaderMap) -> Result<RequestId, Problem> {
        let key = headers.get("idempotency-key").and_then(|it| it.to_str().ok()).map(str::trim);
        let key = key.filter(|it| !it.is_empty() && it.len() <= MAX_KEY).ok_or_else(|| {
            let detail = format!("the header Idempotency-Key is missing, or not 1 to {MAX_KEY} characters long");
            Problem::new(StatusCode::BAD_REQUEST, detail)
        })?;
        Ok(RequestId { who: who.clone(), key: key.to_owned() })
    }

    /// The client's own key.
    pub(crate) fn key(&self) -> &str {
        &self.key
    }
}

/// The id as the services receive it. A `:` in a name is escaped, so that no two ids have the same text.
impl fmt::Display for RequestId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.who.replace('%', "%25").replace(':', "%3A"), self.key)
    }
}

/// The content of an order as a hash. A key that is used again with another fingerprint is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Fingerprint([u8; 32]);

impl Fingerprint {
    /// The fingerprint of an order.
    pub(crate) fn of(route: &Route, target: &Target, body: &Value) -> Fingerprint {
        let text = format!("{:?} {} {:?} {body}", route.method, route.path, target.parameters);
        Fingerprint(Sha256::digest(text.as_bytes()).into())
    }
}

/// The newest answers.
#[derive(Default)]
pub(crate) struct AnswerCache(Mutex<Newest>);

#[derive(Default)]
struct Newest {
    small: Answers<CachedAnswer, RequestId, CAPACITY>,
    large: Answers<CachedAnswer, RequestId, LARGE_CAPACITY>,
}

struct CachedAnswer {
    fingerprint: Fingerprint,
    status: StatusCode,
    media_type: HeaderValue,
    body: Bytes,
}

impl AnswerCache {
    /// The answer that was given under this id.
    pub(crate) fn get(&self, id: &RequestId, fingerprint: Fingerprint) -> Option<Response> {
        let newest = self.lock();
        let known = newest.small.get(id).or_else(|| newest.large.get(id))?;
        if known.fingerprint != fingerprint {
            let detail = "the key was used for another request";
            let problem = Problem::new(StatusCode::UNPROCESSABLE_ENTITY, detail).of(Kind::KeyReused);
            return Some(problem.into_response());
        }
        Some((known.status, [(CONTENT_TYPE, known.media_type.clone())], known.body.clone()).into_response())
    }

    /// Keeps an answer if a repetition of the order would get the same one, and returns it.
    pub(crate) async fn keep(&self, id: RequestId, fingerprint: Fingerprint, response: Response) -> Response {
        let status = response.status();
        let is_final = status.is_success() || matches!(status, StatusCode::CONFLICT | StatusCode::UNPROCESSABLE_ENTITY);
        if !is_final {
            return response;
        }
        let (head, body) = response.into_parts();
        // The handlers' bodies are whole and in memory.
        let body = to_bytes(body, usize::MAX).await.unwrap_or_default();
        let media_type =
            head.headers.get(CONTENT_TYPE).cloned().unwrap_or(HeaderValue::from_static("application/json"));
        let answer = CachedAnswer { fingerprint, status, media_type, body: body.clone() };
        let mut newest = self.lock();
        match body.len() <= LARGE {
            true => newest.small.remember(id, answer),
            false => newest.large.remember(id, answer),
        }
        drop(newest);
        Response::from_parts(head, Body::from(body))
    }

    /// The data are whole even if a thread panicked while it held the lock.
    fn lock(&self) -> MutexGuard<'_, Newest> {
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_operators_have_the_same_id() {
        let id = |who: &str, key: &str| RequestId { who: who.into(), key: key.into() }.to_string();
        assert_eq!(id("anna", "k1"), "anna:k1");
        assert_eq!(id("anna", "a:b"), "anna:a:b");
        assert_ne!(id("anna:a", "b"), id("anna", "a:b"));
        assert_ne!(id("anna:a", "b"), id("anna%3Aa", "b"));
    }

    #[tokio::test]
    async fn the_newest_answers_are_kept_and_large_ones_take_no_room_from_the_others() {
        let id = |n: usize| RequestId { who: "anna".into(), key: n.to_string() };
        let fingerprint = Fingerprint([0; 32]);
        // Which are kept of answers of these sizes.
        let check = async |sizes: &[usize], expected: Vec<usize>| {
            let cache = AnswerCache::default();
            for (n, size) in sizes.iter().enumerate() {
                let answer = cache.keep(id(n), fingerprint, Response::new(Body::from(vec![b'x'; *size]))).await;
                assert_eq!(to_bytes(answer.into_body(), usize::MAX).await.unwrap().len(), *size);
            }
            let kept: Vec<usize> = (0..sizes.len()).filter(|n| cache.get(&id(*n), fingerprint).is_some()).collect();
            assert_eq!(kept, expected, "of {} answers", sizes.len());
        };
        check(&[LARGE; CAPACITY], (0..CAPACITY).collect()).await;
        check(&[100; CAPACITY + 3], (3..CAPACITY + 3).collect()).await;
        check(&[LARGE + 1; LARGE_CAPACITY + 3], (3..LARGE_CAPACITY + 3).collect()).await;
        let large = [LARGE + 1; LARGE_CAPACITY];
        check(
            &[[100].as_slice(), &large, &[100], &large].concat(),
            [vec![0], (LARGE_CAPACITY + 1..2 * LARGE_CAPACITY + 2).collect()].concat(),
        )
        .await;
    }
}
