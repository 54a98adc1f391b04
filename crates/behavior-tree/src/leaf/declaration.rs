//! The declaration of a kind of leaf and of its ports.

use std::sync::Arc;

use crate::values::port_value::PortValue;
use crate::values::types::Type;
use crate::values::value::Value;
use crate::xml::element::Element;

/// The class of a leaf: what an editor calls it, and whether it remembers that it has finished.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeafClass {
    /// Asks a question. Asked again at every tick.
    Condition,
    /// Acts within one tick. Run again at every tick.
    SyncAction,
    /// Acts over several ticks. Once finished it keeps its result until its parent resets it.
    Action,
}

impl LeafClass {
    /// The element that an editor declares it with.
    pub(crate) const fn tag(self) -> &'static str {
        match self {
            LeafClass::Condition => "Condition",
            LeafClass::SyncAction | LeafClass::Action => "Action",
        }
    }
}

/// Which way a value travels through a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// The node reads it.
    Input,
    /// The node writes it.
    Output,
    /// The node reads and writes it.
    InOut,
}

impl Direction {
    /// The word in messages and in `input_port`, `output_port`, `inout_port`.
    pub(crate) const fn word(self) -> &'static str {
        match self {
            Direction::Input => "input",
            Direction::Output => "output",
            Direction::InOut => "inout",
        }
    }
}

/// One declared port.
#[derive(Clone, Debug)]
pub struct Port {
    pub(crate) name: Arc<str>,
    pub(crate) direction: Direction,
    pub(crate) ty: Type,
    pub(crate) default: Option<String>,
    /// The tree may leave the port out.
    pub(crate) optional: bool,
    pub(crate) description: String,
    /// False for a value of the right type that the Rust type cannot hold, such as 256 for a `u8`.
    pub(crate) fits: fn(&Value) -> bool,
}

impl Port {
    /// A port that the node reads a `T` from. The tree must give a constant or a key.
    pub fn input<T: PortValue>(name: &str) -> Self {
        Port { fits: fits::<T>, ..Port::of_type(name, Direction::Input, T::port_type()) }
    }

    /// A port that the node writes a `T` to. The tree may leave it out.
    pub fn output<T: PortValue>(name: &str) -> Self {
        Port { optional: true, ..Port::of_type(name, Direction::Output, T::port_type()) }
    }

    /// A port that the node reads and writes.
    pub fn inout<T: PortValue>(name: &str) -> Self {
        Port { fits: fits::<T>, ..Port::of_type(name, Direction::InOut, T::port_type()) }
    }

    pub(crate) fn of_type(name: &str, direction: Direction, ty: Type) -> Self {
        let (default, optional, description) = (None, false, String::new());
        Port { name: name.into(), direction, ty, default, optional, description, fits: |_| true }
    }

    /// What the port is connected to if the tree leaves it out: a constant, or a key in braces.
    pub fn default(mut self, text: &str) -> Self {
        self.default = Some(text.to_owned());
        self
    }

    /// A description for the author of a tree, exported to Groot2.
    pub fn describe(mut self, text: &str) -> Self {
        self.description = text.to_owned();
        self
    }

    /// The port in a `TreeNodesModel`.
    pub(crate) fn model(&self) -> Element {
        let mut element = Element::new(&format!("{}_port", self.direction.word())).attribute("name", &self.name);
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
