//! # `SequenceWithMemory`
//!
//! A [`Sequence`](super::sequence) that does not repeat what has succeeded: after a failure, and after a halt, it
//! continues at the child where it was.
//!
//! | the child answers | the sequence |
//! |---|---|
//! | success | goes on with the next child; if the child was also started in this tick and is not the last, answers running and asks to be ticked again at once |
//! | failure | halts this child and those after it, answers failure; continues at this child next time |
//! | running | answers running; continues at this child next time |
//! | skipped | goes on with the next child; if all were skipped, answers skipped |
//!
//! After the last child it resets all and starts from the first one next time. Halted: halts the running child and
//! keeps its place.

use super::sequence::pause;
use super::{BuiltIn, Class, MANY};
use crate::kind::Kind;
use crate::run::Run;
use crate::status::{NodeStatus, Status};

pub(crate) const BUILT_IN: BuiltIn = BuiltIn {
    tag: "SequenceWithMemory",
    class: Class::Control,
    children: 1..=MANY,
    ports: &[],
    kind: |_| Kind::SequenceWithMemory,
};

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Status {
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
    *run.state(at) = Default::default();
    if skipped == shape.nodes[at].children { Status::Skipped } else { Status::Success }
}
