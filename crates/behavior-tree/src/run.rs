//! One tick, or one halt, on its way through a tree.

use crate::board::Board;
use crate::cause::FailureRecord;
use crate::fault::{Fault, FaultPolicy};
use crate::kind::{Kind, NodeState};
use crate::leaf::Leaf;
use crate::nodes;
use crate::ring::StatusRing;
use crate::shape::{NONE, NodeDef, Shape};
use crate::status::{NodeStatus, Status};

/// The mutable part of a tree.
pub(crate) struct Machine<Ctx> {
    pub(crate) status: Vec<NodeStatus>,
    pub(crate) state: Vec<NodeState>,
    pub(crate) leaves: Vec<Box<dyn Leaf<Ctx>>>,
    pub(crate) board: Board,
    pub(crate) ring: Option<StatusRing>,
    /// One entry a node, from the first failure that had a cause.
    pub(crate) causes: Vec<Option<FailureRecord>>,
    /// The node that recorded a cause last.
    pub(crate) last_cause: usize,
    pub(crate) faults: Vec<Fault>,
    pub(crate) lost_faults: u64,
    pub(crate) policy: FaultPolicy,
    /// Set by a fault under [`FaultPolicy::HaltTree`]: leaves are left alone for the rest of the tick.
    pub(crate) aborting: bool,
}

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
        let before = if def.conditions == NONE { None } else { nodes::conditions::before(self, at) };
        let mut answer = match before {
            Some(answer) => answer,
            None => self.rule(def.kind, at),
        };
        if def.conditions != NONE {
            answer = nodes::conditions::after(self, at, answer);
        }
        if matches!(answer, Status::Running | Status::Success) && !self.machine.causes.is_empty() {
            self.machine.causes[at] = None;
        }
        match answer {
            Status::Running => self.set_status(at, NodeStatus::Running),
            Status::Success => self.set_status(at, NodeStatus::Success),
            Status::Failure => self.set_status(at, NodeStatus::Failure),
            Status::Skipped => {}
        }
        if def.kind.is_decorator() && self.status(at + 1).is_completed() {
            self.set_status(at + 1, NodeStatus::Idle);
        }
        answer
    }

    fn rule(&mut self, kind: Kind, at: usize) -> Status {
        match kind {
            Kind::Leaf(leaf) => self.tick_leaf(leaf as usize, at),
            Kind::Sequence { interruptible } => nodes::sequence::tick(self, at, interruptible),
            Kind::Fallback { interruptible } => nodes::fallback::tick(self, at, interruptible),
            Kind::SequenceWithMemory => nodes::sequence_with_memory::tick(self, at),
            Kind::ReactiveSequence => nodes::reactive_sequence::tick(self, at),
            Kind::ReactiveFallback => nodes::reactive_fallback::tick(self, at),
            Kind::Parallel { success, failure } => nodes::parallel::tick(self, at, success, failure),
            Kind::ParallelAll { max_failures } => nodes::parallel_all::tick(self, at, max_failures),
            Kind::IfThenElse => nodes::if_then_else::tick(self, at),
            Kind::WhileDoElse => nodes::while_do_else::tick(self, at),
            Kind::Switch(table) => nodes::switch::tick(self, at, table as usize),
            Kind::Inverter => nodes::inverter::tick(self, at),
            Kind::ForceSuccess => nodes::force_success::tick(self, at),
            Kind::ForceFailure => nodes::force_failure::tick(self, at),
            Kind::KeepRunningUntilFailure => nodes::keep_running_until_failure::tick(self, at),
            Kind::RetryUntilSuccessful(attempts) => nodes::retry_until_successful::tick(self, at, attempts),
            Kind::Repeat(cycles) => nodes::repeat::tick(self, at, cycles),
            Kind::RunOnce { then_skip } => nodes::run_once::tick(self, at, then_skip),
            Kind::Timeout(limit) => nodes::timeout::tick(self, at, limit),
            Kind::Delay(delay) => nodes::delay::tick(self, at, delay),
            Kind::SubTree => nodes::sub_tree::tick(self, at),
            Kind::SuccessIsRunning => nodes::success_is_running::tick(self, at),
            Kind::AlwaysSuccess => Status::Success,
            Kind::AlwaysFailure => Status::Failure,
            Kind::Sleep(duration) => nodes::sleep::tick(self, at, duration),
            Kind::Script(script) => nodes::script::tick(self, at, script),
            Kind::ScriptCondition(script) => nodes::script_condition::tick(self, at, script),
            Kind::Precondition { script, otherwise } => nodes::precondition::tick(self, at, script, otherwise),
        }
    }

    /// Halts a node as its parent does when it abandons it: everything running below is halted, first child first.
    pub(crate) fn halt(&mut self, at: usize) {
        let def: &'a NodeDef = &self.shape.nodes[at];
        let was_running = self.status(at) == NodeStatus::Running;
        match def.kind {
            Kind::Leaf(leaf) if was_running => self.halt_leaf(leaf as usize, at),
            Kind::Leaf(_) => {}
            kind => {
                nodes::forget(kind, &mut self.machine.state[at]);
                self.reset_children(at);
            }
        }
        self.set_status(at, NodeStatus::Idle);
        if was_running && def.conditions != NONE {
            nodes::conditions::halted(self, at);
        }
    }

    /// Back to idle; halts the node first if it is running.
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

    pub(crate) fn status(&self, at: usize) -> NodeStatus {
        self.machine.status[at]
    }

    pub(crate) fn set_status(&mut self, at: usize, status: NodeStatus) {
        let before = std::mem::replace(&mut self.machine.status[at], status);
        if before != status
            && let Some(ring) = &mut self.machine.ring
        {
            ring.push(self.machine.board.now, at as u32, before, status);
        }
    }

    pub(crate) fn state(&mut self, at: usize) -> &mut NodeState {
        &mut self.machine.state[at]
    }

    pub(crate) fn now(&self) -> u64 {
        self.machine.board.now
    }

    pub(crate) fn tick_again(&mut self) {
        self.machine.board.again = true;
    }

    pub(crate) fn tick_at(&mut self, time: u64) {
        let deadline = &mut self.machine.board.deadline;
        *deadline = (*deadline).min(time);
    }

    /// Ends a node that cannot go on: what ran below it is halted.
    pub(crate) fn give_up(&mut self, at: usize) -> Status {
        self.finish(at);
        Status::Failure
    }

    /// Ends a node: it starts anew next time, and its children are halted and reset.
    pub(crate) fn finish(&mut self, at: usize) {
        let kind = self.shape.nodes[at].kind;
        nodes::forget(kind, &mut self.machine.state[at]);
        self.reset_children(at);
    }
}
