//! # `WhileDoElse`
//!
//! Two or three children: a condition, what to do while it succeeds, what to do while it fails. The condition is asked at
//! every tick, and when its answer changes the running branch is halted before the other one is started.
//!
//! | | the node |
//! |---|---|
//! | the condition runs | answers running; a branch that runs is neither ticked nor halted meanwhile |
//! | the condition succeeds | halts and resets the third child, ticks the second one |
//! | the condition fails, there is a third child | halts and resets the second child, ticks the third one |
//! | the condition fails, there is none | halts and resets all children, answers failure |
//! | the condition is skipped | halts and resets all children, answers skipped (BehaviorTree.CPP throws) |
//! | the branch runs | answers running |
//! | the branch answers anything else | resets all children, answers the same |
//!
//! Use a condition as the first child. An action there keeps its answer while a branch runs, since nobody resets it.
//!
//! Halted: halts all running children.

use super::{BuiltIn, Class};
use crate::kind::Kind;
use crate::run::Run;
use crate::status::{NodeStatus, Status};

pub(crate) const BUILT_IN: BuiltIn =
    BuiltIn { tag: "WhileDoElse", class: Class::Control, children: 2..=3, ports: &[], kind: |_| Kind::WhileDoElse };

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Status {
    let shape = run.shape;
    run.set_status(at, NodeStatus::Running);
    let (do_branch, else_branch) = (shape.child(at, 1), shape.child(at, 2));
    let answer = run.execute(at + 1);
    let (taken, other) = match answer {
        Status::Running => return answer,
        Status::Success => (do_branch, else_branch),
        Status::Failure => (else_branch, do_branch),
        Status::Skipped => (None, None),
    };
    let answer = match taken {
        Some(child) => {
            if let Some(other) = other {
                run.reset(other);
            }
            run.execute(child)
        }
        None => answer,
    };
    if answer != Status::Running {
        run.reset_children(at);
    }
    answer
}
