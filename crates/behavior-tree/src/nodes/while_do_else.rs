//! `WhileDoElse`: asks a condition at every tick and ticks one of two branches.
//!
//! Two or three children: the condition, the branch for success, the branch for failure. When the condition's status
//! changes, the running branch is halted before the other one is started.
//!
//! | | the node |
//! |---|---|
//! | the condition runs | returns running; a branch that runs is neither ticked nor halted meanwhile |
//! | the condition succeeds | resets the third child, ticks the second one |
//! | the condition fails, there is a third child | resets the second child, ticks the third one |
//! | the condition fails, there is no third child | resets all children, returns failure |
//! | the condition is skipped | resets all children, returns skipped (BehaviorTree.CPP throws) |
//! | the branch runs | returns running |
//! | the branch returns anything else | resets all children, returns the same |
//!
//! The first child should be a condition. An action there keeps its status while a branch runs, because nothing resets
//! it.
//!
//! Halted: halts all running children.

use super::built_in::{BuiltIn, Class};
use super::run::Run;
use crate::kind::Kind;
use crate::status::{NodeStatus, Status};

pub(super) const BUILT_INS: &[BuiltIn] =
    &[BuiltIn::new("WhileDoElse", Class::Control, |_| Kind::WhileDoElse).with_children(2..=3)];

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Status {
    let shape = run.shape;
    run.set_status(at, NodeStatus::Running);
    let (do_branch, else_branch) = (shape.child(at, 1), shape.child(at, 2));
    let condition = run.execute(at + 1);
    let (taken, other) = match condition {
        Status::Running => return condition,
        Status::Success => (do_branch, else_branch),
        Status::Failure => (else_branch, do_branch),
        Status::Skipped => (None, None),
    };
    let status = match taken {
        Some(child) => {
            if let Some(other) = other {
                run.reset(other);
            }
            run.execute(child)
        }
        None => condition,
    };
    if status != Status::Running {
        run.reset_children(at);
    }
    status
}
