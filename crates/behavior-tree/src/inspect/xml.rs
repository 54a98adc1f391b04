//! A tree as XML for BehaviorTree.CPP's tools: every included tree written out, every node numbered.

use std::collections::BTreeMap;

use crate::kind::Kind;
use crate::leaf::registry::leaf_model;
use crate::machine::Tree;
use crate::nodes;
use crate::xml::element::{Document, Element};

impl<Ctx> Tree<Ctx> {
    /// The tree as a file for Groot2's monitors and logs, with `_uid` and `_fullpath` attributes and the models of its
    /// nodes. [`Library::documents`](crate::Library::documents) has the files as they were loaded.
    pub fn to_document(&self) -> Document {
        let mut document = Document::new();
        for tree in &self.shape.trees {
            let element = Element::new("BehaviorTree")
                .attribute("ID", &tree.id)
                .attribute("_fullpath", &tree.path)
                .child(self.element(tree.root as usize));
            document.trees.push(element);
        }
        document.models = self.models();
        document
    }

    fn element(&self, node: usize) -> Element {
        let (def, tag) = (&self.shape.nodes[node], self.shape.tag(node));
        let mut element = match def.kind {
            Kind::SubTree => {
                // The first node of the included tree follows its `SubTree` node.
                let inner = &self.shape.labels[node + 1];
                let path = &self.shape.trees[inner.tree as usize].path;
                Element::new("SubTree").attribute("ID", tag).attribute("_fullpath", path)
            }
            _ => Element::new(tag).attribute("name", self.shape.name(node)),
        };
        element = element.attribute("_uid", &(node + 1).to_string());
        for (name, value) in self.shape.attributes(node).filter(|(name, _)| *name != "_uid" && *name != "_fullpath") {
            element = element.attribute(name, value);
        }
        if def.kind == Kind::SubTree {
            return element;
        }
        element.children(self.shape.children(node).map(|child| self.element(child)))
    }

    fn models(&self) -> Vec<Element> {
        let mut models: BTreeMap<&str, Element> = nodes::built_ins().map(|node| (node.tag, node.model())).collect();
        for leaf in &self.shape.leaves {
            let tag = self.shape.tag(leaf.node as usize);
            models.entry(tag).or_insert_with(|| leaf_model(tag, leaf.class, &leaf.declared));
        }
        for tree in &self.shape.trees[1..] {
            models.entry(&tree.id).or_insert_with(|| Element::new("SubTree").attribute("ID", &tree.id));
        }
        models.into_values().collect()
    }
}
