//! The ports of one node, bound to constants and keys.

use super::keys::{Keys, is_valid_key, key_of};
use super::mistake::Mistake;
use super::mistakes::Mistakes;
use crate::board::Binding;
use crate::leaf::declaration::{Direction, Port};
use crate::xml::source::{Place, SourceAttribute, SourceElement};

/// True if the attribute is a port. All others begin with an underscore or are `name` and `ID`.
pub(super) fn is_port(attribute: &SourceAttribute<'_>) -> bool {
    !attribute.name.starts_with('_') && attribute.name != "name" && attribute.name != "ID"
}

/// Binds the ports of the nodes in one scope.
pub(super) struct Binder<'a> {
    pub(super) keys: &'a mut Keys,
    pub(super) scope: usize,
    pub(super) mistakes: &'a mut Mistakes,
}

impl Binder<'_> {
    /// The bindings of one node, in the order of `declared`.
    pub(super) fn bind(&mut self, element: SourceElement<'_>, tag: &str, declared: &[Port]) -> Vec<Binding> {
        for attribute in element.attributes().filter(is_port) {
            if !declared.iter().any(|port| *port.name == *attribute.name) {
                let nearest = self.mistakes.nearest(attribute.name, declared.iter().map(|port| &*port.name));
                let (tag, port) = (tag.to_owned(), attribute.name.to_owned());
                self.mistakes.add(attribute.at, Mistake::UnknownPort { tag, port, nearest });
            }
        }
        declared.iter().map(|port| self.bind_port(element, tag, port)).collect()
    }

    fn bind_port(&mut self, element: SourceElement<'_>, tag: &str, port: &Port) -> Binding {
        let (text, at) = match (element.find(&port.name), &port.default) {
            (Some(attribute), _) => (attribute.value, attribute.at),
            (None, Some(default)) => (default.as_str(), element.at()),
            (None, None) => {
                if !port.optional {
                    self.mistakes.add(element.at(), missing(tag, port));
                }
                return Binding::Unbound;
            }
        };
        let bound = match key_of(&port.name, text) {
            Some(key) => self.bind_key(port, key, text, at),
            None => bind_constant(port, text),
        };
        bound.unwrap_or_else(|mistake| {
            self.mistakes.add(at, mistake);
            Binding::Unbound
        })
    }

    fn bind_key(&mut self, port: &Port, key: &str, text: &str, at: Place) -> Result<Binding, Mistake> {
        if !is_valid_key(key) {
            return Err(Mistake::BadKey { port: port.name.to_string(), text: text.to_owned() });
        }
        let slot = self.keys.resolve(self.scope, key);
        let slots = &mut self.keys.slots;
        match port.direction {
            Direction::Input => slots.note_read(slot, at),
            Direction::Output | Direction::InOut => slots.note_write(slot, port.ty),
        }
        slots.declare(slot, port.ty, at, self.mistakes);
        Ok(Binding::Slot(slot))
    }
}

fn bind_constant(port: &Port, text: &str) -> Result<Binding, Mistake> {
    let (name, found) = (port.name.to_string(), text.to_owned());
    if port.direction != Direction::Input {
        return Err(Mistake::ConstantOutput { port: name, found });
    }
    let ty = port.ty.name();
    match port.ty.parse(text) {
        Some(value) if (port.fits)(&value) => Ok(Binding::Constant(value)),
        Some(_) => Err(Mistake::BadConstant { port: name, expected: format!("{ty} in the port's range"), found }),
        None => Err(Mistake::BadConstant { port: name, expected: ty.to_owned(), found }),
    }
}

/// A port without default is left out.
pub(super) fn missing(tag: &str, port: &Port) -> Mistake {
    let (direction, ty) = (port.direction.word(), port.ty.name());
    Mistake::MissingPort { tag: tag.to_owned(), port: port.name.to_string(), direction, ty }
}
