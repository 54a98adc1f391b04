//! Ticking, halting and reading a tree.

use std::task::Waker;
use std::time::Duration;

use crate::leaf::ports::Ports;
use crate::machine::Tree;
use crate::node_id::NodeId;
use crate::nodes::run::Run;
use crate::parameters::{self, SetError};
use crate::record::changes::{ChangeRecorder, StatusChange};
use crate::record::error::NodeError;
use crate::schedule::{NextTick, Schedule, nanoseconds};
use crate::status::{NodeStatus, Status};
use crate::values::port_value::PortValue;
use crate::values::value::Value;

/// How often [`Tree::tick_once`] ticks at most: nodes that ask for another tick forever must not hang the caller.
pub const MAX_TICKS_AT_ONCE: usize = 100;

impl<Ctx> Tree<Ctx> {
    /// Ticks the root exactly once. `now` is the time on any clock that does not run backwards.
    ///
    /// A root that finishes is idle afterwards, and the next tick starts it again.
    pub fn tick_exactly_once(&mut self, now: Duration, ctx: &mut Ctx) -> Status {
        self.machine.board.schedule = Schedule::EMPTY;
        let root = NodeId::ROOT.index();
        let mut run = self.run(now, ctx);
        let status = run.execute(root);
        if status.is_completed() {
            run.set_status(root, NodeStatus::Idle);
        }
        self.machine.failures.end_tick(status == Status::Failure);
        status
    }

    /// Ticks the root, and again while it runs and a node asks for another tick at once, up to [`MAX_TICKS_AT_ONCE`]
    /// times.
    pub fn tick_once(&mut self, now: Duration, ctx: &mut Ctx) -> Status {
        let mut status = self.tick_exactly_once(now, ctx);
        let mut ticks = 1;
        while status == Status::Running && self.machine.board.schedule.wants_tick_again() && ticks < MAX_TICKS_AT_ONCE {
            status = self.tick_exactly_once(now, ctx);
            ticks += 1;
        }
        status
    }

    /// Halts every running node and makes all nodes idle. Keys keep their values.
    pub fn halt(&mut self, now: Duration, ctx: &mut Ctx) {
        let mut run = self.run(now, ctx);
        // From the root, and then every node by itself, because nodes that are not running may have counters to clear.
        for node in 0..run.shape.nodes.len() {
            run.halt(node);
        }
        self.machine.board.schedule = Schedule::EMPTY;
    }

    /// When to tick next, as the nodes asked during the last tick.
    pub fn next_tick(&self) -> NextTick {
        self.machine.board.schedule.next_tick()
    }

    /// Sets the waker that leaves get from [`Ports::waker`].
    pub fn set_waker(&mut self, waker: Waker) {
        self.machine.board.waker = waker;
    }

    /// The errors since the last [`Tree::take_errors`]: the oldest 64.
    pub fn errors(&self) -> &[NodeError] {
        self.machine.errors.as_slice()
    }

    /// The errors since the last call, and the number of errors that were dropped.
    pub fn take_errors(&mut self) -> (Vec<NodeError>, u64) {
        self.machine.errors.take()
    }

    /// Every node's status, in preorder. A snapshot is one copy of this slice.
    pub fn statuses(&self) -> &[NodeStatus] {
        &self.machine.status
    }

    /// The status of the root.
    pub fn status(&self) -> NodeStatus {
        self.machine.status.first().copied().unwrap_or_default()
    }

    /// Records status changes from now on, the latest `capacity` of them.
    ///
    /// `stamp` is called at every change, and its result is recorded with the change: the clock of a measurement, or
    /// `|| 0`. The engine itself reads no clock.
    pub fn record_changes(&mut self, capacity: usize, stamp: fn() -> u64) {
        self.record_changes_of(|_| true, capacity, stamp);
    }

    /// The same of those nodes only that `watched` names: what nobody reads costs a reading of the clock each time.
    pub fn record_changes_of(&mut self, watched: impl Fn(NodeId) -> bool, capacity: usize, stamp: fn() -> u64) {
        let watched = (0..self.len()).map(|at| watched(NodeId::new(at))).collect();
        self.machine.changes = Some(ChangeRecorder::new(capacity, watched, stamp));
    }

    /// Passes the status changes since the last call to `take`, oldest first. Returns how many were lost because they
    /// were not taken in time.
    pub fn take_changes(&mut self, take: impl FnMut(StatusChange)) -> u64 {
        self.machine.changes.as_mut().map_or(0, |changes| changes.drain(take))
    }

    /// The value of a blackboard key. Keys of a subtree are called `subtree/key`.
    pub fn get<T: PortValue>(&self, key: &str) -> Option<T> {
        let slot = self.shape.slot(key)?;
        self.machine.board.values[slot].as_ref().and_then(T::from_value)
    }

    /// Sets a blackboard key from outside: a declared parameter or global of the tree.
    pub fn set(&mut self, key: &str, value: impl Into<Value>) -> Result<(), SetError> {
        parameters::set(&self.shape, &mut self.machine.board.values, key, value.into())
    }

    fn run<'a>(&'a mut self, now: Duration, ctx: &'a mut Ctx) -> Run<'a, Ctx> {
        self.machine.board.now = nanoseconds(now);
        Run { shape: &self.shape, machine: &mut self.machine, ctx }
    }
}

impl Ports<'_> {
    /// Ticks a tree that this leaf holds exactly once. Passes on when the tree wants to be ticked next, its errors, and
    /// why it failed.
    pub fn tick_tree<Ctx>(&mut self, tree: &mut Tree<Ctx>, ctx: &mut Ctx) -> Status {
        let status = tree.tick_exactly_once(self.now(), ctx);
        if status == Status::Running {
            match tree.next_tick() {
                NextTick::AtOnce => self.tick_again(),
                NextTick::At(time) => self.tick_at(time),
                NextTick::WhenWoken => {}
            }
        }
        if status == Status::Failure
            && let Some(record) = tree.machine.failures.of_tick().and_then(|node| tree.machine.failures.why(node))
        {
            self.board.cause = Some(record.cause.clone());
        }
        self.take_errors_of(tree);
        status
    }

    /// Halts a tree that this leaf holds, and passes on its errors.
    pub fn halt_tree<Ctx>(&mut self, tree: &mut Tree<Ctx>, ctx: &mut Ctx) {
        tree.halt(self.now(), ctx);
        self.take_errors_of(tree);
    }

    fn take_errors_of<Ctx>(&mut self, tree: &mut Tree<Ctx>) {
        self.board.held_errors.adopt(&mut tree.machine.errors, |error| error);
    }
}
