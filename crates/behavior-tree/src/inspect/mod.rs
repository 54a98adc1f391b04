//! Observing a tree: what its nodes are, what they do, why they failed.

mod btlog;
mod text;
mod xml;

pub use btlog::BtlogWriter;

use crate::kind::Kind;
use crate::machine::Tree;
use crate::node_id::NodeId;
use crate::record::cause::FailureRecord;
use crate::shape::NONE;
use crate::status::NodeStatus;

/// One node of a tree, as an observer sees it.
#[derive(Clone, Copy, Debug)]
pub struct NodeView<'t> {
    /// Its place in preorder.
    pub id: NodeId,
    /// Its kind. For a `SubTree`, the `ID` of the included tree.
    pub tag: &'t str,
    /// Its `name` attribute, or its tag.
    pub name: &'t str,
    /// The names of the `SubTree` nodes on the way to it, such as `outer/inner`. Empty in the outermost tree.
    pub path: &'t str,
    /// Its parent. For the root of an included tree, the `SubTree` node that includes it.
    pub parent: Option<NodeId>,
    /// Its status.
    pub status: NodeStatus,
    /// Why it failed in its last tick, if a reason is known.
    pub why: Option<&'t FailureRecord>,
}

impl<Ctx> Tree<Ctx> {
    /// The `ID` of the tree this is an instance of.
    pub fn id(&self) -> &str {
        &self.shape.tree_id
    }

    /// The number of nodes.
    pub fn len(&self) -> usize {
        self.shape.nodes.len()
    }

    /// Always false: a tree has a root.
    pub fn is_empty(&self) -> bool {
        self.shape.nodes.is_empty()
    }

    /// The first node called `name`, in preorder.
    pub fn find(&self, name: &str) -> Option<NodeId> {
        (0..self.len()).find(|node| self.shape.name(*node) == name).map(NodeId::new)
    }

    /// A node's name: its `name` attribute, or its tag.
    pub fn name(&self, node: NodeId) -> &str {
        if node.index() < self.len() { self.shape.name(node.index()) } else { "" }
    }

    /// One node. `None` if `node` belongs to another tree.
    pub fn node(&self, node: NodeId) -> Option<NodeView<'_>> {
        let label = self.shape.labels.get(node.index())?;
        Some(NodeView {
            id: node,
            tag: self.shape.tag(node.index()),
            name: self.shape.name(node.index()),
            path: &self.shape.trees[label.tree as usize].path,
            parent: (label.parent != NONE).then_some(NodeId::new(label.parent as usize)),
            status: self.machine.status[node.index()],
            why: self.why(node),
        })
    }

    /// All nodes, in preorder. Those of a tree that a leaf holds are not among them, see [`Tree::held_by`].
    pub fn nodes(&self) -> impl Iterator<Item = NodeView<'_>> {
        (0..self.len()).filter_map(|index| self.node(NodeId::new(index)))
    }

    /// The children of a node, in order.
    pub fn children(&self, node: NodeId) -> impl Iterator<Item = NodeId> {
        let known = node.index() < self.len();
        let children = known.then(|| self.shape.children(node.index()));
        children.into_iter().flatten().map(NodeId::new)
    }

    /// Why a node failed in its last tick, if a reason is known: the condition, the value and the limit it gave with
    /// [`Ports::because`](crate::Ports::because), the expression that decided, the error that a leaf returned.
    pub fn why(&self, node: NodeId) -> Option<&FailureRecord> {
        self.machine.failures.why(node)
    }

    /// The node that decided the latest tick, if that tick failed, with its reason in [`NodeView::why`].
    ///
    /// This is the leaf whose failure all its parents passed on, or a node that failed by its own decision: a `Timeout`, an
    /// `Inverter`, a node with a `_failureIf`. A failure that a parent remembers, as `ParallelAll` does until all its
    /// children have finished, may be of an earlier tick, and so is its reason.
    pub fn last_failure(&self) -> Option<NodeView<'_>> {
        self.node(self.machine.failures.of_tick()?)
    }

    /// The tree that a leaf holds, see [`Leaf::subtree`](crate::Leaf::subtree).
    pub fn held_by(&self, node: NodeId) -> Option<&Tree<Ctx>> {
        match self.shape.nodes.get(node.index())?.kind {
            Kind::Leaf { leaf } => self.machine.leaves[leaf as usize].subtree(),
            _ => None,
        }
    }
}

impl NodeView<'_> {
    /// `tag` or `tag "name"`.
    fn title(&self) -> String {
        if self.tag == self.name { self.tag.to_owned() } else { format!("{} \"{}\"", self.tag, self.name) }
    }
}
