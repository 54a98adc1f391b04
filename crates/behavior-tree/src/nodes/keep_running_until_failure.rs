//! `KeepRunningUntilFailure`: ticks its child again and again until it fails.
//!
//! | the child returns | the node |
//! |---|---|
//! | success | resets the child, returns running; starts the child again at the next tick |
//! | failure | resets the child, returns failure |
//! | running, skipped | returns running |
//!
//! Halted: halts the child.

use super::built_in::{BuiltIn, Class};
use super::run::Run;
use crate::kind::Kind;
use crate::status::{NodeStatus, Status};

pub(super) const BUILT_INS: &[BuiltIn] =
    &[BuiltIn::new("KeepRunningUntilFailure", Class::Decorator, |_| Kind::KeepRunningUntilFailure)];

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Status {
    run.set_status(at, NodeStatus::Running);
    let status = run.execute(at + 1);
    if status.is_completed() {
        run.reset(at + 1);
    }
    if status == Status::Failure { Status::Failure } else { Status::Running }
}
