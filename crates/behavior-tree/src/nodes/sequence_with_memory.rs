//! `SequenceWithMemory`: a [`Sequence`](super::sequence) that does not repeat what has succeeded.
//!
//! After a failure, and after a halt, it continues at the child where it was.
//!
//! | the child returns | the sequence |
//! |---|---|
//! | success | goes on with the next child; if the child was started in the same tick and is not the last, returns running first and asks for another tick at once |
//! | failure | resets this child and those after it, returns failure; continues at this child next time |
//! | running | returns running; continues at this child next time |
//! | skipped | goes on with the next child; if all were skipped, returns skipped |
//!
//! After the last child it resets all children and starts from the first one next time. Halted: halts the running child,
//! keeps its place.

use super::built_in::{BuiltIn, Class};
use super::run::Run;
use super::sequence::pause;
use crate::kind::{Kind, NodeState};
use crate::status::{NodeStatus, Status};

pub(super) const BUILT_INS: &[BuiltIn] =
    &[BuiltIn::new("SequenceWithMemory", Class::Control, |_| Kind::SequenceWithMemory).keeping_its_place()];

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Status {
    let shape = run.shape;
    let end = shape.after(at);
    if run.status(at) == NodeStatus::Idle {
        run.state(at).count = 0;
    }
    run.set_status(at, NodeStatus::Running);
    let state = *run.state(at);
    let mut child = if state.cursor == 0 { at + 1 } else { state.cursor as usize };
    let mut skipped = state.count;
    while child < end {
        let before = run.status(child);
        match run.execute(child) {
            Status::Running => return pause(run, at, child, skipped),
            Status::Failure => {
                pause(run, at, child, skipped);
                while child < end {
                    run.reset(child);
                    child = shape.after(child);
                }
                return Status::Failure;
            }
            Status::Success => {
                child = shape.after(child);
                if before == NodeStatus::Idle && child < end {
                    run.tick_again();
                    return pause(run, at, child, skipped);
                }
            }
            Status::Skipped => {
                child = shape.after(child);
                skipped += 1;
            }
        }
    }
    run.reset_children(at);
    *run.state(at) = NodeState::default();
    if skipped == u32::from(shape.nodes[at].children) { Status::Skipped } else { Status::Success }
}
