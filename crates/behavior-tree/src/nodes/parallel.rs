//! `Parallel`: ticks all children in every tick, until enough have succeeded or too many have failed.
//!
//! | port | type | default | |
//! |---|---|---|---|
//! | `success_count` | int | -1 | successes needed; negative counts from the end: -1 is all, -2 all but one |
//! | `failure_count` | int | 1 | failures that end it; negative as above |
//!
//! The children that have not finished are ticked in order. After each of them:
//!
//! | | the node |
//! |---|---|
//! | successes have reached `success_count` | resets all children, returns success |
//! | `success_count` is negative, and successes plus skipped children have reached it | resets all children, returns success |
//! | failures equal `failure_count`, or success has become impossible | resets all children, returns failure |
//! | all children were skipped | returns skipped |
//! | else | returns running |
//!
//! The children after the one that decided are not ticked in that tick. A finished child waits for the others and is not
//! ticked again. With a positive `success_count` a skipped child does not count: if too few others are left, the node
//! runs forever. Loading refuses a count above the number of children.
//!
//! Halted: halts all running children, forgets the counts.

use super::built_in::{BuiltIn, BuiltInPort, Class, Holds};
use super::run::Run;
use crate::kind::{Kind, Param};
use crate::record::error::NodeErrorKind;
use crate::status::{NodeStatus, Status};

pub(super) const BUILT_INS: &[BuiltIn] = &[BuiltIn::new("Parallel", Class::Control, |node| Kind::Parallel {
    success: node.numbers[0],
    failure: node.numbers[1],
})
.with_ports(&[
    BuiltInPort::new("success_count", Holds::Count, "children that must succeed; negative counts from the end")
        .with_default("-1"),
    BuiltInPort::new("failure_count", Holds::Count, "failures that end it; negative counts from the end")
        .with_default("1"),
])];

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, success: Param, failure: Param) -> Status {
    let shape = run.shape;
    let children = u32::from(shape.nodes[at].children);
    let (Some(success), Some(failure)) = (run.number(at, success), run.number(at, failure)) else {
        return run.give_up(at);
    };
    let (needed, tolerated) = (threshold(success, children), threshold(failure, children));
    if children < needed || children < tolerated {
        run.fail_with(at, NodeErrorKind::Port(format!("a count is above the number of children, {children}")));
        return run.give_up(at);
    }
    run.set_status(at, NodeStatus::Running);
    let mut skipped = 0;
    for child in shape.children(at) {
        let mut has_failed = false;
        if !run.status(child).is_completed() {
            match run.execute(child) {
                Status::Success => run.state(at).cursor += 1,
                Status::Failure => {
                    has_failed = true;
                    run.state(at).count += 1;
                }
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
            if !has_failed {
                // No child decided: no failure is tolerated at all, or a count in a key has changed.
                run.fail(at);
            }
            return run.give_up(at);
        }
    }
    if skipped == children { Status::Skipped } else { Status::Running }
}

/// A count of children. A negative one counts from the end, so that -1 means all.
pub(crate) fn threshold(count: i32, children: u32) -> u32 {
    let from_end = i64::from(children) + i64::from(count) + 1;
    let counted = if count < 0 { from_end.max(0) } else { i64::from(count) };
    u32::try_from(counted).unwrap_or(u32::MAX)
}
