//! The description of a node, which a factory gets to build the leaf.

use std::fmt;
use std::task::Waker;

use super::declaration::{Direction, Port};
use super::port_error::PortError;
use super::ports::{In, Out};
use crate::board::{Binding, BoundPort};
use crate::values::port_value::PortValue;
use crate::values::types::Type;

/// One node of a tree, as its factory sees it.
pub struct NodeSpec<'a> {
    pub(crate) tag: &'a str,
    pub(crate) name: &'a str,
    pub(crate) declared: &'a [Port],
    pub(crate) bound: &'a [BoundPort],
    pub(crate) waker: &'a Waker,
}

impl NodeSpec<'_> {
    /// The kind of node: its tag in the tree file.
    pub fn tag(&self) -> &str {
        self.tag
    }

    /// The node's name: its `name` attribute, or its tag.
    pub fn name(&self) -> &str {
        self.name
    }

    /// A handle to read a port with.
    pub fn input<T: PortValue>(&self, port: &str) -> Result<In<T>, BuildError> {
        self.find(port, T::port_type(), Direction::Output).map(In::new)
    }

    /// A handle to write a port with.
    pub fn output<T: PortValue>(&self, port: &str) -> Result<Out<T>, BuildError> {
        self.find(port, T::port_type(), Direction::Input).map(Out::new)
    }

    /// The value of a port that the tree gives as a constant, or by default. `None` if it gives a key.
    pub fn constant<T: PortValue>(&self, port: &str) -> Result<Option<T>, BuildError> {
        let port = self.find(port, T::port_type(), Direction::Output)?;
        Ok(match &self.bound[port as usize].binding {
            Binding::Constant(value) => T::from_value(value),
            Binding::Slot(_) | Binding::Unbound => None,
        })
    }

    /// Wakes the caller that ticks the node's tree.
    pub fn waker(&self) -> &Waker {
        self.waker
    }

    /// The place of a port that is used as `ty` and must not have the direction `not`.
    fn find(&self, name: &str, ty: Type, not: Direction) -> Result<u32, BuildError> {
        let tag = self.tag;
        let position = self.declared.iter().position(|port| *port.name == *name);
        let Some(position) = position else {
            return Err(BuildError::new(format!("`{tag}` uses port `{name}`, which it does not declare")));
        };
        let port = &self.declared[position];
        if port.direction == not {
            let direction = not.word();
            return Err(BuildError::new(format!(
                "`{tag}` declares port `{name}` as {direction} and uses it otherwise"
            )));
        }
        if port.ty != ty && ty != Type::Any {
            let (declared, used) = (port.ty.name(), ty.name());
            return Err(BuildError::new(format!("`{tag}` declares port `{name}` as {declared} and uses it as {used}")));
        }
        Ok(position as u32)
    }
}

/// A factory refused to build its node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BuildError(String);

impl BuildError {
    /// With a sentence for the author of the tree.
    pub fn new(message: impl Into<String>) -> Self {
        BuildError(message.into())
    }
}

impl From<PortError> for BuildError {
    fn from(error: PortError) -> Self {
        BuildError::new(error.to_string())
    }
}

impl fmt::Display for BuildError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for BuildError {}
