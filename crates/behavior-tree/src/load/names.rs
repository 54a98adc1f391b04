//! The names of the nodes in one tree, by which a log distinguishes them.

use std::collections::HashMap;

use crate::xml::element::{Element, Place};

/// The names that an earlier node of the tree also has.
pub(super) fn repeated_names(tree: &Element) -> Vec<(&str, Place)> {
    let (mut seen, mut repeated) = (HashMap::new(), Vec::new());
    collect_names(tree, &mut |name, at| {
        if seen.insert(name, at).is_some() {
            repeated.push((name, at));
        }
    });
    repeated
}

fn collect_names<'e>(element: &'e Element, take: &mut impl FnMut(&'e str, Place)) {
    for child in &element.children {
        if let Some(attribute) = child.find("name").filter(|name| is_given(&name.value, child)) {
            take(&attribute.value, attribute.at);
        }
        collect_names(child, take);
    }
}

/// Editors write the kind of a node as its name if it has none.
fn is_given(name: &str, element: &Element) -> bool {
    !name.is_empty() && name != element.tag && element.get("ID") != Some(name)
}
