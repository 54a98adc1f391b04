//! From the elements of a tree, and of the trees it contains, to one [`Shape`].
//!
//! This walks the elements; what stands at a node is found in `meaning`, subtrees are entered in `subtree`, and keys and
//! expressions, which need the whole tree, are seen to in `finish`.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::meaning::Meaning;
use super::mistake::Mistake;
use super::mistakes::Mistakes;
use super::ports::check_reserved;
use super::scope::Scopes;
use super::scripts::Scripts;
use crate::kind::Kind;
use crate::port_list::Port;
use crate::registry::{Factory, Registry};
use crate::shape::{NONE, NodeDef, NodeLabel, Shape};
use crate::template::Template;
use crate::xml::element::Element;
use crate::xml::parse::MAX_DEPTH;

/// BehaviorTree.CPP's tools number the nodes of a tree with sixteen bits.
pub(crate) const MAX_NODES: usize = u16::MAX as usize;

/// All trees of a library together; a few lines of XML can describe any number of nodes.
pub(crate) const MAX_NODES_IN_ALL: usize = 4 * MAX_NODES;

/// What a library knows of its trees while they are expanded.
pub(crate) struct Forest<'a, Ctx> {
    pub(crate) registry: &'a Registry<Ctx>,
    /// Every `BehaviorTree` element by `ID`.
    pub(crate) trees: BTreeMap<&'a str, &'a Element>,
    /// The ports that `TreeNodesModel` declares for a tree.
    pub(crate) models: BTreeMap<&'a str, Vec<Port>>,
    pub(crate) nodes_left: usize,
}

/// Expands one tree. `None` if there are mistakes.
///
/// A tree that is only a part of others may read keys that only those others write: with `is_part` such keys become
/// parameters.
pub(crate) fn expand<Ctx>(
    forest: &mut Forest<'_, Ctx>,
    id: &str,
    is_part: bool,
    mistakes: &mut Mistakes,
) -> Option<Template<Ctx>> {
    let before = mistakes.count();
    let tree: &Element = forest.trees.get(id)?;
    let shape = Shape {
        tree_id: id.into(),
        nodes: Vec::new(),
        labels: Vec::new(),
        scopes: Vec::new(),
        leaves: Vec::new(),
        conditions: Vec::new(),
        scripts: Vec::new(),
        switches: Vec::new(),
        slots: Vec::new(),
        slot_names: Vec::new(),
    };
    let (scopes, scripts, factories) = (Scopes::default(), Scripts::default(), Vec::new());
    let stack = vec![id.to_owned()];
    let mut expander = Expander { forest, mistakes, shape, scopes, scripts, factories, stack };
    let root = expander.scopes.open_scope(None, String::new(), false);
    expander.parameters(id, tree);
    expander.tree(tree, root, id, "", NONE, 0);
    expander.finish(is_part);
    let Expander { shape, factories, .. } = expander;
    (mistakes.count() == before).then(|| Template { shape: Arc::new(shape), factories: factories.into() })
}

pub(super) struct Expander<'e, 'f, Ctx> {
    pub(super) forest: &'e mut Forest<'f, Ctx>,
    pub(super) mistakes: &'e mut Mistakes,
    pub(super) shape: Shape,
    pub(super) scopes: Scopes,
    pub(super) scripts: Scripts,
    pub(super) factories: Vec<Factory<Ctx>>,
    /// The trees we are in, outermost first.
    pub(super) stack: Vec<String>,
}

impl<'f, Ctx> Expander<'_, 'f, Ctx> {
    pub(super) fn node(&mut self, element: &'f Element, scope: usize, parent: u32, depth: usize) {
        if MAX_DEPTH < depth {
            return self.mistakes.add(element.at, Mistake::TooDeep);
        }
        if self.shape.nodes.len() == MAX_NODES {
            return self.mistakes.add(element.at, Mistake::TooLarge { limit: MAX_NODES, in_all: false });
        }
        let Some(left) = self.forest.nodes_left.checked_sub(1) else {
            return self.mistakes.add(element.at, Mistake::TooLarge { limit: MAX_NODES_IN_ALL, in_all: true });
        };
        self.forest.nodes_left = left;
        let Some((tag, meaning)) = self.meaning(element) else {
            return;
        };
        let at = self.shape.nodes.len();
        let placeholder = NodeDef { kind: Kind::AlwaysFailure, end: 0, children: 0, conditions: NONE };
        self.shape.nodes.push(placeholder);
        let kind = match meaning {
            Meaning::BuiltIn(built_in) => self.built_in(built_in, element, scope),
            Meaning::Leaf(kind) => self.leaf(kind, element, tag, scope, at),
        };
        self.label(element, tag, scope, parent);
        let conditions = self.conditions(element, scope);
        let known: &[&str] = if kind == Kind::SubTree { &["_autoremap"] } else { &[] };
        check_reserved(element, known, self.mistakes);
        if kind == Kind::SubTree {
            self.sub_tree(element, scope, at, depth);
        } else {
            for child in &element.children {
                self.node(child, scope, at as u32, depth + 1);
            }
        }
        let end = self.shape.nodes.len() as u32;
        let children = if kind == Kind::SubTree { 1 } else { element.children.len() as u32 };
        self.shape.nodes[at] = NodeDef { kind, end, children, conditions };
        self.check_thresholds(element, kind, children);
    }

    fn label(&mut self, element: &Element, tag: &str, scope: usize, parent: u32) {
        let tag = if element.tag == "SubTree" { element.get("ID").unwrap_or(tag) } else { tag };
        let name = element.get("name").filter(|name| !name.is_empty()).unwrap_or(tag);
        let attributes = element.attributes.iter().filter(|it| it.name != "name" && it.name != "ID");
        let attributes = attributes.map(|it| (it.name.clone(), it.value.clone())).collect();
        let label = NodeLabel { tag: tag.into(), name: name.into(), parent, scope: scope as u32, attributes };
        self.shape.labels.push(label);
    }
}
