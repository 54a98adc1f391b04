//! `ReactiveSequence`: ticks its children in order at every tick, until one does not succeed.
//!
//! For guards before an action: as soon as a guard fails, the action is halted.
//!
//! | the child returns | the node |
//! |---|---|
//! | success | goes on with the next child; after the last one resets all children, returns success |
//! | failure | resets all children, returns failure |
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
    &[BuiltIn::new("ReactiveSequence", Class::Control, |_| Kind::ReactiveSequence)];

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Status {
    let shape = run.shape;
    run.set_status(at, NodeStatus::Running);
    let mut all_skipped = true;
    for child in shape.children(at) {
        let status = run.execute(child);
        all_skipped &= status == Status::Skipped;
        match status {
            Status::Running => {
                run.reset_children_but(at, child);
                return Status::Running;
            }
            Status::Failure => {
                run.reset_children(at);
                return Status::Failure;
            }
            Status::Success => {}
            Status::Skipped => run.reset(child),
        }
    }
    run.reset_children(at);
    if all_skipped { Status::Skipped } else { Status::Success }
}
