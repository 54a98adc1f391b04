//! `ReactiveFallback`: ticks its children in order at every tick, until one does not fail.
//!
//! For alternatives by urgency: as soon as a more urgent child can run, the running one is halted.
//!
//! | the child returns | the node |
//! |---|---|
//! | failure | goes on with the next child; after the last one resets all children, returns failure |
//! | success | resets all children, returns success |
//! | running | resets all other children, returns running |
//! | skipped | resets this child, goes on with the next one; if all were skipped, returns skipped |
//!
//! A child that takes over is started before the one it replaces is halted. Where both command the same thing, collect
//! the commands of a tick and send them afterwards, or the vehicle sees both for a moment.
//!
//! Halted: halts the running child.

use super::built_in::{BuiltIn, Class};
use super::run::Run;
use crate::kind::Kind;
use crate::status::{NodeStatus, Status};

pub(super) const BUILT_INS: &[BuiltIn] =
    &[BuiltIn::new("ReactiveFallback", Class::Control, |_| Kind::ReactiveFallback)];

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Status {
    let shape = run.shape;
    run.set_status(at, NodeStatus::Running);
    let mut decider = None;
    for child in shape.children(at) {
        match run.execute(child) {
            Status::Running => {
                run.reset_children_but(at, child);
                return Status::Running;
            }
            Status::Success => {
                run.reset_children(at);
                return Status::Success;
            }
            Status::Failure => decider = Some(run.decider()),
            Status::Skipped => run.reset(child),
        }
    }
    run.reset_children(at);
    match decider {
        Some(decider) => run.fail_as(decider),
        None => Status::Skipped,
    }
}
