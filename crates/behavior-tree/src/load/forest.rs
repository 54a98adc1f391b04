//! All trees of a library while they are expanded.

use std::collections::{BTreeMap, BTreeSet};

use super::mistake::Mistake;
use super::mistakes::Mistakes;
use super::model::subtree_ports;
use super::parse::Contents;
use crate::leaf::declaration::Port;
use crate::leaf::registry::Registry;
use crate::nodes;
use crate::xml::source::SourceElement;

/// BehaviorTree.CPP's tools number the nodes of a tree with sixteen bits.
pub(super) const MAX_NODES: usize = u16::MAX as usize;

/// The limit for all trees of a library together: a few lines of XML can describe any number of nodes.
const MAX_NODES_IN_ALL: usize = 4 * MAX_NODES;

/// The elements and models that the trees of a library are expanded from.
pub(crate) struct Forest<'a, Ctx> {
    registry: &'a Registry<Ctx>,
    /// Every `BehaviorTree` element by `ID`.
    trees: BTreeMap<&'a str, SourceElement<'a>>,
    /// The ports that `TreeNodesModel` declares for a tree.
    models: BTreeMap<&'a str, Vec<Port>>,
    nodes_left: usize,
}

impl<'a, Ctx> Forest<'a, Ctx> {
    pub(crate) fn new(registry: &'a Registry<Ctx>, contents: &[Contents<'a>], mistakes: &mut Mistakes) -> Self {
        let mut trees: BTreeMap<&str, SourceElement<'_>> = BTreeMap::new();
        for tree in contents.iter().flat_map(|file| &file.trees) {
            let Some(attribute) = tree.find("ID") else {
                mistakes.add(tree.at(), Mistake::MissingAttribute { tag: tree.tag().to_owned(), attribute: "ID" });
                continue;
            };
            let id = attribute.value;
            if nodes::is_built_in(id) || registry.kinds.contains_key(id) {
                mistakes.add(attribute.at, Mistake::TreeNamedLikeNode { id: id.to_owned() });
            }
            if trees.insert(id, *tree).is_some() {
                mistakes.add(attribute.at, Mistake::DuplicateTree { id: id.to_owned() });
            }
        }
        let models = subtree_ports(contents, mistakes);
        Forest { registry, trees, models, nodes_left: MAX_NODES_IN_ALL }
    }

    pub(super) fn registry(&self) -> &'a Registry<Ctx> {
        self.registry
    }

    pub(super) fn tree(&self, id: &str) -> Option<SourceElement<'a>> {
        self.trees.get(id).copied()
    }

    /// The trees that other trees include.
    pub(super) fn parts(&self) -> BTreeSet<&'a str> {
        self.trees.values().flat_map(|tree| tree.descendants()).filter_map(included).collect()
    }

    pub(super) fn ids(&self) -> impl Iterator<Item = &'a str> {
        self.trees.keys().copied()
    }

    /// The declared ports of a tree.
    pub(super) fn model(&self, id: &str) -> &[Port] {
        self.models.get(id).map_or(&[], Vec::as_slice)
    }

    /// Counts one more node, of a tree that has `nodes` already.
    pub(super) fn take_node(&mut self, nodes: usize) -> Result<(), Mistake> {
        if nodes == MAX_NODES {
            return Err(Mistake::TooLarge { limit: MAX_NODES, in_all: false });
        }
        let left = self.nodes_left.checked_sub(1);
        self.nodes_left = left.ok_or(Mistake::TooLarge { limit: MAX_NODES_IN_ALL, in_all: true })?;
        Ok(())
    }
}

/// The tree that an element includes.
fn included(element: SourceElement<'_>) -> Option<&str> {
    (element.tag() == "SubTree").then(|| element.get("ID")).flatten()
}
