//! The blackboard, and the other data that the nodes of a tree share during a tick.

use std::sync::Arc;
use std::task::Waker;

use crate::record::cause::Cause;
use crate::record::error::NodeErrors;
use crate::schedule::Schedule;
use crate::values::types::Type;
use crate::values::value::Value;

/// A key of the blackboard, as declared by the tree.
#[derive(Clone, Debug)]
pub(crate) struct SlotDef {
    pub(crate) ty: Type,
    pub(crate) initial: Option<Value>,
    /// An instance needs a value for it.
    pub(crate) required: bool,
    /// It can be set from outside.
    pub(crate) open: bool,
}

/// What the nodes of one tree share during a tick.
pub(crate) struct Board {
    /// The values of the keys, by slot.
    pub(crate) values: Vec<Option<Value>>,
    /// The time of the tick in nanoseconds.
    pub(crate) now: u64,
    pub(crate) schedule: Schedule,
    /// The reason for its failure that the called leaf has given.
    pub(crate) cause: Option<Cause>,
    /// The errors of the tree that the called leaf holds.
    pub(crate) held_errors: NodeErrors,
    pub(crate) waker: Waker,
}

impl Board {
    pub(crate) fn new(values: Vec<Option<Value>>, waker: Waker) -> Self {
        Board { values, now: 0, schedule: Schedule::EMPTY, cause: None, held_errors: NodeErrors::default(), waker }
    }
}

/// What a port of one node is connected to.
#[derive(Clone, Debug)]
pub(crate) enum Binding {
    /// Nothing: the tree leaves the port out.
    Unbound,
    /// A constant of the port's type.
    Constant(Value),
    /// A blackboard key.
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

/// A port of one node: its declared name and what it is connected to.
#[derive(Clone, Debug)]
pub(crate) struct BoundPort {
    pub(crate) name: Arc<str>,
    pub(crate) binding: Binding,
}
