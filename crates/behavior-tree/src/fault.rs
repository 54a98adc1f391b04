//! Errors and panics of leaves, contained.

use std::any::Any;
use std::fmt;
use std::time::Duration;

use crate::tree::NodeId;

/// A leaf, or a node's expression, went wrong. Its node answered failure and the tree lives on.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// The node; of a fault in a tree that a leaf holds, that leaf.
    pub node: NodeId,
    /// The node's name, with the names of the subtrees it is in before it: `landing/Descend`. If it is in a tree that a
    /// leaf holds, the leaf's path stands before it: `Executor > Fly`.
    pub path: String,
    /// The time of the tick.
    pub at: Duration,
    /// What happened.
    pub kind: FaultKind,
}

/// What went wrong in a node.
#[derive(Clone, Debug, PartialEq)]
pub enum FaultKind {
    /// A leaf returned an error; its whole chain of causes is in the text.
    Error(String),
    /// A leaf panicked, with this message.
    Panic(String),
    /// A condition answered running, which only actions may.
    RunningCondition,
    /// A port of a built-in node held no usable number.
    Port(String),
    /// An expression could not be computed.
    Expression(String),
}

/// What a tree does about a fault, besides failing the node and recording it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FaultPolicy {
    /// The node's parent deals with the failure like with any other.
    #[default]
    FailNode,
    /// The whole tree is halted and answers failure.
    HaltTree,
}

impl fmt::Display for FaultKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FaultKind::Error(text) | FaultKind::Port(text) | FaultKind::Expression(text) => f.write_str(text),
            FaultKind::Panic(text) => write!(f, "panicked: {text}"),
            FaultKind::RunningCondition => f.write_str("a condition answered running"),
        }
    }
}

/// The message of a caught panic.
pub(crate) fn panic_message(payload: &(dyn Any + Send)) -> String {
    if let Some(text) = payload.downcast_ref::<&str>() {
        (*text).to_owned()
    } else if let Some(text) = payload.downcast_ref::<String>() {
        text.clone()
    } else {
        "no message".to_owned()
    }
}

/// An error and its causes on one line.
pub(crate) fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        text.push_str(": ");
        text.push_str(&cause.to_string());
        source = cause.source();
    }
    text
}
