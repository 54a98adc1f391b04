//! # `Parallel`
//!
//! All children side by side, until enough have succeeded or too many have failed.
//!
//! | port | type | default | |
//! |---|---|---|---|
//! | `success_count` | int | -1 | successes needed; negative counts from the end: -1 is all, -2 all but one |
//! | `failure_count` | int | 1 | failures that end it; negative as above |
//!
//! The children that have not finished are ticked in order, and after each of them the node looks:
//!
//! | | the node |
//! |---|---|
//! | successes have reached `success_count` | halts and resets all children, answers success |
//! | `success_count` is negative and successes plus skipped ones have reached it | halts and resets all children, answers success |
//! | failures equal `failure_count`, or success has become impossible | halts and resets all children, answers failure |
//! | all children were skipped | answers skipped |
//! | else | answers running |
//!
//! The children after the one that decided are not ticked in that tick. A finished child waits for the others and is not
//! ticked again. With a positive `success_count` a skipped child does not count: if too few others are left, the node
//! runs for ever. A count above the number of children is a mistake that loading finds.
//!
//! Halted: halts all running children, forgets the counts.

use super::{BuiltIn, BuiltInPort, Class, MANY};
use crate::fault::FaultKind;
use crate::kind::{Kind, Param};
use crate::run::Run;
use crate::status::{NodeStatus, Status};

pub(crate) const BUILT_IN: BuiltIn = BuiltIn {
    tag: "Parallel",
    class: Class::Control,
    children: 1..=MANY,
    ports: &[
        BuiltInPort::number(
            "success_count",
            Some("-1"),
            "how many children must succeed; negative counts from the end",
        ),
        BuiltInPort::number(
            "failure_count",
            Some("1"),
            "how many children may fail before it ends; negative counts from the end",
        ),
    ],
    kind: |it| Kind::Parallel { success: it[0], failure: it[1] },
};

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, success: Param, failure: Param) -> Status {
    let shape = run.shape;
    let children = shape.nodes[at].children;
    let (Some(success), Some(failure)) = (run.number(at, success), run.number(at, failure)) else {
        return run.give_up(at);
    };
    let (needed, tolerated) = (threshold(success, children), threshold(failure, children));
    if children < needed || children < tolerated {
        run.report(at, FaultKind::Port(format!("a threshold is above the number of children, {children}")));
        return run.give_up(at);
    }
    run.set_status(at, NodeStatus::Running);
    let mut skipped = 0;
    for child in shape.children(at) {
        if !run.status(child).is_completed() {
            match run.execute(child) {
                Status::Success => run.state(at).cursor += 1,
                Status::Failure => run.state(at).count += 1,
                Status::Skipped => skipped += 1,
                Status::Running => {}
            }
        }
        let (succeeded, failed) = (run.state(at).cursor, run.state(at).count);
        if needed <= succeeded || (success < 0 && needed <= succeeded + skipped) {
            run.finish(at);
            return Status::Success;
        }
        if children - failed < needed || failed == tolerated {
            return run.give_up(at);
        }
    }
    if skipped == children { Status::Skipped } else { Status::Running }
}

/// A count of children; a negative one counts from the end, so that -1 means all.
pub(crate) fn threshold(count: i32, children: u32) -> u32 {
    let from_end = i64::from(children) + i64::from(count) + 1;
    let counted = if count < 0 { from_end.max(0) } else { i64::from(count) };
    u32::try_from(counted).unwrap_or(u32::MAX)
}
