//! Why a node failed, as data.

use std::fmt;
use std::ops::Deref;
use std::sync::Arc;
use std::time::Duration;

use crate::values::value::Value;

/// Why a node failed. Displayed as an English sentence.
#[derive(Clone, Debug, PartialEq)]
pub enum Cause {
    /// A condition did not hold, see [`Ports::because`](crate::Ports::because).
    Unmet {
        /// What should have been true, such as `battery above reserve`.
        condition: SharedText,
        /// The value found.
        value: Option<Value>,
        /// The value or limit that was expected.
        threshold: Option<Value>,
    },
    /// An expression in the tree file decided.
    Expression {
        /// The expression as written.
        text: SharedText,
        /// Whether it was true. A `_failureIf` fails its node when it is.
        holds: bool,
        /// The two sides of the last comparison, if there was one.
        compared: Option<(Value, Value)>,
    },
    /// Something happened: an error, a panic, a time limit, or what [`Ports::explain`](crate::Ports::explain) says.
    Happened(SharedText),
}

/// Why and when a node failed.
#[derive(Clone, Debug, PartialEq)]
pub struct FailureRecord {
    /// The time of the tick.
    pub at: Duration,
    /// Why.
    pub cause: Cause,
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Cause::Unmet { condition, value, threshold } => {
                write!(f, "not met: {}", &**condition)?;
                match (value, threshold) {
                    (Some(value), Some(limit @ (Value::Int(_) | Value::Float(_)))) => {
                        write!(f, " (found {value}, limit {limit})")
                    }
                    (Some(value), Some(expected)) => write!(f, " (found {value}, expected {expected})"),
                    (Some(value), None) => write!(f, " (found {value})"),
                    (None, Some(expected)) => write!(f, " (expected {expected})"),
                    (None, None) => Ok(()),
                }
            }
            Cause::Expression { text, holds, compared } => {
                write!(f, "`{}` is {holds}", &**text)?;
                match compared {
                    Some((left, right)) => write!(f, " (compared {left} with {right})"),
                    None => Ok(()),
                }
            }
            Cause::Happened(text) => f.write_str(text),
        }
    }
}

/// Text of the program or of a tree file. Cloning copies nothing.
#[derive(Clone)]
pub struct SharedText(Source);

#[derive(Clone)]
enum Source {
    Program(&'static str),
    Made(Arc<str>),
}

impl Deref for SharedText {
    type Target = str;

    fn deref(&self) -> &str {
        match &self.0 {
            Source::Program(text) => text,
            Source::Made(text) => text,
        }
    }
}

impl From<&'static str> for SharedText {
    fn from(text: &'static str) -> Self {
        SharedText(Source::Program(text))
    }
}

impl From<Arc<str>> for SharedText {
    fn from(text: Arc<str>) -> Self {
        SharedText(Source::Made(text))
    }
}

impl From<String> for SharedText {
    fn from(text: String) -> Self {
        SharedText(Source::Made(text.into()))
    }
}

impl fmt::Debug for SharedText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&**self, f)
    }
}

impl PartialEq for SharedText {
    fn eq(&self, other: &SharedText) -> bool {
        **self == **other
    }
}
