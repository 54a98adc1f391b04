//! The walk of one tick, or of one halt, through a tree.

use std::time::Duration;

use super::conditions;
use crate::kind::{Kind, NodeState, Param};
use crate::machine::Machine;
use crate::node_id::NodeId;
use crate::record::cause::Cause;
use crate::record::error::{NodeError, NodeErrorKind};
use crate::shape::{NONE, NodeDef, Shape};
use crate::status::{NodeStatus, Status};
use crate::values::value::Value;

/// A walk over the tree. Nodes are addressed by their place in preorder.
pub(crate) struct Run<'a, Ctx> {
    pub(crate) shape: &'a Shape,
    pub(crate) machine: &'a mut Machine<Ctx>,
    pub(crate) ctx: &'a mut Ctx,
}

impl<'a, Ctx> Run<'a, Ctx> {
    /// Ticks a node: preconditions, the node's own rule, postconditions.
    pub(crate) fn execute(&mut self, at: usize) -> Status {
        let def: &'a NodeDef = &self.shape.nodes[at];
        let before = if def.conditions == NONE { None } else { conditions::before(self, at) };
        let mut status = match before {
            Some(status) => status,
            None => super::tick(self, at, def.kind),
        };
        if def.conditions != NONE {
            status = conditions::after(self, at, status);
        }
        let has_decided = status == Status::Failure && self.decider() == at;
        if !has_decided && status != Status::Skipped {
            // The reason of an earlier failure is out of date.
            self.machine.failures.forget(at);
        }
        match status {
            Status::Running => self.set_status(at, NodeStatus::Running),
            Status::Success => self.set_status(at, NodeStatus::Success),
            Status::Failure => self.set_status(at, NodeStatus::Failure),
            Status::Skipped => {}
        }
        if def.is_decorator && self.status(at + 1).is_completed() {
            self.set_status(at + 1, NodeStatus::Idle);
        }
        status
    }

    /// Halts a node that its parent abandons. Everything that runs below it is halted too, first child first.
    pub(crate) fn halt(&mut self, at: usize) {
        let def: &'a NodeDef = &self.shape.nodes[at];
        let was_running = self.status(at) == NodeStatus::Running;
        match def.kind {
            Kind::Leaf { leaf } if was_running => super::leaf::halt(self, at, leaf),
            Kind::Leaf { .. } => {}
            _ => self.finish(at),
        }
        self.set_status(at, NodeStatus::Idle);
        if was_running && def.conditions != NONE {
            conditions::halted(self, at);
        }
    }

    /// Makes a node idle. Halts it first if it is running.
    pub(crate) fn reset(&mut self, at: usize) {
        if self.status(at) == NodeStatus::Running {
            self.halt(at);
        }
        self.set_status(at, NodeStatus::Idle);
    }

    pub(crate) fn reset_children(&mut self, at: usize) {
        let shape = self.shape;
        for child in shape.children(at) {
            self.reset(child);
        }
    }

    pub(crate) fn reset_children_but(&mut self, at: usize, spared: usize) {
        let shape = self.shape;
        for child in shape.children(at) {
            if child != spared {
                self.reset(child);
            }
        }
    }

    /// Ends a node: it starts from the beginning next time, and its children are reset.
    pub(crate) fn finish(&mut self, at: usize) {
        if !self.shape.nodes[at].keeps_place {
            self.machine.state[at] = NodeState::default();
        }
        self.reset_children(at);
    }

    /// [`Run::finish`], with a failure that a child or the node itself has decided.
    pub(crate) fn give_up(&mut self, at: usize) -> Status {
        self.finish(at);
        Status::Failure
    }

    /// A node fails by its own decision, not because a child failed.
    pub(crate) fn fail(&mut self, at: usize) -> Status {
        self.machine.failures.forget(at);
        self.fail_as(at)
    }

    /// [`Run::fail`], for a reason.
    pub(crate) fn fail_because(&mut self, at: usize, cause: Cause) -> Status {
        self.machine.failures.explain(at, self.shape.nodes.len(), self.now(), cause);
        self.fail_as(at)
    }

    /// A node fails because of a failure that `decider` decided before.
    pub(crate) fn fail_as(&mut self, decider: usize) -> Status {
        self.machine.failures.decide(decider);
        Status::Failure
    }

    /// The node that decided the latest failure.
    pub(crate) fn decider(&self) -> usize {
        self.machine.failures.decider()
    }

    /// A node fails with an error.
    pub(crate) fn fail_with(&mut self, at: usize, error: NodeErrorKind) -> Status {
        let cause = Cause::Happened(error.to_string().into());
        self.report(at, error);
        self.fail_because(at, cause)
    }

    /// Records an error that does not change what the node returns.
    pub(crate) fn report(&mut self, at: usize, kind: NodeErrorKind) {
        let (node, path) = (NodeId::new(at), self.shape.path(at));
        self.machine.errors.push(NodeError { node, path, at: Duration::from_nanos(self.now()), kind });
    }

    pub(crate) fn status(&self, at: usize) -> NodeStatus {
        self.machine.status[at]
    }

    pub(crate) fn set_status(&mut self, at: usize, status: NodeStatus) {
        let before = std::mem::replace(&mut self.machine.status[at], status);
        if before != status
            && let Some(changes) = &mut self.machine.changes
        {
            changes.push(self.machine.board.now, NodeId::new(at), before, status);
        }
    }

    pub(crate) fn state(&mut self, at: usize) -> &mut NodeState {
        &mut self.machine.state[at]
    }

    /// The time of the tick in nanoseconds.
    pub(crate) fn now(&self) -> u64 {
        self.machine.board.now
    }

    pub(crate) fn tick_again(&mut self) {
        self.machine.board.schedule.tick_again();
    }

    pub(crate) fn tick_at(&mut self, time: u64) {
        self.machine.board.schedule.tick_at(time);
    }

    /// A number from an attribute. On `None` the node has failed with an error and must [`Run::give_up`].
    pub(crate) fn number(&mut self, at: usize, param: Param) -> Option<i32> {
        let slot = match param {
            Param::Constant(number) => return Some(number),
            Param::Slot(slot) => slot as usize,
        };
        let held = match &self.machine.board.values[slot] {
            Some(Value::Int(number)) => i32::try_from(*number).ok(),
            Some(Value::Bool(flag)) => Some(i32::from(*flag)),
            _ => None,
        };
        if held.is_none() {
            let key = &self.shape.keys[slot];
            let text = match &self.machine.board.values[slot] {
                Some(value) => format!("key `{key}`: expected a 32-bit integer, found `{value}`"),
                None => format!("key `{key}` has no value yet"),
            };
            self.fail_with(at, NodeErrorKind::Port(text));
        }
        held
    }
}
