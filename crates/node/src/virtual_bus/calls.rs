//! Calls that have not ended.

use domain::time::Time;
use kittiwake_proto::topics::Request;

use super::queue::Index;
use crate::{CallError, CallId, Token, VehicleId};

/// A call that has not ended.
pub(super) struct OpenCall {
    pub(super) caller: Index,
    pub(super) id: CallId,
    /// When it ends at the latest.
    pub(super) until: Time,
    pub(super) vehicle: VehicleId,
    pub(super) request: Request,
    pub(super) progress: Progress,
}

/// How far a call is.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Progress {
    /// No node serves it; one that appears before the deadline gets it.
    Unserved,
    /// The node at the index has it, or it is under way there.
    Asked(Index, Token),
    /// Its reply arrives after the deadline.
    AnsweredLate,
}

/// All open calls, in the order in which they were made.
#[derive(Default)]
pub(super) struct Calls(Vec<OpenCall>);

impl Calls {
    pub(super) fn open(&mut self, call: OpenCall) {
        self.0.push(call);
    }

    /// The earliest deadline.
    pub(super) fn deadline(&self) -> Option<Time> {
        self.0.iter().map(|it| it.until).min()
    }

    /// Calls that wait for a node to serve them.
    pub(super) fn unserved(&mut self) -> impl Iterator<Item = &mut OpenCall> {
        self.0.iter_mut().filter(|it| it.progress == Progress::Unserved)
    }

    /// The call whose request has this token.
    pub(super) fn asked(&mut self, token: Token) -> Option<&mut OpenCall> {
        self.0.iter_mut().find(|it| matches!(it.progress, Progress::Asked(_, asked) if asked == token))
    }

    /// Ends a call.
    pub(super) fn close(&mut self, caller: Index, id: CallId) {
        self.0.retain(|it| (it.caller, it.id) != (caller, id));
    }

    /// Ends the calls whose deadline has come.
    pub(super) fn expire(&mut self, now: Time) -> Vec<(Index, CallId, CallError)> {
        let expired = self.0.extract_if(.., |it| it.until <= now);
        let error = |progress| match progress {
            Progress::Unserved => CallError::Unavailable,
            Progress::Asked(..) | Progress::AnsweredLate => CallError::Unanswered,
        };
        expired.map(|it| (it.caller, it.id, error(it.progress))).collect()
    }

    /// `node` has ended: its calls end with it, and what it was asked waits for another node.
    pub(super) fn drop_node(&mut self, node: Index) {
        self.0.retain(|it| it.caller != node);
        for call in &mut self.0 {
            if matches!(call.progress, Progress::Asked(server, _) if server == node) {
                call.progress = Progress::Unserved;
            }
        }
    }
}
