//! A port that cannot be read.

use std::fmt;
use std::sync::Arc;

use crate::values::value::Value;

/// A port could not be read or written.
#[derive(Clone, Debug, PartialEq)]
pub struct PortError {
    pub(crate) port: Arc<str>,
    pub(crate) problem: Problem,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Problem {
    Undeclared,
    Unconnected,
    Empty { key: String },
    WrongType { expected: &'static str, found: Value },
}

impl fmt::Display for PortError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "port `{}`", self.port)?;
        match &self.problem {
            Problem::Undeclared => f.write_str(" is not declared by this kind of node"),
            Problem::Unconnected => f.write_str(" is left out in the tree"),
            Problem::Empty { key } => write!(f, ": key `{key}` has no value yet"),
            Problem::WrongType { expected, found } => write!(f, ": expected {expected}, found `{found}`"),
        }
    }
}

impl std::error::Error for PortError {}
