//! Looking at a tree: what its nodes are, what they do, why they failed.

mod btlog;
mod dot;
mod json;
mod mermaid;
mod text;
mod xml;

pub use btlog::BtlogWriter;

use crate::cause::FailureRecord;
use crate::kind::Kind;
use crate::shape::NONE;
use crate::status::NodeStatus;
use crate::tree::{NodeId, Tree};

/// One node of a tree, as an observer sees it.
#[derive(Clone, Copy, Debug)]
pub struct NodeView<'t> {
    /// Its place in preorder.
    pub id: NodeId,
    /// Its kind; for a `SubTree` the `ID` of the tree it stands for.
    pub tag: &'t str,
    /// Its `name` attribute, or its tag.
    pub name: &'t str,
    /// The path of the `SubTree` node it is in, such as `outer/inner`; empty in the outermost tree.
    pub path: &'t str,
    /// The node it is a child of; for the root of an included tree the `SubTree` node that stands for it.
    pub parent: Option<NodeId>,
    /// Its status.
    pub status: NodeStatus,
    /// Why it failed, if it said so and has neither run nor succeeded since.
    pub why: Option<&'t FailureRecord>,
}

impl<Ctx> Tree<Ctx> {
    /// One node. `None` if `node` belongs to another tree.
    pub fn node(&self, node: NodeId) -> Option<NodeView<'_>> {
        let label = self.shape.labels.get(node.index())?;
        Some(NodeView {
            id: node,
            tag: &label.tag,
            name: &label.name,
            path: &self.shape.scopes[label.scope as usize].path,
            parent: (label.parent != NONE).then_some(NodeId(label.parent)),
            status: self.machine.status[node.index()],
            why: self.why(node),
        })
    }

    /// All nodes, in preorder. Those of a tree that a leaf holds are not among them, see [`Tree::held_by`].
    pub fn nodes(&self) -> impl Iterator<Item = NodeView<'_>> {
        (0..self.len() as u32).filter_map(|index| self.node(NodeId(index)))
    }

    /// The children of a node, in order.
    pub fn children(&self, node: NodeId) -> impl Iterator<Item = NodeId> {
        let known = node.index() < self.len();
        let children = known.then(|| self.shape.children(node.index()));
        children.into_iter().flatten().map(|index| NodeId(index as u32))
    }

    /// The tree that a leaf holds, see [`Leaf::subtree`](crate::Leaf::subtree).
    pub fn held_by(&self, node: NodeId) -> Option<&Tree<Ctx>> {
        match self.shape.nodes.get(node.index())?.kind {
            Kind::Leaf(leaf) => self.machine.leaves[leaf as usize].subtree(),
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

const ROOT: NodeId = NodeId(0);
