//! A shape under construction.

use std::sync::Arc;
use std::task::Waker;

use super::keys::Keys;
use super::mistake::Mistake;
use super::mistakes::Mistakes;
use super::scripts::Scripts;
use crate::board::{Binding, BoundPort};
use crate::kind::Kind;
use crate::leaf::registry::{Factory, LeafKind};
use crate::nodes::built_in::{BuiltIn, Class};
use crate::shape::{Conditions, IncludedTree, LeafDef, NONE, NodeDef, NodeLabel, Shape};
use crate::template::{Template, spec_of};
use crate::texts::{TextCollector, Texts};
use crate::xml::source::{Place, SourceElement};

/// Collects the nodes of one tree in preorder.
pub(super) struct ShapeBuilder<'x, Ctx> {
    shape: Shape,
    texts: TextCollector<'x>,
    factories: Vec<Arc<dyn Factory<Ctx>>>,
}

impl<'x, Ctx> ShapeBuilder<'x, Ctx> {
    pub(super) fn new(id: &str) -> Self {
        let shape = Shape {
            tree_id: id.into(),
            nodes: Vec::new(),
            labels: Vec::new(),
            attributes: Vec::new(),
            texts: Texts::default(),
            trees: Vec::new(),
            leaves: Vec::new(),
            conditions: Vec::new(),
            scripts: Vec::new(),
            switches: Vec::new(),
            slots: Vec::new(),
            keys: Vec::new(),
        };
        ShapeBuilder { shape, texts: TextCollector::default(), factories: Vec::new() }
    }

    /// How many nodes there are.
    pub(super) fn len(&self) -> usize {
        self.shape.nodes.len()
    }

    /// Enters an included tree, or the outermost one, which has `nodes` nodes of its own. The next node is its root.
    pub(super) fn enter_tree(&mut self, id: &str, path: &str, nodes: usize) {
        let root = self.len() as u32;
        self.shape.nodes.reserve(nodes);
        self.shape.labels.reserve(nodes);
        self.shape.trees.push(IncludedTree { id: id.into(), path: path.into(), root });
    }

    /// The path of a tree that was entered.
    pub(super) fn path(&self, tree: usize) -> &str {
        &self.shape.trees[tree].path
    }

    /// Adds a node, which [`ShapeBuilder::end_node`] completes after the nodes below it.
    pub(super) fn begin_node(&mut self, element: SourceElement<'x>, tag: &'x str, parent: u32, tree: u32) -> usize {
        let (kind, conditions) = (Kind::AlwaysFailure, NONE);
        let def = NodeDef { kind, end: 0, conditions, children: 0, is_decorator: false, keeps_place: false };
        self.shape.nodes.push(def);
        let tag = if tag == Class::SubTree.tag() { element.get("ID").unwrap_or(tag) } else { tag };
        let name = element.get("name").filter(|name| !name.is_empty());
        let first_attribute = self.shape.attributes.len();
        for attribute in element.attributes().filter(|attribute| attribute.name != "name" && attribute.name != "ID") {
            let attribute = (self.texts.add(attribute.name), self.texts.add(attribute.value));
            self.shape.attributes.push(attribute);
        }
        let attributes = first_attribute..self.shape.attributes.len();
        let tag = self.texts.add(tag);
        let name = name.map_or(tag, |name| self.texts.add(name));
        self.shape.labels.push(NodeLabel { tag, name, parent, tree, attributes });
        self.len() - 1
    }

    pub(super) fn end_node(&mut self, at: usize, kind: Kind, children: usize, built_in: Option<&BuiltIn>) {
        let end = self.len() as u32;
        let def = &mut self.shape.nodes[at];
        // The loader refuses trees with more nodes than fit.
        (def.kind, def.end, def.children) = (kind, end, children as u16);
        def.is_decorator = built_in.is_some_and(BuiltIn::is_decorator);
        def.keeps_place = built_in.is_some_and(|built_in| built_in.keeps_place);
    }

    pub(super) fn set_conditions(&mut self, at: usize, conditions: Conditions) {
        self.shape.nodes[at].conditions = self.shape.conditions.len() as u32;
        self.shape.conditions.push(conditions);
    }

    /// Adds the leaf of a node, with its ports in the order of their declaration.
    pub(super) fn add_leaf(&mut self, node: usize, kind: &LeafKind<Ctx>, bindings: Vec<Binding>, at: Place) -> Kind {
        let bound = kind.ports.iter().zip(bindings);
        let bound = bound.map(|(port, binding)| BoundPort { name: port.name.clone(), binding }).collect();
        let (class, declared) = (kind.class, kind.ports.clone());
        self.shape.leaves.push(LeafDef { node: node as u32, class, declared, bound, at });
        self.factories.push(kind.factory.clone());
        Kind::Leaf { leaf: self.shape.leaves.len() as u32 - 1 }
    }

    /// Adds the values that a `Switch` compares. Returns their index.
    pub(super) fn add_table(&mut self, bindings: Vec<Binding>) -> u32 {
        self.shape.switches.push(bindings);
        self.shape.switches.len() as u32 - 1
    }

    /// Completes the tree: types of keys, keys that nothing writes, leaves that cannot be built.
    ///
    /// A tree that is only a part of others may use keys that those others make: with `is_part`, such keys become
    /// parameters.
    pub(super) fn finish(self, keys: Keys, scripts: Scripts, is_part: bool, mistakes: &mut Mistakes) -> Template<Ctx> {
        let ShapeBuilder { mut shape, texts, factories } = self;
        shape.texts = texts.finish();
        let mut slots = keys.slots;
        slots.read_literals(mistakes);
        scripts.infer_types(&mut slots);
        scripts.check(&slots, is_part, mistakes);
        slots.check_written(is_part, mistakes);
        shape.scripts = scripts.finish();
        (shape.slots, shape.keys) = slots.finish();
        for (leaf, factory) in shape.leaves.iter().zip(&factories) {
            if let Err(error) = factory.check(&spec_of(&shape, leaf, Waker::noop())) {
                mistakes.add(leaf.at, Mistake::Factory(error.to_string()));
            }
        }
        Template { shape: Arc::new(shape), factories: factories.into() }
    }
}
