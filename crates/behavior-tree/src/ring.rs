//! The latest status changes of a tree.

use std::time::Duration;

use crate::status::NodeStatus;
use crate::tree::NodeId;

/// A node's status changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StatusChange {
    /// The time of the tick.
    pub at: Duration,
    /// The node.
    pub node: NodeId,
    /// Its status before.
    pub from: NodeStatus,
    /// Its status after.
    pub to: NodeStatus,
}

#[derive(Clone, Copy)]
struct Entry {
    at: u64,
    node: u32,
    from: NodeStatus,
    to: NodeStatus,
}

/// A ring of fixed size: recording never allocates, and the oldest entries give way to new ones.
pub(crate) struct StatusRing {
    entries: Vec<Entry>,
    capacity: usize,
    /// Changes recorded since the ring exists.
    written: u64,
    /// Of these, how many have been read.
    read: u64,
}

impl StatusRing {
    pub(crate) fn new(capacity: usize) -> Self {
        let capacity = capacity.max(1);
        StatusRing { entries: Vec::with_capacity(capacity), capacity, written: 0, read: 0 }
    }

    pub(crate) fn push(&mut self, at: u64, node: u32, from: NodeStatus, to: NodeStatus) {
        let entry = Entry { at, node, from, to };
        let place = (self.written % self.capacity as u64) as usize;
        if place < self.entries.len() {
            self.entries[place] = entry;
        } else {
            self.entries.push(entry);
        }
        self.written += 1;
    }

    /// Hands over what has not been read yet, oldest first; answers how many were overwritten before they were read.
    pub(crate) fn drain(&mut self, mut take: impl FnMut(StatusChange)) -> u64 {
        let oldest = self.written.saturating_sub(self.entries.len() as u64);
        let lost = oldest.saturating_sub(self.read);
        for number in self.read.max(oldest)..self.written {
            let entry = self.entries[(number % self.capacity as u64) as usize];
            take(StatusChange {
                at: Duration::from_nanos(entry.at),
                node: NodeId(entry.node),
                from: entry.from,
                to: entry.to,
            });
        }
        self.read = self.written;
        lost
    }
}
