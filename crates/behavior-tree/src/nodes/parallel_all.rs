//! `ParallelAll`: ticks all children in every tick, until every one has finished.
//!
//! | port | type | default | |
//! |---|---|---|---|
//! | `max_failures` | int | 1 | returns failure in the end if this many children failed; negative counts from the end: -1 is all |
//!
//! | after all unfinished children have been ticked | the node |
//! |---|---|
//! | all were skipped | returns skipped |
//! | all have finished or were skipped, failures have reached `max_failures` | resets all children, returns failure |
//! | all have finished or were skipped | resets all children, returns success |
//! | else | returns running |
//!
//! Halted: halts all running children, forgets the counts.

use super::built_in::{BuiltIn, BuiltInPort, Class, Holds};
use super::parallel::threshold;
use super::run::Run;
use crate::kind::{Kind, Param};
use crate::record::error::NodeErrorKind;
use crate::status::{NodeStatus, Status};

pub(super) const BUILT_INS: &[BuiltIn] =
    &[BuiltIn::new("ParallelAll", Class::Control, |node| Kind::ParallelAll { max_failures: node.numbers[0] })
        .with_ports(&[
            BuiltInPort::new("max_failures", Holds::Count, "failures with which it fails in the end").with_default("1")
        ])];

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, max_failures: Param) -> Status {
    let shape = run.shape;
    let children = u32::from(shape.nodes[at].children);
    let Some(max_failures) = run.number(at, max_failures) else {
        return run.give_up(at);
    };
    let limit = threshold(max_failures, children);
    if children < limit {
        run.fail_with(at, NodeErrorKind::Port(format!("`max_failures` is above the number of children, {children}")));
        return run.give_up(at);
    }
    run.set_status(at, NodeStatus::Running);
    let (mut skipped, mut finished) = (0, 0);
    for child in shape.children(at) {
        if run.status(child).is_completed() {
            finished += 1;
            continue;
        }
        match run.execute(child) {
            Status::Success => finished += 1,
            Status::Failure => {
                finished += 1;
                run.state(at).count += 1;
                // The failure that reaches the limit decides, in the tick in which the last child finishes.
                if run.state(at).count <= limit {
                    run.state(at).memo = run.decider() as u64;
                }
            }
            Status::Skipped => skipped += 1,
            Status::Running => {}
        }
    }
    if skipped == children {
        return Status::Skipped;
    }
    if skipped + finished < children {
        return Status::Running;
    }
    let (failed, decider) = (run.state(at).count, run.state(at).memo as usize);
    run.finish(at);
    match failed {
        _ if failed < limit => Status::Success,
        // With a limit of 0 it fails although no child did.
        0 => run.fail(at),
        _ => run.fail_as(decider),
    }
}
