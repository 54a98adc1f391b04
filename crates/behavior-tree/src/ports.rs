//! What a leaf can do during a tick: read and write its ports, ask for the next tick, say why it failed.

use std::marker::PhantomData;
use std::task::Waker;
use std::time::Duration;

use crate::board::{Binding, Board, BoundPort, nanoseconds};
use crate::cause::Cause;
use crate::port_error::{PortError, Problem};
use crate::port_value::PortValue;
use crate::status::Status;
use crate::tree::{NextTick, Tree};
use crate::value::Value;

/// An input port of a leaf, resolved: reading through it looks nothing up.
#[derive(Debug)]
pub struct In<T> {
    pub(crate) port: u32,
    pub(crate) of: PhantomData<fn() -> T>,
}

/// An output port of a leaf, resolved.
#[derive(Debug)]
pub struct Out<T> {
    pub(crate) port: u32,
    pub(crate) of: PhantomData<fn(T)>,
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

/// The world of a leaf besides its `Ctx`: ports, time, wake-ups.
pub struct Ports<'a> {
    pub(crate) bound: &'a [BoundPort],
    pub(crate) names: &'a [String],
    pub(crate) board: &'a mut Board,
}

impl Ports<'_> {
    /// The value of an input port. An error if the port was left out or nothing has been written to its key yet.
    pub fn read<T: PortValue>(&self, port: In<T>) -> Result<T, PortError> {
        self.read_at(port.port as usize)
    }

    /// The value of an input port, or `None` if it was left out or nothing has been written to its key yet.
    pub fn read_optional<T: PortValue>(&self, port: In<T>) -> Option<T> {
        self.value_at(port.port as usize).and_then(T::from_value)
    }

    /// Writes an output port. A port the tree left out swallows the value.
    pub fn write<T: PortValue>(&mut self, port: Out<T>, value: T) {
        self.write_at(port.port as usize, value.into_value());
    }

    /// The value of the input port called `name`: [`Ports::read`] with a look-up, for closures.
    pub fn get<T: PortValue>(&self, name: &str) -> Result<T, PortError> {
        match self.position(name) {
            Some(port) => self.read_at(port),
            None => Err(PortError { port: name.into(), problem: Problem::Undeclared }),
        }
    }

    /// Writes the output port called `name`: [`Ports::write`] with a look-up, for closures.
    pub fn set<T: PortValue>(&mut self, name: &str, value: T) -> Result<(), PortError> {
        match self.position(name) {
            Some(port) => {
                self.write_at(port, value.into_value());
                Ok(())
            }
            None => Err(PortError { port: name.into(), problem: Problem::Undeclared }),
        }
    }

    /// The time of this tick, as the caller of the tick gave it.
    pub fn now(&self) -> Duration {
        Duration::from_nanos(self.board.now)
    }

    /// Something changed that other nodes should see before effects are sent: tick the tree again at once.
    pub fn tick_again(&mut self) {
        self.board.again = true;
    }

    /// Nothing will change for this leaf before `time` (on the clock of [`Ports::now`]); tick it then at the latest.
    pub fn tick_at(&mut self, time: Duration) {
        self.board.deadline = self.board.deadline.min(nanoseconds(time));
    }

    /// Ticks a tree that this leaf holds, exactly once, and passes on when it wants to be ticked next, its faults, and, if
    /// it fails, why.
    pub fn tick_tree<Ctx>(&mut self, tree: &mut Tree<Ctx>, ctx: &mut Ctx) -> Status {
        let answer = tree.tick_exactly_once(self.now(), ctx);
        if answer == Status::Running {
            match tree.next_tick() {
                NextTick::AtOnce => self.tick_again(),
                NextTick::At(time) => self.tick_at(time),
                NextTick::WhenWoken => {}
            }
        }
        if answer == Status::Failure
            && let Some((_, record)) = tree.last_failure()
            && record.at == self.now()
        {
            self.board.cause = Some(record.cause.clone());
        }
        self.adopt_faults(tree);
        answer
    }

    /// Halts a tree that this leaf holds, and passes on its faults.
    pub fn halt_tree<Ctx>(&mut self, tree: &mut Tree<Ctx>, ctx: &mut Ctx) {
        tree.halt(self.now(), ctx);
        self.adopt_faults(tree);
    }

    /// Wakes whoever ticks this tree; give it to the task or thread that will have news for this leaf.
    pub fn waker(&self) -> &Waker {
        &self.board.waker
    }

    /// Says why this leaf is about to answer failure. Kept with the node, see [`Tree::why`](crate::Tree::why).
    pub fn because(&mut self, condition: &'static str, value: impl Into<Value>, threshold: impl Into<Value>) {
        self.board.cause = Some(Cause::new(condition, Some(value.into()), Some(threshold.into())));
    }

    /// [`Ports::because`] where there is nothing to compare.
    pub fn because_of(&mut self, condition: &'static str) {
        self.board.cause = Some(Cause::new(condition, None, None));
    }

    fn adopt_faults<Ctx>(&mut self, tree: &mut Tree<Ctx>) {
        if !tree.faults().is_empty() {
            let (faults, lost) = tree.take_faults();
            self.board.held_faults.0.extend(faults);
            self.board.held_faults.1 += lost;
        }
    }

    fn position(&self, name: &str) -> Option<usize> {
        self.bound.iter().position(|port| &*port.name == name)
    }

    fn value_at(&self, port: usize) -> Option<&Value> {
        self.bound.get(port)?.binding.value(&self.board.values)
    }

    fn read_at<T: PortValue>(&self, port: usize) -> Result<T, PortError> {
        let problem = match self.value_at(port) {
            Some(value) => match T::from_value(value) {
                Some(value) => return Ok(value),
                None => Problem::Misfit { value: value.clone(), wanted: T::port_type().name() },
            },
            None => Problem::Empty { key: self.key_at(port) },
        };
        Err(PortError { port: self.bound.get(port).map_or_else(|| "?".into(), |it| it.name.clone()), problem })
    }

    fn key_at(&self, port: usize) -> Option<String> {
        match self.bound.get(port)?.binding {
            Binding::Slot(slot) => self.names.get(slot as usize).cloned(),
            _ => None,
        }
    }

    fn write_at(&mut self, port: usize, value: Value) {
        if let Some(BoundPort { binding: Binding::Slot(slot), .. }) = self.bound.get(port)
            && let Some(place) = self.board.values.get_mut(*slot as usize)
        {
            *place = Some(value);
        }
    }
}
