//! The immutable part of a tree, shared by all its instances.
//!
//! Nodes are stored in preorder, so the children of a node follow it, and everything below it is one range.

use std::ops::Range;
use std::sync::Arc;

use crate::board::{Binding, BoundPort, SlotDef};
use crate::kind::Kind;
use crate::leaf::declaration::{LeafClass, Port};
use crate::script::Script;
use crate::texts::{Text, Texts};
use crate::xml::source::Place;

/// One node, as a tick reads it: small and without indirection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NodeDef {
    pub(crate) kind: Kind,
    /// One past the last node below this one.
    pub(crate) end: u32,
    /// Index into [`Shape::conditions`], or [`NONE`].
    pub(crate) conditions: u32,
    pub(crate) children: u16,
    /// It has exactly one child, whose status it resets as soon as the child has finished.
    pub(crate) is_decorator: bool,
    /// It goes on where it was when it is started after a halt.
    pub(crate) keeps_place: bool,
}

/// Marks an absent index.
pub(crate) const NONE: u32 = u32::MAX;

/// What a node is called. Not read by a tick.
#[derive(Clone, Debug)]
pub(crate) struct NodeLabel {
    pub(crate) tag: Text,
    pub(crate) name: Text,
    /// The parent. For the root of an included tree, its `SubTree` node; for the outermost root, [`NONE`].
    pub(crate) parent: u32,
    /// The tree that the node is written in, as an index into [`Shape::trees`].
    pub(crate) tree: u32,
    /// Its range of [`Shape::attributes`].
    pub(crate) attributes: Range<usize>,
}

/// The outermost tree, or a tree that is included by a `SubTree` node.
#[derive(Clone, Debug)]
pub(crate) struct IncludedTree {
    pub(crate) id: Arc<str>,
    /// The names of the `SubTree` nodes on the way to it, `outer/inner`. Empty for the outermost tree.
    pub(crate) path: Arc<str>,
    /// Its first node.
    pub(crate) root: u32,
}

#[derive(Clone, Debug)]
pub(crate) struct LeafDef {
    pub(crate) node: u32,
    pub(crate) class: LeafClass,
    pub(crate) declared: Arc<[Port]>,
    pub(crate) bound: Box<[BoundPort]>,
    /// Where the leaf is written.
    pub(crate) at: Place,
}

/// The pre- and postconditions of one node, as indices into [`Shape::scripts`] or [`NONE`].
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
    /// The attributes of all nodes as written: ports, pre- and postconditions.
    pub(crate) attributes: Vec<(Text, Text)>,
    /// The texts of the labels.
    pub(crate) texts: Texts,
    pub(crate) trees: Vec<IncludedTree>,
    pub(crate) leaves: Vec<LeafDef>,
    pub(crate) conditions: Vec<Conditions>,
    pub(crate) scripts: Vec<Script>,
    /// For every `Switch` node, the variable and then the cases.
    pub(crate) switches: Vec<Vec<Binding>>,
    pub(crate) slots: Vec<SlotDef>,
    /// The names of the keys by slot; `subtree/key` for those of a subtree.
    pub(crate) keys: Vec<String>,
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

    /// What kind of node it is. For a `SubTree`, the `ID` of the included tree.
    pub(crate) fn tag(&self, node: usize) -> &str {
        self.texts.get(self.labels[node].tag)
    }

    /// The node's name: its `name` attribute, or its tag.
    pub(crate) fn name(&self, node: usize) -> &str {
        self.texts.get(self.labels[node].name)
    }

    /// The names and values of the node's attributes.
    pub(crate) fn attributes(&self, node: usize) -> impl Iterator<Item = (&str, &str)> {
        let attributes = &self.attributes[self.labels[node].attributes.clone()];
        attributes.iter().map(|(name, value)| (self.texts.get(*name), self.texts.get(*value)))
    }

    /// The node's name after the names of the subtrees it is in.
    pub(crate) fn path(&self, node: usize) -> String {
        let label = &self.labels[node];
        let path = &self.trees[label.tree as usize].path;
        if path.is_empty() { self.name(node).to_owned() } else { format!("{path}/{}", self.name(node)) }
    }

    /// The slot of a key.
    pub(crate) fn slot(&self, key: &str) -> Option<usize> {
        self.keys.iter().position(|name| name == key)
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
