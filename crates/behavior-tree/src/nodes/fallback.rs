//! `Fallback`, `AsyncFallback`: ticks its children in order until one succeeds.
//!
//! Remembers the running child and does not tick those before it again, so a more urgent child that becomes possible
//! meanwhile has to wait. [`ReactiveFallback`](super::reactive_fallback) does not.
//!
//! | the child returns | the fallback |
//! |---|---|
//! | success | resets all children, returns success; starts from the first child next time |
//! | failure | goes on with the next child; after the last one resets all children, returns failure |
//! | failure in the tick it was started, it is not the last, `AsyncFallback` | returns running, asks for another tick at once; goes on with the next child |
//! | running | returns running; continues at this child next time |
//! | skipped | goes on with the next child; if all were skipped, returns skipped |
//!
//! Halted: halts the running child, starts from the first child next time.

use super::built_in::{BuiltIn, Class};
use super::run::Run;
use super::sequence::pause;
use crate::kind::Kind;
use crate::status::{NodeStatus, Status};

pub(super) const BUILT_INS: &[BuiltIn] = &[
    BuiltIn::new("Fallback", Class::Control, |_| Kind::Fallback { interruptible: false }),
    BuiltIn::new("AsyncFallback", Class::Control, |_| Kind::Fallback { interruptible: true }),
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
            Status::Success => {
                run.finish(at);
                return Status::Success;
            }
            Status::Failure => {
                run.state(at).memo = run.decider() as u64;
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
    // The last child that failed decides, even if others after it were skipped.
    let decider = run.state(at).memo as usize;
    run.finish(at);
    if skipped == u32::from(shape.nodes[at].children) { Status::Skipped } else { run.fail_as(decider) }
}
