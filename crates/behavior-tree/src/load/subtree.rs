//! Trees and the trees inside them: what they are called, and how their keys are connected.

use std::collections::HashMap;

use super::expand::Expander;
use super::meaning::count;
use super::mistake::Mistake;
use super::ports::{declare, is_port, is_usable_key, key_of};
use crate::shape::Scope;
use crate::types::Type;
use crate::value::Value;
use crate::xml::element::{Element, Place};

impl<'f, Ctx> Expander<'_, 'f, Ctx> {
    /// The keys that an instance may be given: the tree's declared ports and the registry's globals.
    pub(super) fn parameters(&mut self, id: &str, tree: &Element) {
        let globals = self.forest.registry.globals.iter().map(|(key, ty)| (key.clone(), *ty));
        for (key, ty) in globals.collect::<Vec<_>>() {
            let slot = self.scopes.resolve(0, &key);
            let slot = &mut self.scopes.slots[slot as usize];
            (slot.is_written, slot.open) = (true, true);
            declare(slot, ty, tree.at, self.mistakes);
        }
        for port in self.forest.models.get(id).cloned().unwrap_or_default() {
            let slot = self.scopes.resolve(0, &port.name);
            let slot = &mut self.scopes.slots[slot as usize];
            (slot.is_written, slot.open) = (true, true);
            slot.required = !port.optional && port.default.is_none();
            if let Some(text) = port.default {
                slot.literal = Some((text, tree.at));
            }
            declare(slot, port.ty, tree.at, self.mistakes);
        }
    }

    pub(super) fn tree(&mut self, tree: &'f Element, scope: usize, id: &str, path: &str, parent: u32, depth: usize) {
        let root = self.shape.nodes.len() as u32;
        self.shape.scopes.push(Scope { tree_id: id.into(), path: path.into(), root });
        let mut names = HashMap::new();
        collect_names(tree, &mut names);
        for (name, places) in names {
            for place in places.iter().skip(1) {
                let (name, tree) = (name.to_owned(), id.to_owned());
                self.mistakes.add(*place, Mistake::DuplicateName { name, tree });
            }
        }
        match tree.children.as_slice() {
            [root] => self.node(root, scope, parent, depth),
            children => {
                let found = count(children.len());
                let mistake =
                    Mistake::Children { tag: "BehaviorTree".into(), found, expected: "exactly 1 child".into() };
                self.mistakes.add(tree.at, mistake);
            }
        }
    }

    pub(super) fn sub_tree(&mut self, element: &'f Element, scope: usize, at: usize, depth: usize) {
        let id = element.get("ID").unwrap_or_default();
        let Some(tree) = self.forest.trees.get(id).copied() else {
            let nearest = self.mistakes.nearest(id, self.forest.trees.keys().copied());
            return self.mistakes.add(element.at, Mistake::UnknownTree { id: id.to_owned(), nearest });
        };
        if self.stack.iter().any(|it| it == id) {
            let path = format!("{} > {id}", self.stack.join(" > "));
            return self.mistakes.add(element.at, Mistake::Cycle { id: id.to_owned(), path });
        }
        let outer = self.shape.scopes[scope].path.clone();
        let name = element.get("name").map_or_else(|| format!("{id}::{}", at + 1), str::to_owned);
        let path = if outer.is_empty() { name } else { format!("{outer}/{name}") };
        let autoremap = match element.find("_autoremap") {
            None => false,
            Some(attribute) => match Type::Bool.parse(&attribute.value) {
                Some(Value::Bool(flag)) => flag,
                _ => {
                    let (port, text, ty) = ("_autoremap".into(), attribute.value.clone(), "bool".into());
                    self.mistakes.add(attribute.at, Mistake::BadConstant { port, text, ty });
                    false
                }
            },
        };
        let inner = self.scopes.open_scope(Some(scope), format!("{path}/"), autoremap);
        self.connect(element, inner, id, autoremap);
        self.stack.push(id.to_owned());
        self.tree(tree, inner, id, &path, at as u32, depth + 1);
        self.stack.pop();
        for (key, at) in self.scopes.unused(inner) {
            let declared = self.forest.models.get(id).is_some_and(|ports| ports.iter().any(|port| port.name == key));
            if !declared {
                let nearest = self.mistakes.nearest(&key, self.scopes.keys(inner));
                self.mistakes.add(at, Mistake::UnusedRemap { tree: id.to_owned(), key, nearest });
            }
        }
    }

    /// Connects the keys inside a subtree to those outside, as the attributes of its `SubTree` node say.
    fn connect(&mut self, element: &Element, inner: usize, id: &str, autoremap: bool) {
        for attribute in element.attributes.iter().filter(|it| is_port(it)) {
            let (inside, text) = (&attribute.name, &attribute.value);
            match key_of(inside, text) {
                Some(outside) if is_usable_key(outside) => self.scopes.remap(inner, inside, outside, attribute.at),
                Some(_) => {
                    let (port, text) = (inside.clone(), text.clone());
                    self.mistakes.add(attribute.at, Mistake::BadKey { port, text });
                }
                None => self.scopes.literal(inner, inside, text, attribute.at),
            }
        }
        let Some(ports) = self.forest.models.get(id) else {
            return;
        };
        for port in ports.iter().filter(|port| element.find(&port.name).is_none() && !autoremap) {
            match &port.default {
                Some(default) => match key_of(&port.name, default) {
                    Some(outside) => self.scopes.remap(inner, &port.name, outside, element.at),
                    None => self.scopes.literal(inner, &port.name, default, element.at),
                },
                None if port.optional => {}
                None => {
                    let (tag, port, ty) = (id.to_owned(), port.name.clone(), port.ty.name().to_owned());
                    let direction = "a port of the subtree";
                    self.scopes.forgive(inner, &port);
                    self.mistakes.add(element.at, Mistake::MissingPort { tag, port, direction, ty });
                }
            }
        }
    }
}

fn collect_names<'e>(element: &'e Element, names: &mut HashMap<&'e str, Vec<Place>>) {
    for child in &element.children {
        if let Some(attribute) = child.find("name").filter(|it| is_given(&it.value, child)) {
            names.entry(&attribute.value).or_default().push(attribute.at);
        }
        collect_names(child, names);
    }
}

/// Editors write the kind of a node as its name if it has none.
fn is_given(name: &str, element: &Element) -> bool {
    !name.is_empty() && name != element.tag && element.get("ID") != Some(name)
}
