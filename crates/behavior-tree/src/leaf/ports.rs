//! What a leaf can do during a tick: read and write its ports, ask for the next tick, give the reason of a failure.

use std::marker::PhantomData;
use std::sync::Arc;
use std::task::Waker;
use std::time::Duration;

use super::port_error::{PortError, Problem};
use crate::board::{Binding, Board, BoundPort};
use crate::node_id::NodeId;
use crate::record::cause::{Cause, SharedText};
use crate::record::failures::Failures;
use crate::schedule::nanoseconds;
use crate::values::port_value::PortValue;
use crate::values::value::Value;

/// A resolved input port of a leaf: reading it needs no look-up.
#[derive(Debug)]
pub struct In<T> {
    port: u32,
    of: PhantomData<fn() -> T>,
}

/// A resolved output port of a leaf.
#[derive(Debug)]
pub struct Out<T> {
    port: u32,
    of: PhantomData<fn(T)>,
}

impl<T> In<T> {
    /// The port at this place in the declaration.
    pub(crate) fn new(port: u32) -> Self {
        In { port, of: PhantomData }
    }
}

impl<T> Out<T> {
    /// The port at this place in the declaration.
    pub(crate) fn new(port: u32) -> Self {
        Out { port, of: PhantomData }
    }
}

impl<T> Clone for In<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for In<T> {}

impl<T> Clone for Out<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Out<T> {}

/// What a leaf has besides its `Ctx`: ports, time, wake-ups.
pub struct Ports<'a> {
    pub(crate) bound: &'a [BoundPort],
    /// The names of the keys, by slot.
    pub(crate) keys: &'a [String],
    pub(crate) board: &'a mut Board,
    pub(crate) failures: &'a Failures,
}

impl Ports<'_> {
    /// The value of an input port. An error if its key has no value yet.
    pub fn read<T: PortValue>(&self, port: In<T>) -> Result<T, PortError> {
        self.read_at(port.port as usize)
    }

    /// Writes an output port. The value is dropped if the tree leaves the port out.
    pub fn write<T: PortValue>(&mut self, port: Out<T>, value: T) {
        self.write_at(port.port as usize, value.into_value());
    }

    /// The value of the input port called `name`: [`Ports::read`] with a look-up, for closures.
    pub fn get<T: PortValue>(&self, name: &str) -> Result<T, PortError> {
        self.read_at(self.position(name)?)
    }

    /// Writes the output port called `name`: [`Ports::write`] with a look-up, for closures.
    pub fn set<T: PortValue>(&mut self, name: &str, value: T) -> Result<(), PortError> {
        let port = self.position(name)?;
        self.write_at(port, value.into_value());
        Ok(())
    }

    /// The time of this tick, as its caller gave it.
    pub fn now(&self) -> Duration {
        Duration::from_nanos(self.board.now)
    }

    /// Asks for another tick at once, because this leaf changed something that other nodes should see before the
    /// effects of the tick are sent.
    pub fn tick_again(&mut self) {
        self.board.schedule.tick_again();
    }

    /// Asks for a tick at `time` on the clock of [`Ports::now`]: nothing changes for this leaf before that time.
    pub fn tick_at(&mut self, time: Duration) {
        self.board.schedule.tick_at(nanoseconds(time));
    }

    /// Wakes the caller that ticks this tree. Give it to the task or thread that will have a result for this leaf.
    pub fn waker(&self) -> &Waker {
        &self.board.waker
    }

    /// Names the condition that did not hold, before this leaf returns failure: `battery above reserve`, the value
    /// found, and the limit or value expected. Kept with the node, see
    /// [`Tree::last_failure`](crate::Tree::last_failure).
    pub fn because(&mut self, condition: impl Into<SharedText>, value: impl Into<Value>, threshold: impl Into<Value>) {
        let (condition, value, threshold) = (condition.into(), Some(value.into()), Some(threshold.into()));
        self.board.cause = Some(Cause::Unmet { condition, value, threshold });
    }

    /// [`Ports::because`] where there is nothing to compare.
    pub fn because_of(&mut self, condition: impl Into<SharedText>) {
        self.board.cause = Some(Cause::Unmet { condition: condition.into(), value: None, threshold: None });
    }

    /// Gives the reason of a failure as a sentence, before this leaf returns failure: what happened, not what was
    /// expected.
    pub fn explain(&mut self, reason: impl Into<SharedText>) {
        self.board.cause = Some(Cause::Happened(reason.into()));
    }

    /// Why the node that decided the latest failure in this tree failed, if a reason is known. For a leaf that
    /// handles the failure of the sibling before it in a `Fallback`.
    pub fn last_failure(&self) -> Option<&Cause> {
        self.failures.why(NodeId::new(self.failures.decider())).map(|record| &record.cause)
    }

    fn position(&self, name: &str) -> Result<usize, PortError> {
        let position = self.bound.iter().position(|port| &*port.name == name);
        position.ok_or_else(|| PortError { port: name.into(), problem: Problem::Undeclared })
    }

    fn read_at<T: PortValue>(&self, port: usize) -> Result<T, PortError> {
        let error = |name: &Arc<str>, problem| Err(PortError { port: name.clone(), problem });
        let BoundPort { name, binding } = &self.bound[port];
        match binding.value(&self.board.values) {
            Some(value) => match T::from_value(value) {
                Some(value) => Ok(value),
                None => error(name, Problem::WrongType { expected: T::port_type().name(), found: value.clone() }),
            },
            None => match binding {
                Binding::Slot(slot) => error(name, Problem::Empty { key: self.keys[*slot as usize].clone() }),
                _ => error(name, Problem::Unconnected),
            },
        }
    }

    #[inline]
    fn write_at(&mut self, port: usize, value: Value) {
        if let Binding::Slot(slot) = self.bound[port].binding {
            self.board.values[slot as usize] = Some(value);
        }
    }
}
