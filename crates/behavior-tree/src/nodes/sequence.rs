//! `Sequence`, `AsyncSequence`: ticks its children in order until one fails.
//!
//! Remembers the running child and does not tick those before it again.
//!
//! | the child returns | the sequence |
//! |---|---|
//! | success | goes on with the next child; after the last one resets all children, returns success |
//! | success in the tick it was started, it is not the last, `AsyncSequence` | returns running, asks for another tick at once; goes on with the next child |
//! | failure | resets all children, returns failure; starts from the first child next time |
//! | running | returns running; continues at this child next time |
//! | skipped | goes on with the next child; if all were skipped, returns skipped |
//!
//! Halted: halts the running child, starts from the first child next time.

use super::built_in::{BuiltIn, Class};
use super::run::Run;
use crate::kind::Kind;
use crate::status::{NodeStatus, Status};

pub(super) const BUILT_INS: &[BuiltIn] = &[
    BuiltIn::new("Sequence", Class::Control, |_| Kind::Sequence { interruptible: false }),
    BuiltIn::new("AsyncSequence", Class::Control, |_| Kind::Sequence { interruptible: true }),
];

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, interruptible: bool) -> Status {
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
            Status::Failure => return run.give_up(at),
            Status::Success => {
                child = shape.after(child);
                if interruptible && before == NodeStatus::Idle && child < end {
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
    run.finish(at);
    if skipped == u32::from(shape.nodes[at].children) { Status::Skipped } else { Status::Success }
}

/// Leaves the node running, to go on at `child`.
pub(super) fn pause<Ctx>(run: &mut Run<'_, Ctx>, at: usize, child: usize, skipped: u32) -> Status {
    let state = run.state(at);
    (state.cursor, state.count) = (child as u32, skipped);
    Status::Running
}
