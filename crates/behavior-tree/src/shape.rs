//! The immutable part of a tree, shared by all its instances.
//!
//! Nodes lie in preorder, so a node's children follow it and the whole subtree below it is one range.

use std::sync::Arc;

use crate::board::{Binding, BoundPort};
use crate::kind::Kind;
use crate::port_list::Port;
use crate::registry::LeafClass;
use crate::script::Script;
use crate::types::Type;
use crate::value::Value;
use crate::xml::element::Place;

/// One node, as the engine walks it. Small and without indirection: this is what a tick reads.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NodeDef {
    pub(crate) kind: Kind,
    /// One past the last node below this one.
    pub(crate) end: u32,
    pub(crate) children: u32,
    /// Index into [`Shape::conditions`], or [`NONE`].
    pub(crate) conditions: u32,
}

/// Marks an absent index.
pub(crate) const NONE: u32 = u32::MAX;

/// What a node is called; not read by a tick.
#[derive(Clone, Debug)]
pub(crate) struct NodeLabel {
    pub(crate) tag: Arc<str>,
    pub(crate) name: Arc<str>,
    /// The `SubTree` node for the root of an included tree; [`NONE`] for the outermost root.
    pub(crate) parent: u32,
    /// The tree this node was written in, as an index into [`Shape::scopes`].
    pub(crate) scope: u32,
    /// The attributes as written: ports, pre- and postconditions.
    pub(crate) attributes: Arc<[(String, String)]>,
}

/// A tree that was put into this one: the root, or what a `SubTree` node stands for.
#[derive(Clone, Debug)]
pub(crate) struct Scope {
    pub(crate) tree_id: Arc<str>,
    /// `outer/inner`, empty for the root.
    pub(crate) path: Arc<str>,
    /// The first node of it.
    pub(crate) root: u32,
}

#[derive(Clone, Debug)]
pub(crate) struct LeafDef {
    pub(crate) node: u32,
    pub(crate) class: LeafClass,
    pub(crate) declared: Arc<[Port]>,
    pub(crate) bound: Vec<BoundPort>,
    /// Where it stands in its file.
    pub(crate) at: Place,
}

/// A key of the blackboard.
#[derive(Clone, Debug)]
pub(crate) struct SlotDef {
    pub(crate) ty: Type,
    pub(crate) initial: Option<Value>,
    /// An instance must be given it.
    pub(crate) required: bool,
    /// It may be given to an instance, or set from outside.
    pub(crate) open: bool,
}

/// The scripts of one node, as indices into [`Shape::scripts`] or [`NONE`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Conditions {
    pub(crate) failure_if: u32,
    pub(crate) success_if: u32,
    pub(crate) skip_if: u32,
    pub(crate) while_true: u32,
    pub(crate) on_success: u32,
    pub(crate) on_failure: u32,
    pub(crate) on_halted: u32,
    pub(crate) post: u32,
}

#[derive(Debug)]
pub(crate) struct Shape {
    pub(crate) tree_id: Arc<str>,
    pub(crate) nodes: Vec<NodeDef>,
    pub(crate) labels: Vec<NodeLabel>,
    pub(crate) scopes: Vec<Scope>,
    pub(crate) leaves: Vec<LeafDef>,
    pub(crate) conditions: Vec<Conditions>,
    pub(crate) scripts: Vec<Script>,
    /// Of every `Switch` node: the variable, then the cases.
    pub(crate) switches: Vec<Vec<Binding>>,
    pub(crate) slots: Vec<SlotDef>,
    /// The slots' names, `subtree/key` for those of a subtree.
    pub(crate) slot_names: Vec<String>,
}

impl Shape {
    /// The children of a node, in order.
    pub(crate) fn children(&self, parent: usize) -> Children<'_> {
        Children { nodes: &self.nodes, next: parent + 1, end: self.nodes[parent].end as usize }
    }

    /// The node after `child` and everything below it: its next sibling, if it has one.
    pub(crate) fn after(&self, child: usize) -> usize {
        self.nodes[child].end as usize
    }

    pub(crate) fn child(&self, parent: usize, position: usize) -> Option<usize> {
        self.children(parent).nth(position)
    }

    /// The node's name after those of the subtrees it is in.
    pub(crate) fn path(&self, node: usize) -> String {
        let label = &self.labels[node];
        let path = &self.scopes[label.scope as usize].path;
        if path.is_empty() { label.name.to_string() } else { format!("{path}/{}", label.name) }
    }

    pub(crate) fn slot(&self, key: &str) -> Option<usize> {
        self.slot_names.iter().position(|name| name == key)
    }
}

pub(crate) struct Children<'a> {
    nodes: &'a [NodeDef],
    next: usize,
    end: usize,
}

impl Iterator for Children<'_> {
    type Item = usize;

    fn next(&mut self) -> Option<usize> {
        let child = self.next;
        if self.end <= child {
            return None;
        }
        self.next = self.nodes[child].end as usize;
        Some(child)
    }
}
