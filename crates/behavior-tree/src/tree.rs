//! A tree that can be ticked.

use std::sync::Arc;
use std::task::Waker;
use std::time::Duration;

use crate::board::nanoseconds;
use crate::cause::FailureRecord;
use crate::fault::{Fault, FaultPolicy};
use crate::port_value::PortValue;
use crate::ring::{StatusChange, StatusRing};
use crate::run::{Machine, Run};
use crate::shape::Shape;
use crate::status::{NodeStatus, Status};
use crate::types::Type;
use crate::value::Value;

/// A node of one tree: its place in preorder, the root being 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeId(pub(crate) u32);

impl NodeId {
    /// The place in preorder, which is the node's index in [`Tree::statuses`].
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// When a tree wants to be ticked next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NextTick {
    /// A node asked to go on at once.
    AtOnce,
    /// At this time, or when the waker is called.
    At(Duration),
    /// When the waker is called, or something changes that the leaves look at.
    WhenWoken,
}

/// One instance of a tree, made by [`Template::instantiate`](crate::Template::instantiate).
///
/// A tree reads no clock and waits for nothing: time and the world come in with every tick.
pub struct Tree<Ctx> {
    pub(crate) shape: Arc<Shape>,
    pub(crate) machine: Machine<Ctx>,
}

/// How often [`Tree::tick_once`] ticks at most; a node that asks to go on for ever must not hang its caller.
pub const MAX_TICKS_AT_ONCE: usize = 100;

impl<Ctx> Tree<Ctx> {
    /// Ticks the root exactly once. `now` is the time on any clock that does not run backwards.
    ///
    /// When the root finishes it is idle again afterwards, ready to be started anew.
    pub fn tick_exactly_once(&mut self, now: Duration, ctx: &mut Ctx) -> Status {
        let root = 0;
        let mut run = self.run(now, ctx);
        run.machine.board.deadline = u64::MAX;
        run.machine.board.again = false;
        let mut answer = run.execute(root);
        if answer.is_completed() {
            run.set_status(root, NodeStatus::Idle);
        }
        if run.machine.aborting {
            halt_all(&mut run);
            run.machine.aborting = false;
            answer = Status::Failure;
        }
        answer
    }

    /// Ticks the root, and again as long as it runs and a node asks to go on at once, up to [`MAX_TICKS_AT_ONCE`] times.
    pub fn tick_once(&mut self, now: Duration, ctx: &mut Ctx) -> Status {
        let mut answer = self.tick_exactly_once(now, ctx);
        let mut ticks = 1;
        while answer == Status::Running && self.machine.board.again && ticks < MAX_TICKS_AT_ONCE {
            answer = self.tick_exactly_once(now, ctx);
            ticks += 1;
        }
        answer
    }

    /// Halts whatever runs and makes every node idle. Keys keep their values.
    pub fn halt(&mut self, now: Duration, ctx: &mut Ctx) {
        let mut run = self.run(now, ctx);
        halt_all(&mut run);
        run.machine.aborting = false;
        self.machine.board.deadline = u64::MAX;
        self.machine.board.again = false;
    }

    /// When to tick next, as far as the nodes said in the last tick.
    pub fn next_tick(&self) -> NextTick {
        if self.machine.board.again {
            NextTick::AtOnce
        } else if self.machine.board.deadline != u64::MAX {
            NextTick::At(Duration::from_nanos(self.machine.board.deadline))
        } else {
            NextTick::WhenWoken
        }
    }

    /// The waker that leaves get, see [`Ports::waker`](crate::Ports::waker).
    pub fn set_waker(&mut self, waker: Waker) {
        self.machine.board.waker = waker;
    }

    /// What to do about faults from now on.
    pub fn set_fault_policy(&mut self, policy: FaultPolicy) {
        self.machine.policy = policy;
    }

    /// The faults since the last [`Tree::take_faults`]; the oldest 64 of them.
    pub fn faults(&self) -> &[Fault] {
        &self.machine.faults
    }

    /// The faults since the last call, and how many more there were than could be kept.
    pub fn take_faults(&mut self) -> (Vec<Fault>, u64) {
        (std::mem::take(&mut self.machine.faults), std::mem::take(&mut self.machine.lost_faults))
    }

    /// Every node's status, in preorder.
    pub fn statuses(&self) -> &[NodeStatus] {
        &self.machine.status
    }

    /// Copies every node's status into `snapshot`, which is as long as [`Tree::statuses`]: one `memcpy`.
    pub fn snapshot(&self, snapshot: &mut [NodeStatus]) {
        snapshot.copy_from_slice(&self.machine.status);
    }

    /// The status of the root.
    pub fn status(&self) -> NodeStatus {
        self.machine.status.first().copied().unwrap_or_default()
    }

    /// Why a node failed, if it said so: the condition, the value and the limit it gave with [`Ports::because`], the
    /// expression that decided, the error it returned. Forgotten when it runs or succeeds.
    ///
    /// [`Ports::because`]: crate::Ports::because
    pub fn why(&self, node: NodeId) -> Option<&FailureRecord> {
        self.machine.causes.get(node.index())?.as_ref()
    }

    /// The node that said last why it failed, and what it said: after a tick that answered failure, mostly the reason.
    pub fn last_failure(&self) -> Option<(NodeId, &FailureRecord)> {
        let node = NodeId(self.machine.last_cause as u32);
        Some((node, self.why(node)?))
    }

    /// The first node called `name`, in preorder.
    pub fn find(&self, name: &str) -> Option<NodeId> {
        let index = self.shape.labels.iter().position(|label| &*label.name == name)?;
        Some(NodeId(index as u32))
    }

    /// A node's name: its `name` attribute, or its tag.
    pub fn name(&self, node: NodeId) -> &str {
        self.shape.labels.get(node.index()).map_or("", |label| &label.name)
    }

    /// The number of nodes.
    pub fn len(&self) -> usize {
        self.shape.nodes.len()
    }

    /// Always false: a tree has a root.
    pub fn is_empty(&self) -> bool {
        self.shape.nodes.is_empty()
    }

    /// The `ID` of the tree this is an instance of.
    pub fn id(&self) -> &str {
        &self.shape.tree_id
    }

    /// Records status changes from now on, the latest `capacity` of them.
    pub fn record_changes(&mut self, capacity: usize) {
        self.machine.ring = Some(StatusRing::new(capacity));
    }

    /// Hands over the status changes recorded since the last call, oldest first, and answers how many were lost because
    /// they were not taken in time.
    pub fn take_changes(&mut self, take: impl FnMut(StatusChange)) -> u64 {
        self.machine.ring.as_mut().map_or(0, |ring| ring.drain(take))
    }

    /// The value of a blackboard key; those of a subtree are called `subtree/key`.
    pub fn get<T: PortValue>(&self, key: &str) -> Option<T> {
        let slot = self.shape.slot(key)?;
        self.machine.board.values.get(slot)?.as_ref().and_then(T::from_value)
    }

    /// Sets a blackboard key from outside: a declared parameter or global of the tree.
    pub fn set(&mut self, key: &str, value: impl Into<Value>) -> Result<(), SetError> {
        set_open_key(&self.shape, &mut self.machine.board.values, key, value.into())
    }

    /// All keys with their values, in no particular order.
    pub fn blackboard(&self) -> impl Iterator<Item = (&str, Option<&Value>)> {
        self.shape.slot_names.iter().map(String::as_str).zip(self.machine.board.values.iter().map(Option::as_ref))
    }

    fn run<'a>(&'a mut self, now: Duration, ctx: &'a mut Ctx) -> Run<'a, Ctx> {
        self.machine.board.now = nanoseconds(now);
        Run { shape: &self.shape, machine: &mut self.machine, ctx }
    }
}

/// Halts from the root and then once more every node by itself, so that counters of nodes that were not running start
/// anew too.
fn halt_all<Ctx>(run: &mut Run<'_, Ctx>) {
    for node in 0..run.shape.nodes.len() {
        run.halt(node);
    }
}

pub(crate) fn set_open_key(
    shape: &Shape,
    values: &mut [Option<Value>],
    key: &str,
    value: Value,
) -> Result<(), SetError> {
    let open = shape.slot(key).filter(|slot| shape.slots[*slot].open);
    let Some(slot) = open else {
        return Err(SetError::NoSuchKey { tree: shape.tree_id.to_string(), key: key.to_owned() });
    };
    let declared = shape.slots[slot].ty;
    if !declared.accepts(&value) {
        return Err(SetError::WrongType { key: key.to_owned(), declared, value });
    }
    values[slot] = Some(value);
    Ok(())
}

/// A key could not be set from outside.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SetError {
    /// The tree has no such key, or does not declare that it may be set.
    #[error("tree `{tree}` has no parameter or global `{key}`")]
    NoSuchKey {
        /// The tree.
        tree: String,
        /// The key.
        key: String,
    },
    /// The key is of another type.
    #[error("key `{key}` is of type {declared:?}, and `{value}` is not")]
    WrongType {
        /// The key.
        key: String,
        /// Its type.
        declared: Type,
        /// The value refused.
        value: Value,
    },
}
