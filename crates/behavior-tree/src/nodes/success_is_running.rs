//! # `SuccessIsRunning`
//!
//! Not part of BehaviorTree.CPP. Once its child has succeeded it stays running, without ticking the child again, until it
//! is halted: for work that must be done once while something beside it goes on.
//!
//! | | the node |
//! |---|---|
//! | the child has succeeded since the node was started | answers running, does not tick the child |
//! | the child answers success | resets it, answers running from now on |
//! | the child answers failure | resets it, answers failure |
//! | the child answers running, skipped | answers the same |
//!
//! Halted, or started anew after any other reset: forgets that the child has succeeded.

use super::{BuiltIn, Class};
use crate::kind::Kind;
use crate::run::Run;
use crate::status::{NodeStatus, Status};

pub(crate) const BUILT_IN: BuiltIn = BuiltIn {
    tag: "SuccessIsRunning",
    class: Class::Decorator,
    children: 1..=1,
    ports: &[],
    kind: |_| Kind::SuccessIsRunning,
};

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Status {
    if run.status(at) != NodeStatus::Running {
        run.state(at).cursor = 0;
    }
    run.set_status(at, NodeStatus::Running);
    if run.state(at).cursor == SUCCEEDED {
        return Status::Running;
    }
    let answer = run.execute(at + 1);
    if answer.is_completed() {
        run.reset(at + 1);
    }
    if answer == Status::Success {
        run.state(at).cursor = SUCCEEDED;
        return Status::Running;
    }
    answer
}

const SUCCEEDED: u32 = 1;
