//! A running tree as XML, the way BehaviorTree.CPP's tools want it: every subtree spelt out, every node numbered.

use std::collections::BTreeMap;

use crate::kind::Kind;
use crate::nodes;
use crate::registry::{leaf_model, subtree_model};
use crate::tree::Tree;
use crate::xml::element::{Document, Element};

impl<Ctx> Tree<Ctx> {
    /// The tree as a file with `_uid` and `_fullpath` attributes and the models of its nodes, for Groot2's monitors and
    /// logs. [`Library::documents`](crate::Library::documents) has the files as they were written.
    pub fn to_document(&self) -> Document {
        let mut document = Document::new();
        for scope in &self.shape.scopes {
            let tree = Element::new("BehaviorTree")
                .attribute("ID", &scope.tree_id)
                .attribute("_fullpath", &scope.path)
                .child(self.element(scope.root as usize));
            document.trees.push(tree);
        }
        document.models = self.models();
        document
    }

    fn element(&self, node: usize) -> Element {
        let (def, label) = (&self.shape.nodes[node], &self.shape.labels[node]);
        let mut element = match def.kind {
            Kind::SubTree => {
                // The tree a `SubTree` node stands for begins right after it.
                let inner = &self.shape.labels[node + 1];
                let path = &self.shape.scopes[inner.scope as usize].path;
                Element::new("SubTree").attribute("ID", &label.tag).attribute("_fullpath", path)
            }
            _ => Element::new(&label.tag).attribute("name", &label.name),
        };
        element = element.attribute("_uid", &(node + 1).to_string());
        for (name, value) in label.attributes.iter().filter(|(name, _)| name != "_uid" && name != "_fullpath") {
            element = element.attribute(name, value);
        }
        if def.kind == Kind::SubTree {
            return element;
        }
        element.children(self.shape.children(node).map(|child| self.element(child)))
    }

    fn models(&self) -> Vec<Element> {
        let mut models: BTreeMap<&str, Element> = nodes::built_ins().map(|it| (it.tag, it.model())).collect();
        for leaf in &self.shape.leaves {
            let tag = &*self.shape.labels[leaf.node as usize].tag;
            models.entry(tag).or_insert_with(|| leaf_model(tag, leaf.class, &leaf.declared));
        }
        for label in self.shape.nodes.iter().zip(&self.shape.labels).filter(|(def, _)| def.kind == Kind::SubTree) {
            models.entry(&label.1.tag).or_insert_with(|| subtree_model(&label.1.tag));
        }
        models.into_values().collect()
    }
}
