//! What a factory is told about the node it is to build.

use std::fmt;
use std::marker::PhantomData;
use std::task::Waker;

use crate::board::{Binding, BoundPort};
use crate::port_list::{Direction, Port};
use crate::port_value::PortValue;
use crate::ports::{In, Out};
use crate::types::Type;

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

    /// A handle for reading a port.
    pub fn input<T: PortValue>(&self, port: &str) -> Result<In<T>, BuildError> {
        let port = self.find(port, T::port_type(), Direction::Output)?;
        Ok(In { port, of: PhantomData })
    }

    /// A handle for writing a port.
    pub fn output<T: PortValue>(&self, port: &str) -> Result<Out<T>, BuildError> {
        let port = self.find(port, T::port_type(), Direction::Input)?;
        Ok(Out { port, of: PhantomData })
    }

    /// The value of a port that the tree gave as a constant, or by default; `None` if it is a key or was left out.
    pub fn constant<T: PortValue>(&self, port: &str) -> Result<Option<T>, BuildError> {
        let port = self.find(port, T::port_type(), Direction::Output)?;
        Ok(match self.bound.get(port as usize).map(|it| &it.binding) {
            Some(Binding::Constant(value)) => T::from_value(value),
            _ => None,
        })
    }

    /// Wakes whoever ticks the tree this node belongs to.
    pub fn waker(&self) -> &Waker {
        self.waker
    }

    fn find(&self, name: &str, ty: Type, not: Direction) -> Result<u32, BuildError> {
        let position = self.declared.iter().position(|port| port.name == name);
        let Some(position) = position else {
            return Err(BuildError::new(format!("`{}` asks for port `{name}`, which it did not declare", self.tag)));
        };
        let port = &self.declared[position];
        if port.direction == not {
            return Err(BuildError::new(format!("`{}` uses port `{name}` against its declared direction", self.tag)));
        }
        if port.ty != ty && ty != Type::Any {
            let (declared, used) = (port.ty.name(), ty.name());
            return Err(BuildError::new(format!(
                "`{}` declares port `{name}` as {declared} and uses it as {used}",
                self.tag
            )));
        }
        Ok(position as u32)
    }
}

/// A factory refused to build its node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BuildError(String);

impl BuildError {
    /// With a sentence for whoever wrote the tree.
    pub fn new(message: impl Into<String>) -> Self {
        BuildError(message.into())
    }
}

impl fmt::Display for BuildError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for BuildError {}
