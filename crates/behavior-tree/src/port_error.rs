//! A port that cannot be read.

use std::fmt;
use std::sync::Arc;

use crate::spec::BuildError;
use crate::value::Value;

/// A port could not be read.
#[derive(Clone, Debug, PartialEq)]
pub struct PortError {
    pub(crate) port: Arc<str>,
    pub(crate) problem: Problem,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Problem {
    Undeclared,
    Empty { key: Option<String> },
    Misfit { value: Value, wanted: &'static str },
}

impl fmt::Display for PortError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let port = &self.port;
        match &self.problem {
            Problem::Undeclared => write!(f, "port `{port}` is not declared by this kind of node"),
            Problem::Empty { key: Some(key) } => write!(f, "port `{port}`: nothing has been written to `{key}` yet"),
            Problem::Empty { key: None } => write!(f, "port `{port}` was left out in the tree"),
            Problem::Misfit { value, wanted } => write!(f, "port `{port}` holds `{value}`, which is no {wanted}"),
        }
    }
}

impl std::error::Error for PortError {}

impl From<PortError> for BuildError {
    fn from(error: PortError) -> Self {
        BuildError::new(error.to_string())
    }
}
