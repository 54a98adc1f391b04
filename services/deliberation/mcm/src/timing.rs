//! When the leaves of the tree changed their status, for measurements. Decides nothing.
//!
//! The engine stamps each change as it happens, so that no leaf knows about measurements. The reader finds the meaning
//! of a change in the names of the nodes. Control nodes are left out, since their statuses follow from those of the
//! leaves, and so are the trees that leaves hold, since no figure needs them.

use behavior_tree::{NodeStatus, NodeView, StatusChange, Tree};
use kittiwake_proto::v1;

/// Durations of 2^31 ns, two seconds, and more share the last element of the histogram.
const BUCKETS: usize = 32;
/// Most status changes stored during a wake. The answer to a flag takes about a hundred.
const CAPACITY: usize = 512;

/// Watches one tree.
pub(crate) struct Timing {
    now_ns: fn() -> u64,
    /// By index in preorder; `None` for nodes that are not leaves.
    leaves: Vec<Option<Leaf>>,
    woken_ns: Option<u64>,
    ticked_ns: u64,
    ticks: [u64; BUCKETS],
    /// The changes of one wake; most wakes need no record.
    changes: Vec<StatusChange>,
}

/// A leaf as the record names it.
struct Leaf {
    kind: String,
    path: String,
}

impl Timing {
    /// Watches `tree` from now on. `now_ns` reads nanoseconds of any one clock.
    pub(crate) fn of<World>(tree: &mut Tree<World>, now_ns: fn() -> u64) -> Timing {
        let is_leaf = |node: &NodeView<'_>| tree.children(node.id).next().is_none();
        let leaf = |node: NodeView<'_>| Leaf { kind: node.tag.to_owned(), path: path(tree, node) };
        let leaves: Vec<Option<Leaf>> = tree.nodes().map(|node| is_leaf(&node).then(|| leaf(node))).collect();
        tree.record_changes_of(|node| leaves[node.index()].is_some(), CAPACITY, now_ns);
        let changes = Vec::with_capacity(CAPACITY);
        Timing { now_ns, leaves, woken_ns: None, ticked_ns: 0, ticks: [0; BUCKETS], changes }
    }

    /// Watches `tree` in place of the one before.
    pub(crate) fn follow<World>(&mut self, tree: &mut Tree<World>) {
        let Timing { woken_ns, ticked_ns, ticks, .. } = *self;
        *self = Timing { woken_ns, ticked_ns, ticks, ..Timing::of(tree, self.now_ns) };
    }

    /// A message was taken in, or a deadline has come. The first call since the last record begins a wake.
    pub(crate) fn wake(&mut self) {
        self.woken_ns.get_or_insert_with(self.now_ns);
    }

    pub(crate) fn tick_begins(&mut self) {
        self.ticked_ns = (self.now_ns)();
    }

    /// The tree has been ticked. Returns how long that took, in nanoseconds.
    pub(crate) fn tick_ended(&mut self) -> u64 {
        let took_ns = (self.now_ns)().saturating_sub(self.ticked_ns);
        let bucket = took_ns.checked_ilog2().unwrap_or(0) as usize;
        self.ticks[bucket.min(BUCKETS - 1)] += 1;
        took_ns
    }

    /// Ends the wake. Returns its record if a leaf of `tree` began or ceased to run: conditions change at every tick,
    /// which is not worth a record.
    pub(crate) fn end_wake<World>(&mut self, tree: &mut Tree<World>) -> Option<v1::McmTiming> {
        let decided_ns = (self.now_ns)();
        let woken_ns = self.woken_ns.take().unwrap_or(decided_ns);
        self.changes.clear();
        let lost_changes = tree.take_changes(|change| self.changes.push(change));
        if !self.changes.iter().any(|change| [change.from, change.to].contains(&NodeStatus::Running)) {
            return None;
        }
        Some(v1::McmTiming {
            woken_ns,
            ticked_ns: self.ticked_ns,
            decided_ns,
            changes: self.changes.iter().filter_map(|change| self.to_wire(change)).collect(),
            lost_changes,
            tick_histogram: self.ticks.to_vec(),
        })
    }

    fn to_wire(&self, change: &StatusChange) -> Option<v1::LeafChange> {
        let leaf = self.leaves.get(change.node.index())?.as_ref()?;
        Some(v1::LeafChange {
            kind: leaf.kind.clone(),
            path: leaf.path.clone(),
            before: status(change.from) as i32,
            after: status(change.to) as i32,
            at_ns: change.stamp,
        })
    }
}

/// The names from the root to `node`.
fn path<World>(tree: &Tree<World>, node: NodeView<'_>) -> String {
    match node.parent.and_then(|parent| tree.node(parent)) {
        Some(parent) => path(tree, parent) + "/" + node.name,
        None => node.name.to_owned(),
    }
}

fn status(status: NodeStatus) -> v1::NodeStatus {
    match status {
        NodeStatus::Idle => v1::NodeStatus::Idle,
        NodeStatus::Running => v1::NodeStatus::Running,
        NodeStatus::Success => v1::NodeStatus::Success,
        NodeStatus::Failure => v1::NodeStatus::Failure,
    }
}
