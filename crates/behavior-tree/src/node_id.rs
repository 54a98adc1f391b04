//! Which node of a tree.

/// A node of one tree: its place in preorder. The root is 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeId(u32);

impl NodeId {
    pub(crate) const ROOT: NodeId = NodeId(0);

    /// Trees have fewer nodes than `u32` has values, see `MAX_NODES` of the loader.
    pub(crate) const fn new(index: usize) -> Self {
        NodeId(index as u32)
    }

    /// The place in preorder, which is the node's index in [`Tree::statuses`](crate::Tree::statuses).
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}
