//! `Inverter`: succeeds when its child fails, and fails when it succeeds.
//!
//! | the child returns | the inverter |
//! |---|---|
//! | success | resets the child, returns failure |
//! | failure | resets the child, returns success |
//! | running, skipped | returns the same |
//!
//! Halted: halts the child.

use super::built_in::{BuiltIn, Class};
use super::run::Run;
use crate::kind::Kind;
use crate::status::{NodeStatus, Status};

pub(super) const BUILT_INS: &[BuiltIn] = &[BuiltIn::new("Inverter", Class::Decorator, |_| Kind::Inverter)];

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Status {
    run.set_status(at, NodeStatus::Running);
    let status = run.execute(at + 1);
    if status.is_completed() {
        run.reset(at + 1);
    }
    match status {
        Status::Success => run.fail(at),
        Status::Failure => Status::Success,
        unfinished => unfinished,
    }
}
