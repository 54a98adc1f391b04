//! # `Sequence`
//!
//! Children in order, until one fails. Remembers the running child: those before it are not asked again.
//!
//! | the child answers | the sequence |
//! |---|---|
//! | success | goes on with the next child; after the last one resets all and answers success |
//! | failure | halts and resets all children, answers failure; starts from the first child next time |
//! | running | answers running; continues at this child next time |
//! | skipped | goes on with the next child; if all were skipped, answers skipped |
//!
//! Halted: halts the running child and starts from the first one next time.

use super::{BuiltIn, Class, MANY};
use crate::kind::Kind;
use crate::run::Run;
use crate::status::{NodeStatus, Status};

pub(crate) const BUILT_IN: BuiltIn = BuiltIn {
    tag: "Sequence",
    class: Class::Control,
    children: 1..=MANY,
    ports: &[],
    kind: |_| Kind::Sequence { interruptible: false },
};

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, interruptible: bool) -> Status {
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
    if skipped == shape.nodes[at].children { Status::Skipped } else { Status::Success }
}

/// Leaves the node running, to go on at `child`.
pub(super) fn pause<Ctx>(run: &mut Run<'_, Ctx>, at: usize, child: usize, skipped: u32) -> Status {
    let state = run.state(at);
    state.cursor = child as u32;
    state.count = skipped;
    Status::Running
}
