//! Errors of nodes: errors and panics of leaves, and expressions that cannot be computed.

use std::any::Any;
use std::error::Error;
use std::fmt;
use std::time::Duration;

use crate::node_id::NodeId;

/// An error of a leaf, or of a node's expression. The node failed, and the tree goes on.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeError {
    /// The node. For an error in a tree that a leaf holds, that leaf.
    pub node: NodeId,
    /// The node's name after the names of the subtrees it is in: `landing/Descend`. In a tree that a leaf holds, the
    /// leaf's path comes first: `Executor > Fly`.
    pub path: String,
    /// The time of the tick.
    pub at: Duration,
    /// What happened.
    pub kind: NodeErrorKind,
}

/// The kind of an error.
#[derive(Clone, Debug, PartialEq)]
pub enum NodeErrorKind {
    /// A leaf returned an error. The text includes the error's sources.
    Returned(String),
    /// A leaf panicked with this message.
    Panic(String),
    /// A condition returned running, which only actions may.
    RunningCondition,
    /// A port of a built-in node held no usable number.
    Port(String),
    /// An expression could not be computed.
    Expression(String),
}

impl NodeErrorKind {
    /// From an error that a leaf returned.
    pub(crate) fn returned(error: &dyn Error) -> Self {
        let mut text = error.to_string();
        let mut source = error.source();
        while let Some(error) = source {
            text = format!("{text}: {error}");
            source = error.source();
        }
        NodeErrorKind::Returned(text)
    }

    /// From what [`std::panic::catch_unwind`] caught.
    pub(crate) fn panic(payload: &(dyn Any + Send)) -> Self {
        let static_text = payload.downcast_ref::<&str>().copied();
        let text = static_text.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
        NodeErrorKind::Panic(text.unwrap_or("no message").to_owned())
    }
}

impl fmt::Display for NodeErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NodeErrorKind::Returned(text) | NodeErrorKind::Port(text) | NodeErrorKind::Expression(text) => {
                f.write_str(text)
            }
            NodeErrorKind::Panic(text) => write!(f, "panicked: {text}"),
            NodeErrorKind::RunningCondition => f.write_str("a condition returned running"),
        }
    }
}

/// Errors kept until the caller takes them. A leaf that returns an error at every tick must not fill the memory.
const MAX_ERRORS: usize = 64;

/// The errors of one tree since the last [`NodeErrors::take`].
#[derive(Default)]
pub(crate) struct NodeErrors {
    kept: Vec<NodeError>,
    /// The number of errors that were dropped.
    lost: u64,
}

impl NodeErrors {
    pub(crate) fn push(&mut self, error: NodeError) {
        if self.kept.len() < MAX_ERRORS {
            self.kept.push(error);
        } else {
            self.lost += 1;
        }
    }

    /// Moves the errors of `held` here, each as `adopted` makes it.
    pub(crate) fn adopt(&mut self, held: &mut NodeErrors, adopted: impl Fn(NodeError) -> NodeError) {
        if !held.kept.is_empty() {
            let (kept, lost) = held.take();
            self.lost += lost;
            kept.into_iter().map(adopted).for_each(|error| self.push(error));
        }
    }

    pub(crate) fn as_slice(&self) -> &[NodeError] {
        &self.kept
    }

    /// The oldest errors, and the number of errors that were dropped.
    pub(crate) fn take(&mut self) -> (Vec<NodeError>, u64) {
        (std::mem::take(&mut self.kept), std::mem::take(&mut self.lost))
    }
}
