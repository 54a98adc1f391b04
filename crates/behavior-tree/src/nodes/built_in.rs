//! The declarations of built-in nodes.

use std::ops::RangeInclusive;

use crate::kind::{Kind, Param};
use crate::leaf::declaration::{Direction, Port};
use crate::script::Purpose;
use crate::status::Status;
use crate::values::types::Type;
use crate::xml::element::Element;

/// The declaration of a built-in node.
pub(crate) struct BuiltIn {
    pub(crate) tag: &'static str,
    pub(crate) class: Class,
    pub(crate) children: RangeInclusive<usize>,
    pub(crate) ports: &'static [BuiltInPort],
    /// Makes the kind from the values of the ports.
    pub(crate) kind: fn(&Arguments) -> Kind,
    /// A node that is halted goes on where it was; others start from the beginning.
    pub(crate) keeps_place: bool,
}

/// What an editor calls a built-in node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Class {
    Control,
    Decorator,
    SubTree,
    Action,
    Condition,
}

/// No upper limit to the number of children.
const MANY: usize = usize::MAX;

impl BuiltIn {
    pub(super) const fn new(tag: &'static str, class: Class, kind: fn(&Arguments) -> Kind) -> Self {
        let children = match class {
            Class::Control => 1..=MANY,
            Class::Decorator => 1..=1,
            Class::SubTree | Class::Action | Class::Condition => 0..=0,
        };
        BuiltIn { tag, class, children, ports: &[], kind, keeps_place: false }
    }

    pub(super) const fn with_children(self, children: RangeInclusive<usize>) -> Self {
        BuiltIn { children, ..self }
    }

    pub(super) const fn with_ports(self, ports: &'static [BuiltInPort]) -> Self {
        BuiltIn { ports, ..self }
    }

    pub(super) const fn keeping_its_place(self) -> Self {
        BuiltIn { keeps_place: true, ..self }
    }

    /// True for nodes with exactly one child, whose status they reset as soon as it has finished.
    pub(crate) fn is_decorator(&self) -> bool {
        matches!(self.class, Class::Decorator | Class::SubTree)
    }

    /// The node in a `TreeNodesModel`.
    pub(crate) fn model(&self) -> Element {
        let ports = self.ports.iter().map(|port| port.to_port().model());
        Element::new(self.class.tag()).attribute("ID", self.tag).children(ports)
    }
}

impl Class {
    /// The element that an editor declares it with.
    pub(crate) const fn tag(self) -> &'static str {
        match self {
            Class::Control => "Control",
            Class::Decorator => "Decorator",
            Class::SubTree => "SubTree",
            Class::Action => "Action",
            Class::Condition => "Condition",
        }
    }
}

/// The values of the ports of one node.
pub(crate) struct Arguments {
    /// Those of the ports that hold numbers, in the order of the declaration.
    pub(crate) numbers: Vec<Param>,
    /// Index into [`Shape::scripts`](crate::shape::Shape).
    pub(crate) script: u32,
    pub(crate) status: Status,
    /// The values of the node's ports, as an index into [`Shape::switches`](crate::shape::Shape).
    pub(crate) table: u32,
}

/// The declaration of a port of a built-in node.
pub(crate) struct BuiltInPort {
    pub(crate) name: &'static str,
    pub(crate) holds: Holds,
    pub(crate) default: Option<&'static str>,
    pub(crate) description: &'static str,
}

/// What a port of a built-in node holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Holds {
    Number {
        min: i32,
    },
    /// A number of children; negative ones count from the end.
    Count,
    Flag,
    /// An expression, which is written in the tree and not in a key.
    Script(Purpose),
    /// `SUCCESS`, `FAILURE`, `SKIPPED` or `RUNNING`.
    Status,
    /// A value of any type, for [`Arguments::table`].
    Value,
}

impl BuiltInPort {
    pub(super) const fn new(name: &'static str, holds: Holds, description: &'static str) -> Self {
        BuiltInPort { name, holds, default: None, description }
    }

    pub(super) const fn milliseconds(name: &'static str, description: &'static str) -> Self {
        BuiltInPort::new(name, Holds::Number { min: 0 }, description)
    }

    pub(super) const fn with_default(self, default: &'static str) -> Self {
        BuiltInPort { default: Some(default), ..self }
    }

    pub(crate) fn holds_value(&self) -> bool {
        self.holds == Holds::Value
    }

    pub(crate) fn to_port(&self) -> Port {
        let ty = match self.holds {
            Holds::Number { .. } | Holds::Count => Type::Int,
            Holds::Flag => Type::Bool,
            Holds::Script(_) | Holds::Status => Type::Text,
            Holds::Value => Type::Any,
        };
        let mut port = Port::of_type(self.name, Direction::Input, ty).describe(self.description);
        port.default = self.default.map(str::to_owned);
        port
    }
}
