//! The blackboard, and what else the nodes of a tree share.

use std::sync::Arc;
use std::task::Waker;
use std::time::Duration;

use crate::cause::Cause;
use crate::fault::Fault;
use crate::value::Value;

/// What the nodes of one tree share during a tick.
pub(crate) struct Board {
    pub(crate) values: Vec<Option<Value>>,
    pub(crate) now: u64,
    /// The earliest time a node asked to be ticked at.
    pub(crate) deadline: u64,
    /// A node asked to be ticked again at once.
    pub(crate) again: bool,
    pub(crate) cause: Option<Cause>,
    /// Faults of trees that leaves hold, and how many more there were.
    pub(crate) held_faults: (Vec<Fault>, u64),
    /// What the expression of a condition compared last.
    pub(crate) compared: Option<(Value, Value)>,
    pub(crate) waker: Waker,
}

/// Where a port of one node leads.
#[derive(Clone, Debug)]
pub(crate) enum Binding {
    /// Left out by the tree.
    Unbound,
    /// A constant, already of the port's type.
    Constant(Value),
    /// A blackboard key, resolved.
    Slot(u32),
}

impl Binding {
    pub(crate) fn value<'a>(&'a self, values: &'a [Option<Value>]) -> Option<&'a Value> {
        match self {
            Binding::Unbound => None,
            Binding::Constant(value) => Some(value),
            Binding::Slot(slot) => values.get(*slot as usize)?.as_ref(),
        }
    }
}

/// A port of one node: its name in the kind's declaration and where it leads.
#[derive(Clone, Debug)]
pub(crate) struct BoundPort {
    pub(crate) name: Arc<str>,
    pub(crate) binding: Binding,
}

pub(crate) fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}
