//! The user's leaves: calling them, and containing their errors and panics.

use std::panic::{AssertUnwindSafe, catch_unwind};

use super::built_in::BuiltIn;
use super::run::Run;
use crate::leaf::declaration::LeafClass;
use crate::leaf::ports::Ports;
use crate::machine::Leaf;
use crate::node_id::NodeId;
use crate::record::error::{NodeError, NodeErrorKind};
use crate::status::{NodeStatus, Status};

/// The user registers kinds of leaf.
pub(super) const BUILT_INS: &[BuiltIn] = &[];

// Inlined into `Run::execute`: one call less for every leaf of every tick.
#[inline]
pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, leaf: u32) -> Status {
    let before = run.status(at);
    let is_action = run.shape.leaves[leaf as usize].class == LeafClass::Action;
    match before {
        NodeStatus::Success if is_action => return Status::Success,
        NodeStatus::Failure if is_action => return run.fail_as(at),
        _ => {}
    }
    let result = call(run, leaf, |leaf, ctx, ports| match before {
        NodeStatus::Running => leaf.tick(ctx, ports),
        _ => leaf.start(ctx, ports),
    });
    adopt_errors(run, at);
    let cause = &mut run.machine.board.cause;
    let error = match result {
        Ok(Ok(Status::Running)) if !is_action => NodeErrorKind::RunningCondition,
        Ok(Ok(Status::Failure)) => {
            return match cause.take() {
                Some(cause) => run.fail_because(at, cause),
                None => run.fail(at),
            };
        }
        Ok(Ok(status)) => {
            // Only a failure has a reason.
            if cause.is_some() {
                *cause = None;
            }
            return status;
        }
        Ok(Err(error)) => NodeErrorKind::returned(&*error),
        Err(payload) => NodeErrorKind::panic(&*payload),
    };
    // The leaf may have started something before its error.
    let status = run.fail_with(at, error);
    halt(run, at, leaf);
    status
}

pub(super) fn halt<Ctx>(run: &mut Run<'_, Ctx>, at: usize, leaf: u32) {
    let halted = call(run, leaf, |leaf, ctx, ports| leaf.halt(ctx, ports));
    run.machine.board.cause = None;
    adopt_errors(run, at);
    if let Err(payload) = halted {
        run.report(at, NodeErrorKind::panic(&*payload));
    }
}

fn call<Ctx, R>(
    run: &mut Run<'_, Ctx>,
    leaf: u32,
    action: impl FnOnce(&mut dyn Leaf<Ctx>, &mut Ctx, &mut Ports<'_>) -> R,
) -> std::thread::Result<R> {
    let shape = run.shape;
    let bound = &shape.leaves[leaf as usize].bound;
    let machine = &mut *run.machine;
    let mut ports = Ports { bound, keys: &shape.keys, board: &mut machine.board, failures: &machine.failures };
    let (leaf, ctx) = (&mut *machine.leaves[leaf as usize], &mut *run.ctx);
    catch_unwind(AssertUnwindSafe(|| action(leaf, ctx, &mut ports)))
}

/// Takes over the errors of the tree that a leaf holds.
fn adopt_errors<Ctx>(run: &mut Run<'_, Ctx>, at: usize) {
    let shape = run.shape;
    let adopted = |error: NodeError| {
        let path = format!("{} > {}", shape.path(at), error.path);
        NodeError { node: NodeId::new(at), path, ..error }
    };
    run.machine.errors.adopt(&mut run.machine.board.held_errors, adopted);
}
