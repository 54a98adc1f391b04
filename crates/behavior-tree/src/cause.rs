//! Why a node failed, as data.

use std::fmt;
use std::ops::Deref;
use std::sync::Arc;
use std::time::Duration;

use crate::value::Value;

/// The reason a node gave for a failure: the condition that did not hold, the value it had and the limit it missed.
#[derive(Clone, Debug, PartialEq)]
pub struct Cause {
    /// What was asked, such as `battery above reserve` or the text of a `_failureIf`.
    pub condition: Words,
    /// The value found.
    pub value: Option<Value>,
    /// The value it was compared with.
    pub threshold: Option<Value>,
}

/// A text written in the program or in a tree file; recording it copies nothing.
#[derive(Clone)]
pub struct Words(Source);

#[derive(Clone)]
enum Source {
    Program(&'static str),
    File(Arc<str>),
}

impl Deref for Words {
    type Target = str;

    fn deref(&self) -> &str {
        match &self.0 {
            Source::Program(text) => text,
            Source::File(text) => text,
        }
    }
}

impl From<Arc<str>> for Words {
    fn from(text: Arc<str>) -> Self {
        Words(Source::File(text))
    }
}

impl From<String> for Words {
    fn from(text: String) -> Self {
        Words(Source::File(text.into()))
    }
}

impl fmt::Debug for Words {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&**self, f)
    }
}

impl PartialEq for Words {
    fn eq(&self, other: &Words) -> bool {
        **self == **other
    }
}

/// A [`Cause`] and when it was recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct FailureRecord {
    /// The time of the tick.
    pub at: Duration,
    /// What the node said.
    pub cause: Cause,
}

impl Cause {
    pub(crate) fn new(condition: &'static str, value: Option<Value>, threshold: Option<Value>) -> Self {
        Cause { condition: Words(Source::Program(condition)), value, threshold }
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.condition)?;
        match (&self.value, &self.threshold) {
            (Some(value), Some(threshold)) => write!(f, " (is {value}, limit {threshold})"),
            (Some(value), None) => write!(f, " (is {value})"),
            (None, Some(threshold)) => write!(f, " (limit {threshold})"),
            (None, None) => Ok(()),
        }
    }
}
