//! What `TreeNodesModel` says of the ports of trees.
//!
//! The models of actions and conditions are for editors: the program's own registry knows better. Those of trees declare
//! what a tree wants from outside.

use std::collections::BTreeMap;

use super::mistake::Mistake;
use super::mistakes::Mistakes;
use super::ports::is_usable_key;
use crate::port_list::{Direction, Port};
use crate::types::Type;
use crate::xml::element::{Document, Element};

/// The declared ports of every tree that has a model.
pub(crate) fn subtree_ports<'a>(documents: &'a [Document], mistakes: &mut Mistakes) -> BTreeMap<&'a str, Vec<Port>> {
    let mut models: BTreeMap<&str, Vec<Port>> = BTreeMap::new();
    for model in documents.iter().flat_map(|document| &document.models).filter(|model| model.tag == "SubTree") {
        let Some(id) = model.get("ID") else {
            mistakes.add(model.at, Mistake::MissingAttribute { tag: model.tag.clone(), attribute: "ID" });
            continue;
        };
        let ports = models.entry(id).or_default();
        for element in &model.children {
            match port(id, element) {
                Ok(Some(port)) => ports.push(port),
                Ok(None) => {}
                Err(mistake) => mistakes.add(element.at, mistake),
            }
        }
    }
    models
}

fn port(id: &str, element: &Element) -> Result<Option<Port>, Mistake> {
    let direction = match element.tag.as_str() {
        "input_port" => Direction::Input,
        "output_port" => Direction::Output,
        "inout_port" => Direction::InOut,
        // `MetadataFields` and whatever else an editor keeps here.
        _ => return Ok(None),
    };
    let Some(name) = element.get("name") else {
        return Err(Mistake::MissingAttribute { tag: element.tag.clone(), attribute: "name" });
    };
    if !is_usable_key(name) || name.starts_with('@') {
        return Err(Mistake::Model { id: id.to_owned(), reason: format!("`{name}` is not a usable name of a port") });
    }
    let ty = element.get("type").map_or(Type::Any, Type::named);
    let mut port = Port::of_type(name, direction, ty).describe(&element.text);
    port.default = element.get("default").map(str::to_owned);
    port.optional = direction == Direction::Output;
    Ok(Some(port))
}
