//! From the elements of a tree, and of the trees it includes, to a template.

use std::collections::{BTreeMap, BTreeSet};

use super::attributes::Attributes;
use super::builder::ShapeBuilder;
use super::connect::{add_global, add_parameter, autoremap, connect, connect_defaults};
use super::forest::{Forest, MAX_NODES};
use super::keys::Keys;
use super::meaning::{Meaning, built_in_kind, meaning, wrong_children};
use super::mistake::Mistake;
use super::mistakes::Mistakes;
use super::names::repeated_names;
use super::parse::MAX_DEPTH;
use super::scripts::{Names, Scripts};
use crate::kind::Kind;
use crate::nodes::built_in::Class;
use crate::shape::NONE;
use crate::template::Template;
use crate::xml::source::SourceElement;

/// Expands all trees of a library. Those with mistakes are missing.
pub(crate) fn expand_all<Ctx>(
    forest: &mut Forest<'_, Ctx>,
    mistakes: &mut Mistakes,
) -> BTreeMap<String, Template<Ctx>> {
    let (ids, parts): (Vec<&str>, BTreeSet<&str>) = (forest.ids().collect(), forest.parts());
    ids.into_iter().filter_map(|id| Some((id.to_owned(), expand(forest, id, parts.contains(id), mistakes)?))).collect()
}

/// Expands one tree. `None` if there are mistakes. For `is_part` see [`ShapeBuilder::finish`].
fn expand<Ctx>(
    forest: &mut Forest<'_, Ctx>,
    id: &str,
    is_part: bool,
    mistakes: &mut Mistakes,
) -> Option<Template<Ctx>> {
    let before = mistakes.count();
    let tree = forest.tree(id)?;
    let mut keys = Keys::default();
    let scope = keys.open_scope(None, String::new(), false);
    for (key, ty) in &forest.registry().globals {
        add_global(&mut keys, key, *ty, tree.at(), mistakes);
    }
    for port in forest.model(id) {
        add_parameter(&mut keys, port, tree.at(), mistakes);
    }
    let (builder, scripts, inside) = (ShapeBuilder::new(id), Scripts::default(), vec![id.to_owned()]);
    let mut expander = Expander { forest, mistakes, keys, scripts, builder, inside };
    expander.tree(tree, id, "", Position { scope, parent: NONE, depth: 0 });
    let Expander { keys, scripts, builder, mistakes, .. } = expander;
    let template = builder.finish(keys, scripts, is_part, mistakes);
    (mistakes.count() == before).then_some(template)
}

/// Walks over the elements of one tree.
struct Expander<'e, 'f, Ctx> {
    forest: &'e mut Forest<'f, Ctx>,
    mistakes: &'e mut Mistakes,
    keys: Keys,
    scripts: Scripts,
    builder: ShapeBuilder<'f, Ctx>,
    /// The IDs of the trees on the way to the element, outermost first.
    inside: Vec<String>,
}

/// Where an element stands.
#[derive(Clone, Copy)]
struct Position {
    /// The tree it is in, see [`Keys::open_scope`].
    scope: usize,
    parent: u32,
    depth: usize,
}

impl<'f, Ctx> Expander<'_, 'f, Ctx> {
    fn tree(&mut self, tree: SourceElement<'f>, id: &str, path: &str, position: Position) {
        self.builder.enter_tree(id, path, tree.descendants().count().min(MAX_NODES));
        for (name, at) in repeated_names(tree) {
            self.mistakes.add(at, Mistake::DuplicateName { name: name.to_owned(), tree: id.to_owned() });
        }
        match wrong_children(tree, tree.tag(), &(1..=1)) {
            Some(mistake) => self.mistakes.add(tree.at(), mistake),
            None => tree.children().for_each(|root| self.node(root, position)),
        }
    }

    fn node(&mut self, element: SourceElement<'f>, position: Position) {
        if MAX_DEPTH < position.depth {
            return self.mistakes.add(element.at(), Mistake::TooDeep { limit: MAX_DEPTH });
        }
        if let Err(mistake) = self.forest.take_node(self.builder.len()) {
            return self.mistakes.add(element.at(), mistake);
        }
        let registry = self.forest.registry();
        let Some((tag, meaning)) = meaning(element, registry, self.mistakes) else {
            return;
        };
        let at = self.builder.begin_node(element, tag, position.parent, position.scope as u32);
        let names = Names { keys: &mut self.keys, scope: position.scope, constants: &registry.constants };
        let mut attributes = Attributes { element, names, scripts: &mut self.scripts, mistakes: self.mistakes };
        let (kind, built_in) = match meaning {
            Meaning::Leaf(kind) => {
                let bindings = attributes.bind(tag, &kind.ports);
                (self.builder.add_leaf(at, kind, bindings, element.at()), None)
            }
            Meaning::BuiltIn(built_in, _) if built_in.class == Class::SubTree => (Kind::SubTree, Some(built_in)),
            Meaning::BuiltIn(built_in, ports) => {
                (built_in_kind(built_in, ports, &mut attributes, &mut self.builder), Some(built_in))
            }
        };
        if let Some(conditions) = attributes.conditions() {
            self.builder.set_conditions(at, conditions);
        }
        let is_sub_tree = kind == Kind::SubTree;
        attributes.check_reserved(if is_sub_tree { &["_autoremap"] } else { &[] });
        let below = Position { parent: at as u32, depth: position.depth + 1, ..position };
        let children = if is_sub_tree {
            self.sub_tree(element, at, below);
            1
        } else {
            element.children().inspect(|child| self.node(*child, below)).count()
        };
        self.builder.end_node(at, kind, children, built_in);
    }

    /// Expands the tree that the `SubTree` node `at` includes.
    fn sub_tree(&mut self, element: SourceElement<'f>, at: usize, position: Position) {
        let id = element.get("ID").unwrap_or_default();
        let Some(tree) = self.forest.tree(id) else {
            let nearest = self.mistakes.nearest(id, self.forest.ids());
            return self.mistakes.add(element.at(), Mistake::UnknownTree { id: id.to_owned(), nearest });
        };
        if self.inside.iter().any(|outer| outer == id) {
            let path = format!("{} > {id}", self.inside.join(" > "));
            return self.mistakes.add(element.at(), Mistake::Cycle { id: id.to_owned(), path });
        }
        let outer = self.builder.path(position.scope);
        let name = element.get("name").map_or_else(|| format!("{id}::{}", at + 1), str::to_owned);
        let path = if outer.is_empty() { name } else { format!("{outer}/{name}") };
        let autoremap = autoremap(element, self.mistakes);
        let scope = self.keys.open_scope(Some(position.scope), format!("{path}/"), autoremap);
        connect(element, &mut self.keys, scope, self.mistakes);
        if !autoremap {
            connect_defaults(element, id, self.forest.model(id), &mut self.keys, scope, self.mistakes);
        }
        self.inside.push(id.to_owned());
        self.tree(tree, id, &path, Position { scope, ..position });
        self.inside.pop();
        for (key, at) in self.keys.unused(scope) {
            if !self.forest.model(id).iter().any(|port| *port.name == *key) {
                let nearest = self.mistakes.nearest(&key, self.keys.used(scope));
                self.mistakes.add(at, Mistake::UnusedKey { tree: id.to_owned(), key, nearest });
            }
        }
    }
}
