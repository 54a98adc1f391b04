//! Which node decided that a tree failed, and why nodes failed.

use std::time::Duration;

use super::cause::{Cause, FailureRecord};
use crate::node_id::NodeId;

/// The failures of one tree.
#[derive(Default)]
pub(crate) struct Failures {
    /// The reason of every node that gave one when it failed last. Empty until the first such failure, because most
    /// instances never fail.
    records: Vec<Option<FailureRecord>>,
    /// The node that decided the latest failure. A parent that goes on after a child's failure remembers it itself.
    decider: usize,
    /// The node that decided the latest tick, if that tick failed.
    of_tick: Option<NodeId>,
}

impl Failures {
    /// A node fails by its own decision, not because a child failed.
    #[inline]
    pub(crate) fn decide(&mut self, node: usize) {
        self.decider = node;
    }

    #[inline]
    pub(crate) fn decider(&self) -> usize {
        self.decider
    }

    /// Records why a node of a tree with `nodes` nodes fails at `now`, in nanoseconds.
    pub(crate) fn explain(&mut self, node: usize, nodes: usize, now: u64, cause: Cause) {
        if self.records.is_empty() {
            self.records.resize(nodes, None);
        }
        self.records[node] = Some(FailureRecord { at: Duration::from_nanos(now), cause });
    }

    // Called for every node of every tick.
    #[inline]
    pub(crate) fn forget(&mut self, node: usize) {
        if let Some(record @ Some(_)) = self.records.get_mut(node) {
            *record = None;
        }
    }

    pub(crate) fn end_tick(&mut self, has_failed: bool) {
        self.of_tick = has_failed.then(|| NodeId::new(self.decider));
    }

    pub(crate) fn of_tick(&self) -> Option<NodeId> {
        self.of_tick
    }

    pub(crate) fn why(&self, node: NodeId) -> Option<&FailureRecord> {
        self.records.get(node.index())?.as_ref()
    }
}
