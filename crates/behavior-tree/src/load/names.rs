//! The names of the nodes in one tree, by which a log distinguishes them.

use std::collections::HashSet;

use crate::xml::source::{Place, SourceElement};

/// The names that an earlier node of the tree also has.
pub(super) fn repeated_names(tree: SourceElement<'_>) -> Vec<(&str, Place)> {
    let named = tree.descendants().filter_map(|element| Some((element, element.find("name")?)));
    let given = named.filter(|(element, name)| is_given(name.value, *element)).map(|(_, name)| name);
    let mut seen = HashSet::new();
    given.filter(|name| !seen.insert(name.value)).map(|name| (name.value, name.at)).collect()
}

/// Editors write the kind of a node as its name if it has none.
fn is_given(name: &str, element: SourceElement<'_>) -> bool {
    !name.is_empty() && name != element.tag() && element.get("ID") != Some(name)
}
