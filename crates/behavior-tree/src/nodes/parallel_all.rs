//! # `ParallelAll`
//!
//! All children side by side, until every one has finished.
//!
//! | port | type | default | |
//! |---|---|---|---|
//! | `max_failures` | int | 1 | with this many failures it answers failure in the end; negative counts from the end: -1 is all |
//!
//! | after all unfinished children have been ticked | the node |
//! |---|---|
//! | all were skipped | answers skipped |
//! | all have finished or were skipped, failures have reached `max_failures` | resets all children, answers failure |
//! | all have finished or were skipped | resets all children, answers success |
//! | else | answers running |
//!
//! Halted: halts all running children, forgets the counts.

use super::parallel::threshold;
use super::{BuiltIn, BuiltInPort, Class, MANY};
use crate::fault::FaultKind;
use crate::kind::{Kind, Param};
use crate::run::Run;
use crate::status::{NodeStatus, Status};

pub(crate) const BUILT_IN: BuiltIn = BuiltIn {
    tag: "ParallelAll",
    class: Class::Control,
    children: 1..=MANY,
    ports: &[BuiltInPort::number("max_failures", Some("1"), "with this many failures it fails in the end")],
    kind: |it| Kind::ParallelAll { max_failures: it[0] },
};

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, max_failures: Param) -> Status {
    let shape = run.shape;
    let children = shape.nodes[at].children;
    let Some(max_failures) = run.number(at, max_failures) else {
        return run.give_up(at);
    };
    let limit = threshold(max_failures, children);
    if children < limit {
        run.report(at, FaultKind::Port(format!("`max_failures` is above the number of children, {children}")));
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
    let failed = run.state(at).count;
    run.finish(at);
    Status::from_bool(failed < limit)
}
