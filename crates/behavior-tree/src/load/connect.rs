//! The keys of a tree that are connected to the outside: those of an instance, and those of a subtree.

use super::keys::{Keys, is_valid_key, key_of};
use super::mistake::Mistake;
use super::mistakes::Mistakes;
use super::ports::{is_port, missing};
use crate::leaf::declaration::Port;
use crate::values::types::Type;
use crate::values::value::Value;
use crate::xml::source::{Place, SourceElement};

/// Makes a global of the registry a key of the outermost tree.
pub(super) fn add_global(keys: &mut Keys, key: &str, ty: Type, at: Place, mistakes: &mut Mistakes) {
    let slot = keys.resolve(0, key);
    keys.slots.open(slot, false);
    keys.slots.declare(slot, ty, at, mistakes);
}

/// Makes a declared port of the outermost tree a parameter of its instances.
pub(super) fn add_parameter(keys: &mut Keys, port: &Port, at: Place, mistakes: &mut Mistakes) {
    let slot = keys.resolve(0, &port.name);
    keys.slots.open(slot, !port.optional && port.default.is_none());
    if let Some(text) = &port.default {
        keys.slots.set_literal(slot, text, at);
    }
    keys.slots.declare(slot, port.ty, at, mistakes);
}

/// Whether a `SubTree` node connects all keys of the same name.
pub(super) fn autoremap(element: SourceElement<'_>, mistakes: &mut Mistakes) -> bool {
    let Some(attribute) = element.find("_autoremap") else {
        return false;
    };
    if let Some(Value::Bool(flag)) = Type::Bool.parse(attribute.value) {
        return flag;
    }
    let (port, expected, found) = (attribute.name.to_owned(), Type::Bool.name().to_owned(), attribute.value.to_owned());
    mistakes.add(attribute.at, Mistake::BadConstant { port, expected, found });
    false
}

/// Connects the keys inside a subtree to those outside, as the attributes of its `SubTree` node say.
pub(super) fn connect(element: SourceElement<'_>, keys: &mut Keys, inner: usize, mistakes: &mut Mistakes) {
    for attribute in element.attributes().filter(is_port) {
        let (inside, text) = (attribute.name, attribute.value);
        match key_of(inside, text) {
            Some(outside) if is_valid_key(outside) => keys.remap(inner, inside, outside, attribute.at),
            Some(_) => {
                let (port, text) = (inside.to_owned(), text.to_owned());
                mistakes.add(attribute.at, Mistake::BadKey { port, text });
            }
            None => keys.literal(inner, inside, text, attribute.at),
        }
    }
}

/// Connects the declared ports of the subtree `id` that its `SubTree` node leaves out, by their defaults.
pub(super) fn connect_defaults(
    element: SourceElement<'_>,
    id: &str,
    declared: &[Port],
    keys: &mut Keys,
    inner: usize,
    mistakes: &mut Mistakes,
) {
    for port in declared.iter().filter(|port| element.find(&port.name).is_none()) {
        match &port.default {
            Some(default) => match key_of(&port.name, default) {
                Some(outside) => keys.remap(inner, &port.name, outside, element.at()),
                None => keys.literal(inner, &port.name, default, element.at()),
            },
            None if port.optional => {}
            None => {
                keys.forgive(inner, &port.name);
                mistakes.add(element.at(), missing(id, port));
            }
        }
    }
}
