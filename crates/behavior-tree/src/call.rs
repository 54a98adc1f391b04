//! Calling leaves, and containing what goes wrong in them.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use crate::cause::{Cause, FailureRecord, Words};
use crate::fault::{Fault, FaultKind, FaultPolicy, chain, panic_message};
use crate::kind::Param;
use crate::leaf::Leaf;
use crate::ports::Ports;
use crate::registry::LeafClass;
use crate::run::Run;
use crate::status::{NodeStatus, Status};
use crate::tree::NodeId;
use crate::value::Value;

/// Faults kept until somebody takes them; a leaf that errs at every tick must not fill the memory.
const MAX_FAULTS: usize = 64;

impl<Ctx> Run<'_, Ctx> {
    pub(crate) fn tick_leaf(&mut self, leaf: usize, at: usize) -> Status {
        let before = self.status(at);
        let latches = self.shape.leaves[leaf].class == LeafClass::Action;
        match before {
            NodeStatus::Success if latches => return Status::Success,
            NodeStatus::Failure if latches => return Status::Failure,
            _ if self.machine.aborting => {
                if before == NodeStatus::Running {
                    self.halt_leaf(leaf, at);
                }
                return Status::Failure;
            }
            _ => {}
        }
        let answer = self.call(leaf, |leaf, ctx, ports| match before {
            NodeStatus::Running => leaf.tick(ctx, ports),
            _ => leaf.start(ctx, ports),
        });
        let cause = self.machine.board.cause.take();
        self.adopt_faults(at);
        match answer {
            Ok(Ok(Status::Running)) if !latches => self.leaf_fault(leaf, at, FaultKind::RunningCondition),
            Ok(Ok(answer)) => {
                if let (Status::Failure, Some(cause)) = (answer, cause) {
                    self.record_cause(at, cause);
                }
                answer
            }
            Ok(Err(error)) => self.leaf_fault(leaf, at, FaultKind::Error(chain(&*error))),
            Err(payload) => self.leaf_fault(leaf, at, FaultKind::Panic(panic_message(&*payload))),
        }
    }

    fn call<R>(
        &mut self,
        leaf: usize,
        action: impl FnOnce(&mut dyn Leaf<Ctx>, &mut Ctx, &mut Ports<'_>) -> R,
    ) -> std::thread::Result<R> {
        let shape = self.shape;
        let machine = &mut *self.machine;
        let node = &mut *machine.leaves[leaf];
        let mut ports = Ports { bound: &shape.leaves[leaf].bound, names: &shape.slot_names, board: &mut machine.board };
        let ctx = &mut *self.ctx;
        catch_unwind(AssertUnwindSafe(|| action(node, ctx, &mut ports)))
    }

    /// The leaf may have started something before it went wrong, so it is halted.
    fn leaf_fault(&mut self, leaf: usize, at: usize, kind: FaultKind) -> Status {
        self.report(at, kind);
        self.halt_leaf(leaf, at);
        Status::Failure
    }

    pub(crate) fn halt_leaf(&mut self, leaf: usize, at: usize) {
        let halted = self.call(leaf, |leaf, ctx, ports| leaf.halt(ctx, ports));
        self.machine.board.cause = None;
        self.adopt_faults(at);
        if let Err(payload) = halted {
            self.report(at, FaultKind::Panic(panic_message(&*payload)));
        }
    }

    /// Records a fault of a node; the caller answers failure.
    pub(crate) fn report(&mut self, at: usize, kind: FaultKind) {
        self.record_cause(at, Cause { condition: Words::from(kind.to_string()), value: None, threshold: None });
        let (node, path) = (NodeId(at as u32), self.shape.path(at));
        self.keep_fault(Fault { node, path, at: Duration::from_nanos(self.machine.board.now), kind });
    }

    /// Takes over the faults of a tree that this leaf holds.
    fn adopt_faults(&mut self, at: usize) {
        let held = &mut self.machine.board.held_faults;
        if held.0.is_empty() {
            return;
        }
        let (faults, lost) = (std::mem::take(&mut held.0), std::mem::take(&mut held.1));
        self.machine.lost_faults += lost;
        for fault in faults {
            let path = format!("{} > {}", self.shape.path(at), fault.path);
            self.keep_fault(Fault { node: NodeId(at as u32), path, ..fault });
        }
    }

    fn keep_fault(&mut self, fault: Fault) {
        self.machine.aborting |= self.machine.policy == FaultPolicy::HaltTree;
        if self.machine.faults.len() < MAX_FAULTS {
            self.machine.faults.push(fault);
        } else {
            self.machine.lost_faults += 1;
        }
    }

    pub(crate) fn record_cause(&mut self, at: usize, cause: Cause) {
        if self.machine.causes.is_empty() {
            self.machine.causes.resize(self.shape.nodes.len(), None);
        }
        let at_time = Duration::from_nanos(self.machine.board.now);
        self.machine.causes[at] = Some(FailureRecord { at: at_time, cause });
        self.machine.last_cause = at;
    }

    /// A number from an attribute. On `None` the fault is recorded and the node is to answer [`Run::give_up`].
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
            let key = &self.shape.slot_names[slot];
            let text = match &self.machine.board.values[slot] {
                Some(value) => format!("`{key}` holds `{value}`, which is no usable number"),
                None => format!("nothing has been written to `{key}` yet"),
            };
            self.report(at, FaultKind::Port(text));
        }
        held
    }
}
