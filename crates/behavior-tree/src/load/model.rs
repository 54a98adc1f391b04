//! The ports of trees, as `TreeNodesModel` declares them.
//!
//! Models of actions and conditions are for editors; the registry describes these in more detail. The model of a tree
//! declares the keys that the tree takes from outside.

use std::collections::BTreeMap;

use super::keys::is_valid_key;
use super::mistake::Mistake;
use super::mistakes::Mistakes;
use super::parse::Contents;
use crate::leaf::declaration::{Direction, Port};
use crate::values::types::Type;
use crate::xml::source::SourceElement;

/// The declared ports of every tree that has a model.
pub(super) fn subtree_ports<'a>(contents: &[Contents<'a>], mistakes: &mut Mistakes) -> BTreeMap<&'a str, Vec<Port>> {
    let mut models: BTreeMap<&str, Vec<Port>> = BTreeMap::new();
    for model in contents.iter().flat_map(|file| &file.models).filter(|model| model.tag() == "SubTree") {
        let Some(id) = model.get("ID") else {
            mistakes.add(model.at(), Mistake::MissingAttribute { tag: model.tag().to_owned(), attribute: "ID" });
            continue;
        };
        let ports = models.entry(id).or_default();
        for element in model.children() {
            match port(id, element) {
                Ok(port) => ports.extend(port),
                Err(mistake) => mistakes.add(element.at(), mistake),
            }
        }
    }
    models
}

/// The port that an element declares. `None` for `MetadataFields` and others that editors add.
fn port(id: &str, element: SourceElement<'_>) -> Result<Option<Port>, Mistake> {
    let directions = [Direction::Input, Direction::Output, Direction::InOut];
    let word = element.tag().strip_suffix("_port");
    let Some(direction) = directions.into_iter().find(|direction| Some(direction.word()) == word) else {
        return Ok(None);
    };
    let Some(name) = element.get("name") else {
        return Err(Mistake::MissingAttribute { tag: element.tag().to_owned(), attribute: "name" });
    };
    if !is_valid_key(name) || name.starts_with('@') {
        return Err(Mistake::Model { id: id.to_owned(), port: name.to_owned() });
    }
    let ty = element.get("type").map_or(Type::Any, Type::named);
    let mut port = Port::of_type(name, direction, ty).describe(&element.text());
    port.default = element.get("default").map(str::to_owned);
    port.optional = direction == Direction::Output;
    Ok(Some(port))
}
