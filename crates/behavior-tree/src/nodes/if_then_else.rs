//! # `IfThenElse`
//!
//! Two or three children: a condition, what to do if it succeeds, what to do if it fails. The condition is asked once:
//! while a branch runs it is not asked again. [`WhileDoElse`](super::while_do_else) keeps asking.
//!
//! | | the node |
//! |---|---|
//! | the condition runs | answers running |
//! | the condition succeeds | ticks the second child |
//! | the condition fails, there is a third child | ticks the third child |
//! | the condition fails, there is none | answers failure |
//! | the condition is skipped | answers skipped (BehaviorTree.CPP throws) |
//! | the branch runs | answers running; continues with this branch next time |
//! | the branch answers anything else | resets all children, answers the same |
//!
//! Halted: halts the running child and starts with the condition next time.

use super::{BuiltIn, Class};
use crate::kind::Kind;
use crate::run::Run;
use crate::status::{NodeStatus, Status};

pub(crate) const BUILT_IN: BuiltIn =
    BuiltIn { tag: "IfThenElse", class: Class::Control, children: 2..=3, ports: &[], kind: |_| Kind::IfThenElse };

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Status {
    let shape = run.shape;
    run.set_status(at, NodeStatus::Running);
    let mut branch = run.state(at).cursor as usize;
    if branch == 0 {
        let answer = run.execute(at + 1);
        let taken = match answer {
            Status::Running | Status::Skipped => return answer,
            Status::Success => shape.child(at, 1),
            Status::Failure => shape.child(at, 2),
        };
        match taken {
            Some(child) => branch = child,
            None => return answer,
        }
        run.state(at).cursor = branch as u32;
    }
    let answer = run.execute(branch);
    if answer != Status::Running {
        run.finish(at);
    }
    answer
}
