//! `RunOnce`: runs its child to the end once.
//!
//! | port | type | default | |
//! |---|---|---|---|
//! | `then_skip` | bool | true | afterwards return skipped; else repeat the child's status |
//!
//! | | the node |
//! |---|---|
//! | the child has finished once, `then_skip` | returns skipped |
//! | the child has finished once, not `then_skip` | returns what the child returned |
//! | the child returns success, failure | resets the child, returns the same and remembers it |
//! | the child returns running, skipped | returns the same |
//!
//! Halted: halts the child. The node never forgets that the child has finished.

use super::built_in::{BuiltIn, BuiltInPort, Class, Holds};
use super::run::Run;
use crate::kind::{Kind, Param};
use crate::status::{NodeStatus, Status};

const THEN_SKIP: BuiltInPort =
    BuiltInPort::new("then_skip", Holds::Flag, "afterwards return skipped; else repeat the child's status")
        .with_default("true");

pub(super) const BUILT_INS: &[BuiltIn] =
    &[BuiltIn::new("RunOnce", Class::Decorator, |node| Kind::RunOnce { then_skip: node.numbers[0] })
        .with_ports(&[THEN_SKIP])
        .keeping_its_place()];

const SUCCEEDED: u32 = 1;
const FAILED: u32 = 2;

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, then_skip: Param) -> Status {
    let Some(then_skip) = run.number(at, then_skip) else {
        return run.give_up(at);
    };
    let state = *run.state(at);
    match state.cursor {
        SUCCEEDED | FAILED if then_skip != 0 => return Status::Skipped,
        SUCCEEDED => return Status::Success,
        FAILED => return run.fail_as(state.memo as usize),
        _ => {}
    }
    run.set_status(at, NodeStatus::Running);
    let status = run.execute(at + 1);
    match status {
        Status::Success => run.state(at).cursor = SUCCEEDED,
        Status::Failure => {
            let decider = run.decider() as u64;
            let state = run.state(at);
            (state.cursor, state.memo) = (FAILED, decider);
        }
        Status::Running | Status::Skipped => return status,
    }
    run.reset(at + 1);
    status
}
