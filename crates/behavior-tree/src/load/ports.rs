//! The attributes of one node, resolved to constants and keys.

use super::mistake::Mistake;
use super::mistakes::Mistakes;
use super::scope::Scopes;
use crate::board::Binding;
use crate::port_list::{Direction, Port};
use crate::types::Type;
use crate::xml::element::{Attribute, Element, Place};

/// Attributes with a meaning of their own on every node.
pub(crate) const CONDITION_ATTRIBUTES: [&str; 8] =
    ["_failureIf", "_successIf", "_skipIf", "_while", "_onSuccess", "_onFailure", "_onHalted", "_post"];

/// What editors and loggers write and we need not understand.
const EDITOR_ATTRIBUTES: [&str; 3] = ["_description", "_uid", "_fullpath"];

/// True if the attribute is a port: all others begin with an underscore or are `name` and `ID`.
pub(crate) fn is_port(attribute: &Attribute) -> bool {
    !attribute.name.starts_with('_') && attribute.name != "name" && attribute.name != "ID"
}

/// Complains about attributes with an underscore that look like one of ours, misspelt. Others are an editor's business.
pub(crate) fn check_reserved(element: &Element, also_known: &[&str], mistakes: &mut Mistakes) {
    for attribute in element.attributes.iter().filter(|it| it.name.starts_with('_')) {
        let known = || CONDITION_ATTRIBUTES.iter().chain(also_known).copied();
        let name = attribute.name.as_str();
        if known().any(|it| it == name) || EDITOR_ATTRIBUTES.contains(&name) {
            continue;
        }
        if let Some(nearest) = mistakes.nearest(name, known()) {
            let mistake = Mistake::UnknownAttribute { attribute: name.to_owned(), nearest: Some(nearest) };
            mistakes.add(attribute.at, mistake);
        }
    }
}

/// The key in `{key}`; `{=}` is the key with the port's own name. `None` for a constant.
pub(crate) fn key_of<'a>(port: &'a str, text: &'a str) -> Option<&'a str> {
    let key = text.trim().strip_prefix('{')?.strip_suffix('}')?.trim();
    Some(if key == "=" { port } else { key })
}

pub(crate) fn is_usable_key(key: &str) -> bool {
    let name = key.strip_prefix('@').unwrap_or(key);
    !name.is_empty() && !name.contains(|c: char| c.is_whitespace() || c.is_control() || "{}@/".contains(c))
}

/// Binds the ports of one node.
pub(crate) struct Binder<'a> {
    pub(crate) scopes: &'a mut Scopes,
    pub(crate) scope: usize,
    pub(crate) mistakes: &'a mut Mistakes,
}

impl Binder<'_> {
    /// The bindings in the order of `declared`.
    pub(crate) fn bind(&mut self, element: &Element, tag: &str, declared: &[Port]) -> Vec<Binding> {
        for attribute in element.attributes.iter().filter(|it| is_port(it)) {
            if !declared.iter().any(|port| port.name == attribute.name) {
                let nearest = self.mistakes.nearest(&attribute.name, declared.iter().map(|port| port.name.as_str()));
                let (tag, port) = (tag.to_owned(), attribute.name.clone());
                self.mistakes.add(attribute.at, Mistake::UnknownPort { tag, port, nearest });
            }
        }
        declared.iter().map(|port| self.bind_one(element, tag, port)).collect()
    }

    fn bind_one(&mut self, element: &Element, tag: &str, port: &Port) -> Binding {
        let (text, at) = match (element.find(&port.name), &port.default) {
            (Some(attribute), _) => (attribute.value.as_str(), attribute.at),
            (None, Some(default)) => (default.as_str(), element.at),
            (None, None) if port.optional => return Binding::Unbound,
            (None, None) => {
                let (tag, ty) = (tag.to_owned(), port.ty.name().to_owned());
                let direction = if port.direction == Direction::InOut { "an inout port" } else { "an input" };
                self.mistakes.add(element.at, Mistake::MissingPort { tag, port: port.name.clone(), direction, ty });
                return Binding::Unbound;
            }
        };
        match key_of(&port.name, text) {
            Some(key) => self.bind_key(port, key, text, at),
            None => self.bind_constant(port, text, at),
        }
    }

    fn bind_key(&mut self, port: &Port, key: &str, text: &str, at: Place) -> Binding {
        if !is_usable_key(key) {
            self.mistakes.add(at, Mistake::BadKey { port: port.name.clone(), text: text.to_owned() });
            return Binding::Unbound;
        }
        let number = self.scopes.resolve(self.scope, key);
        let slot = &mut self.scopes.slots[number as usize];
        if port.direction == Direction::Input {
            slot.reads.push(at);
        } else {
            slot.is_written = true;
            slot.takes_anything |= port.ty == Type::Any;
        }
        declare(slot, port.ty, at, self.mistakes);
        Binding::Slot(number)
    }

    fn bind_constant(&mut self, port: &Port, text: &str, at: Place) -> Binding {
        let port_name = port.name.clone();
        if port.direction != Direction::Input {
            self.mistakes.add(at, Mistake::ConstantOutput { port: port_name, text: text.to_owned() });
            return Binding::Unbound;
        }
        match port.ty.parse(text) {
            Some(value) if !(port.fits)(&value) => {
                let (text, ty) = (text.to_owned(), format!("{} of the size this port takes", port.ty.name()));
                self.mistakes.add(at, Mistake::BadConstant { port: port_name, text, ty });
                Binding::Unbound
            }
            Some(value) => Binding::Constant(value),
            None => {
                let (text, ty) = (text.to_owned(), port.ty.name().to_owned());
                self.mistakes.add(at, Mistake::BadConstant { port: port_name, text, ty });
                Binding::Unbound
            }
        }
    }
}

/// Notes that somebody uses a key as a value of type `ty`.
pub(crate) fn declare(slot: &mut super::scope::Slot, ty: Type, at: Place, mistakes: &mut Mistakes) {
    match slot.declared {
        _ if ty == Type::Any => {}
        None => slot.declared = Some((ty, at)),
        Some((other, _)) if other == ty => {}
        Some((other, other_at)) => {
            let (key, found, other) = (slot.name.clone(), ty.name().to_owned(), other.name().to_owned());
            let other_at = mistakes.describe(other_at);
            mistakes.add(at, Mistake::KeyType { key, found, other, other_at });
        }
    }
}
