//! What a kind of node declares about its ports.

use crate::port_value::PortValue;
use crate::types::Type;
use crate::value::Value;
use crate::xml::element::Element;

/// Which way a value travels through a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// The node reads it.
    Input,
    /// The node writes it.
    Output,
    /// The node does both.
    InOut,
}

/// One declared port.
#[derive(Clone, Debug)]
pub struct Port {
    pub(crate) name: String,
    pub(crate) direction: Direction,
    pub(crate) ty: Type,
    pub(crate) default: Option<String>,
    pub(crate) optional: bool,
    pub(crate) description: String,
    /// False for a value of the right type that the Rust type cannot hold, such as 256 in a `u8`.
    pub(crate) fits: fn(&Value) -> bool,
}

impl Port {
    /// A port the node reads a `T` from. A tree must give it a constant or a key.
    pub fn input<T: PortValue>(name: &str) -> Self {
        Port { fits: fits::<T>, ..Port::of_type(name, Direction::Input, T::port_type()) }
    }

    /// A port the node writes a `T` to. A tree may leave it out.
    pub fn output<T: PortValue>(name: &str) -> Self {
        Port { optional: true, ..Port::of_type(name, Direction::Output, T::port_type()) }
    }

    /// A port the node reads and writes.
    pub fn inout<T: PortValue>(name: &str) -> Self {
        Port { fits: fits::<T>, ..Port::of_type(name, Direction::InOut, T::port_type()) }
    }

    pub(crate) fn of_type(name: &str, direction: Direction, ty: Type) -> Self {
        let (default, optional, description) = (None, false, String::new());
        Port { name: name.to_owned(), direction, ty, default, optional, description, fits: |_| true }
    }

    /// What the port holds when a tree does not say: a constant, or a key in braces.
    pub fn default(mut self, text: &str) -> Self {
        self.default = Some(text.to_owned());
        self
    }

    /// A tree may leave the port out; reading it then answers `None`.
    pub fn optional(mut self) -> Self {
        self.optional = true;
        self
    }

    /// A sentence for whoever edits a tree; exported to Groot2.
    pub fn describe(mut self, text: &str) -> Self {
        self.description = text.to_owned();
        self
    }

    /// What a `TreeNodesModel` says of it.
    pub(crate) fn model(&self) -> Element {
        let tag = match self.direction {
            Direction::Input => "input_port",
            Direction::Output => "output_port",
            Direction::InOut => "inout_port",
        };
        let mut element = Element::new(tag).attribute("name", &self.name);
        if self.ty != Type::Any {
            element = element.attribute("type", self.ty.name());
        }
        if let Some(default) = &self.default {
            element = element.attribute("default", default);
        }
        element.text = self.description.clone();
        element
    }
}

fn fits<T: PortValue>(value: &Value) -> bool {
    T::from_value(value).is_some()
}
