//! `SuccessIsRunning`: stays running once its child has succeeded.
//!
//! For work that must be done once while something beside it goes on. Not part of BehaviorTree.CPP.
//!
//! | | the node |
//! |---|---|
//! | the child has succeeded since the node was started | returns running, does not tick the child |
//! | the child returns success | resets the child, returns running from now on |
//! | the child returns failure | resets the child, returns failure |
//! | the child returns running, skipped | returns the same |
//!
//! Halted, or started again after a reset: forgets that the child has succeeded.

use super::built_in::{BuiltIn, Class};
use super::run::Run;
use crate::kind::Kind;
use crate::status::{NodeStatus, Status};

pub(super) const BUILT_INS: &[BuiltIn] =
    &[BuiltIn::new("SuccessIsRunning", Class::Decorator, |_| Kind::SuccessIsRunning)];

const SUCCEEDED: u32 = 1;

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Status {
    if run.status(at) != NodeStatus::Running {
        run.state(at).cursor = 0;
    }
    run.set_status(at, NodeStatus::Running);
    if run.state(at).cursor == SUCCEEDED {
        return Status::Running;
    }
    let status = run.execute(at + 1);
    if status.is_completed() {
        run.reset(at + 1);
    }
    if status == Status::Success {
        run.state(at).cursor = SUCCEEDED;
        return Status::Running;
    }
    status
}
