//! `IfThenElse`: asks a condition once and ticks one of two branches.
//!
//! Two or three children: the condition, the branch for success, the branch for failure. While a branch runs, the
//! condition is not asked again. [`WhileDoElse`](super::while_do_else) asks it at every tick.
//!
//! | | the node |
//! |---|---|
//! | the condition runs | returns running |
//! | the condition succeeds | ticks the second child |
//! | the condition fails, there is a third child | ticks the third child |
//! | the condition fails, there is no third child | returns failure |
//! | the condition is skipped | returns skipped (BehaviorTree.CPP throws) |
//! | the branch runs | returns running; continues with this branch next time |
//! | the branch returns anything else | resets all children, returns the same |
//!
//! Halted: halts the running child, starts with the condition next time.

use super::built_in::{BuiltIn, Class};
use super::run::Run;
use crate::kind::Kind;
use crate::status::{NodeStatus, Status};

pub(super) const BUILT_INS: &[BuiltIn] =
    &[BuiltIn::new("IfThenElse", Class::Control, |_| Kind::IfThenElse).with_children(2..=3)];

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Status {
    let shape = run.shape;
    run.set_status(at, NodeStatus::Running);
    let mut branch = run.state(at).cursor as usize;
    if branch == 0 {
        let status = run.execute(at + 1);
        let taken = match status {
            Status::Running | Status::Skipped => return status,
            Status::Success => shape.child(at, 1),
            Status::Failure => shape.child(at, 2),
        };
        match taken {
            Some(child) => branch = child,
            None => return status,
        }
        run.state(at).cursor = branch as u32;
    }
    let status = run.execute(branch);
    if status != Status::Running {
        run.finish(at);
    }
    status
}
