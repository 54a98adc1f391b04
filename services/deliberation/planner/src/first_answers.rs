//! The first answer to each request, for requests that are repeated.

use std::collections::VecDeque;

/// The answers to the last requests, by request id.
#[derive(Debug)]
pub(crate) struct FirstAnswers<R> {
    newest_last: VecDeque<(String, R)>,
}

impl<R> Default for FirstAnswers<R> {
    fn default() -> FirstAnswers<R> {
        FirstAnswers { newest_last: VecDeque::new() }
    }
}

impl<R> FirstAnswers<R> {
    /// Most answers to remember: a request is repeated within seconds, long before as many new ones.
    const REMEMBERED: usize = 64;

    /// The answer that `request_id` was given.
    pub(crate) fn get(&self, request_id: &str) -> Option<&R> {
        self.newest_last.iter().find(|(id, _)| id == request_id).map(|(_, reply)| reply)
    }

    /// Remembers the answer to `request_id`; one without an id cannot be repeated.
    pub(crate) fn remember(&mut self, request_id: String, reply: R) {
        if request_id.is_empty() {
            return;
        }
        if self.newest_last.len() == Self::REMEMBERED {
            self.newest_last.pop_front();
        }
        self.newest_last.push_back((request_id, reply));
    }
}
