//! # `ReactiveSequence`
//!
//! Asks all children anew, first to last, at every tick: guards before an action: as soon as one fails, the action is halted.
//!
//! | the child answers | the node |
//! |---|---|
//! | success | goes on with the next child; after the last one resets all and answers success |
//! | failure | halts and resets all children, answers failure |
//! | running | halts and resets all other children, answers running |
//! | skipped | resets this child, goes on with the next one; if all were skipped, answers skipped |
//!
//! A child that takes over is started before the one it replaces is halted. Where both command the same thing, collect
//! the commands of a tick and send them afterwards, or the vehicle sees both for a moment.
//!
//! Halted: halts the running child.

use super::{BuiltIn, Class, MANY};
use crate::kind::Kind;
use crate::run::Run;
use crate::status::{NodeStatus, Status};

pub(crate) const BUILT_IN: BuiltIn = BuiltIn {
    tag: "ReactiveSequence",
    class: Class::Control,
    children: 1..=MANY,
    ports: &[],
    kind: |_| Kind::ReactiveSequence,
};

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Status {
    let shape = run.shape;
    run.set_status(at, NodeStatus::Running);
    let mut all_skipped = true;
    for child in shape.children(at) {
        let answer = run.execute(child);
        all_skipped &= answer == Status::Skipped;
        match answer {
            Status::Running => {
                for other in shape.children(at) {
                    if other != child {
                        run.reset(other);
                    }
                }
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
