//! The memory of answers that their clients have not read: so much for each holder of a token, and so much for all.
//!
//! An answer is in memory until the system has taken its last byte, and a client that reads a byte now and then keeps it there for
//! as long as it likes, on each of its connections. Every answer passes [`within_memory`]. Exempt are
//! - streams (events, downloads), which have no length and hold little at a time;
//! - texts that all clients share (the page, the description of the routes), of which there is one copy;
//! - answers to orders: they say what was done, so none is withheld. Nobody who only watches gets one.

use std::sync::Arc;

use axum::body::{Body, Bytes, HttpBody as _, to_bytes};
use axum::extract::{Request, State};
use axum::http::StatusCode;
use axum::http::header::RETRY_AFTER;
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::access::Identity;
use crate::http::is_order;
use crate::http::problem::Problem;
use crate::http::site::Site;
use crate::shares::{Holder, Share, Shares, Taken};

/// Bytes of all unread answers: a twelfth of what the gateway may have (`deploy/kittiwake@gateway.service.d`). One part in sixteen is reserved for
/// those who may order.
const TOTAL: usize = 20 * MB;
/// Bytes of one token's, or of all clients' together that have none. (ENG: ten tracks of half an hour; a page asks for one at a time.)
const EACH: usize = 8 * MB;
/// Answers up to this size are not counted, so that a status is never refused: a connection has buffers of that size anyway.
const FREE: u64 = 16 * 1024;
const MB: usize = 1024 * 1024;

/// Who has no token, in the place of a name.
const STRANGERS: &str = "clients without a token";

/// What is left of the memory.
#[derive(Debug, Clone)]
pub(crate) struct AnswerMemory(Arc<Shares>);

/// The bytes of an answer, with the share of memory that they take. It is given back when the last of them is dropped, which is later
/// than the end of the body: that has ended once they wait to be sent.
struct Counted {
    bytes: Bytes,
    _share: Share,
}

impl AsRef<[u8]> for Counted {
    fn as_ref(&self) -> &[u8] {
        &self.bytes
    }
}

impl Default for AnswerMemory {
    fn default() -> AnswerMemory {
        AnswerMemory(Shares::new(TOTAL, EACH))
    }
}

/// Answers, unless too many answers are unread. Whose an answer is stands in its extensions, where `guard` has put the [`Identity`].
pub(crate) async fn within_memory(State(site): State<Site>, request: Request, next: Next) -> Response {
    let is_order = is_order(request.method());
    let response = next.run(request).await;
    if is_order {
        return response;
    }
    site.memory.hold(response).await.unwrap_or_else(IntoResponse::into_response)
}

impl AnswerMemory {
    async fn hold(&self, response: Response) -> Result<Response, Problem> {
        let is_large = response.body().size_hint().exact().is_some_and(|bytes| FREE < bytes);
        if !is_large {
            return Ok(response);
        }
        let (head, body) = response.into_parts();
        // It is whole and in memory.
        let bytes = to_bytes(body, usize::MAX).await.unwrap_or_default();
        if !bytes.is_unique() {
            return Ok(Response::from_parts(head, Body::from(bytes)));
        }
        let (who, may_order) = match head.extensions.get::<Identity>() {
            Some(who) => (who.into(), who.may_order()),
            None => (Holder::without_token(STRANGERS), false),
        };
        // One that is larger than what one holder may have comes alone.
        let share = self.0.take_several(bytes.len().min(EACH), &who, may_order).map_err(refused)?;
        Ok(Response::from_parts(head, Body::from(Bytes::from_owner(Counted { bytes, _share: share }))))
    }
}

fn refused(taken: Taken) -> Problem {
    let problem = match taken {
        Taken::TooManyOfOne(who, each) => {
            let most = each / MB;
            let detail =
                format!("up to {most} MB of answers may wait for {who}; read them, or close their connections");
            Problem::new(StatusCode::TOO_MANY_REQUESTS, detail)
        }
        Taken::All(_) | Taken::AllForWatchers(_) => {
            Problem::unavailable("too many answers wait for clients that do not read them; try again")
        }
    };
    problem.with_header(RETRY_AFTER, "1")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::access::{Role, Tokens, entry};
    use domain::file::Source;

    fn identity(name: &str, role: Role) -> Identity {
        let source = Source { path: "tokens".into(), text: entry(name, &[role], name) };
        Tokens::parse(&source).unwrap().identify(name, 0).unwrap().clone()
    }

    fn answer(bytes: usize, who: Option<&Identity>) -> Response {
        let mut response = Response::new(Body::from(vec![b'x'; bytes]));
        who.cloned().map(|it| response.extensions_mut().insert(it));
        response
    }

    /// What of `memory` is left for an operator, in whole megabytes.
    #[track_caller]
    fn check(memory: &AnswerMemory, expected_mb: usize) {
        let of_others: Vec<Holder> = (0..3).map(|it| Holder::without_token(&format!("other {it}"))).collect();
        let one = |number: usize| memory.0.take_several(MB, &of_others[number / 7], true).ok();
        let left: Vec<Share> = (0..20).map_while(one).collect();
        assert_eq!(left.len(), expected_mb);
    }

    #[tokio::test]
    async fn unread_answers_are_counted_until_their_last_byte_is_gone() {
        let (memory, eve) = (AnswerMemory::default(), identity("eve", Role::Observer));
        let body = memory.hold(answer(3 * MB, Some(&eve))).await.unwrap().into_body();
        // What waits to be sent has left the body.
        let mut bytes = to_bytes(body, usize::MAX).await.unwrap();
        assert_eq!(bytes.len(), 3 * MB);
        check(&memory, 17);
        let last = bytes.split_off(3 * MB - 1);
        drop(bytes);
        check(&memory, 17);
        drop(last);
        check(&memory, 20);
    }

    #[tokio::test]
    async fn one_token_leaves_memory_to_others_and_those_who_watch_leave_some_to_those_who_may_order() {
        let (memory, anna) = (AnswerMemory::default(), identity("anna", Role::Operator));
        let watchers = ["eve", "ben", "tim"].map(|it| identity(it, Role::Observer));
        let [eve, ben, tim] = &watchers;
        let hold = async |megabytes: usize, who| memory.hold(answer(megabytes * MB, who)).await;
        // One that is too large for its holder comes alone.
        let first = hold(9, Some(eve)).await.unwrap();
        let refusal = hold(1, Some(eve)).await.unwrap_err();
        assert_eq!(refusal.detail(), "up to 8 MB of answers may wait for eve; read them, or close their connections");
        assert_eq!(refusal.into_response().status(), StatusCode::TOO_MANY_REQUESTS);
        let _second = hold(8, Some(ben)).await.unwrap();
        let _third = hold(2, None).await.unwrap();
        let refusal = hold(1, Some(tim)).await.unwrap_err();
        assert_eq!(refusal.into_response().status(), StatusCode::SERVICE_UNAVAILABLE);
        hold(1, Some(&anna)).await.unwrap();
        drop(first);
        hold(1, Some(tim)).await.unwrap();
        hold(7, None).await.unwrap_err();
    }

    #[tokio::test]
    async fn small_answers_shared_texts_and_streams_are_free() {
        let (memory, eve) = (AnswerMemory::default(), identity("eve", Role::Observer));
        let shared = Bytes::from(vec![b'x'; 8 * MB]);
        static PAGE: [u8; FREE as usize + 1] = [b'x'; FREE as usize + 1];
        let stream = futures_util::stream::pending::<Result<Bytes, std::convert::Infallible>>();
        let bodies = [
            Body::from(vec![b'x'; FREE as usize]),
            Body::from(shared.clone()),
            Body::from(&PAGE[..]),
            Body::from_stream(stream),
        ];
        let mut held = Vec::new();
        for body in bodies {
            let mut response = Response::new(body);
            response.extensions_mut().insert(eve.clone());
            held.push(memory.hold(response).await.unwrap());
        }
        check(&memory, 20);
    }
}
