//! The latest status changes of a tree.

use std::collections::VecDeque;
use std::time::Duration;

use crate::node_id::NodeId;
use crate::status::NodeStatus;

/// A node's status changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StatusChange {
    /// The time of the tick.
    pub at: Duration,
    /// What the stamp function of [`Tree::record_changes`](crate::Tree::record_changes) returned at the moment of the
    /// change.
    pub stamp: u64,
    /// The node.
    pub node: NodeId,
    /// Its status before.
    pub from: NodeStatus,
    /// Its status after.
    pub to: NodeStatus,
}

/// A queue of fixed size: recording never allocates, and the newest changes displace the oldest.
pub(crate) struct ChangeRecorder {
    changes: VecDeque<StatusChange>,
    capacity: usize,
    /// For each node whether it is recorded.
    watched: Vec<bool>,
    stamp: fn() -> u64,
    /// Changes displaced since the last [`ChangeRecorder::drain`].
    lost: u64,
}

impl ChangeRecorder {
    pub(crate) fn new(capacity: usize, watched: Vec<bool>, stamp: fn() -> u64) -> Self {
        let capacity = capacity.max(1);
        ChangeRecorder { changes: VecDeque::with_capacity(capacity), capacity, watched, stamp, lost: 0 }
    }

    /// Records a change at `now`, in nanoseconds.
    pub(crate) fn push(&mut self, now: u64, node: NodeId, from: NodeStatus, to: NodeStatus) {
        if !self.watched[node.index()] {
            return;
        }
        if self.changes.len() == self.capacity {
            self.changes.pop_front();
            self.lost += 1;
        }
        let (at, stamp) = (Duration::from_nanos(now), (self.stamp)());
        self.changes.push_back(StatusChange { at, stamp, node, from, to });
    }

    /// Passes all changes to `take`, oldest first. Returns how many were displaced.
    pub(crate) fn drain(&mut self, take: impl FnMut(StatusChange)) -> u64 {
        self.changes.drain(..).for_each(take);
        std::mem::take(&mut self.lost)
    }
}
