//! `ForceSuccess`: succeeds when its child has finished.
//!
//! | the child returns | the node |
//! |---|---|
//! | success, failure | resets the child, returns success |
//! | running, skipped | returns the same |
//!
//! Halted: halts the child.

use super::built_in::{BuiltIn, Class};
use super::run::Run;
use crate::kind::Kind;
use crate::status::{NodeStatus, Status};

pub(super) const BUILT_INS: &[BuiltIn] = &[BuiltIn::new("ForceSuccess", Class::Decorator, |_| Kind::ForceSuccess)];

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Status {
    run.set_status(at, NodeStatus::Running);
    let status = run.execute(at + 1);
    if status.is_completed() {
        run.reset(at + 1);
    }
    if status == Status::Failure { Status::Success } else { status }
}
