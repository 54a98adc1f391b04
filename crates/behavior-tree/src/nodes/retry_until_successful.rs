//! `RetryUntilSuccessful`: starts its child again when it fails, a number of times.
//!
//! | port | type | default | |
//! |---|---|---|---|
//! | `num_attempts` | int | | how often the child may be started; -1 is forever |
//!
//! | the child returns | the node |
//! |---|---|
//! | success | resets the child, returns success; counts from 0 next time |
//! | failure, attempts are left | resets the child and starts it again; if this attempt began in the same tick, returns running first and asks for another tick at once |
//! | failure, no attempt is left | resets the child, returns failure; counts from 0 next time |
//! | running | returns running |
//! | skipped | resets the child, returns skipped; keeps the count |
//!
//! With `num_attempts` 0 the child is never ticked and the node returns failure. Halted: halts the child, counts from 0
//! next time.

use super::built_in::{BuiltIn, BuiltInPort, Class, Holds};
use super::run::Run;
use crate::kind::{Kind, Param};
use crate::status::{NodeStatus, Status};

const NUM_ATTEMPTS: BuiltInPort =
    BuiltInPort::new("num_attempts", Holds::Number { min: i32::MIN }, "how often the child may start; -1 is forever");

pub(super) const BUILT_INS: &[BuiltIn] = &[BuiltIn::new("RetryUntilSuccessful", Class::Decorator, |node| {
    Kind::RetryUntilSuccessful { attempts: node.numbers[0] }
})
.with_ports(&[NUM_ATTEMPTS])];

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, attempts: Param) -> Status {
    let Some(mut limit) = run.number(at, attempts) else {
        return run.give_up(at);
    };
    run.set_status(at, NodeStatus::Running);
    let mut has_failed = false;
    while is_left(run.state(at).count, limit) {
        let before = run.status(at + 1);
        match run.execute(at + 1) {
            Status::Success => {
                run.finish(at);
                return Status::Success;
            }
            Status::Failure => {
                has_failed = true;
                run.state(at).count = run.state(at).count.saturating_add(1);
                run.reset(at + 1);
                // The child may have changed the key that holds the limit.
                match run.number(at, attempts) {
                    Some(new_limit) => limit = new_limit,
                    None => return run.give_up(at),
                }
                if before == NodeStatus::Idle && is_left(run.state(at).count, limit) {
                    run.tick_again();
                    return Status::Running;
                }
            }
            Status::Running => return Status::Running,
            Status::Skipped => {
                run.reset(at + 1);
                return Status::Skipped;
            }
        }
    }
    if !has_failed {
        // No attempt is allowed, or the limit in a key has changed.
        run.fail(at);
    }
    run.give_up(at)
}

/// True if a node that may do something `limit` times has done it fewer times. -1 means no limit.
pub(super) fn is_left(count: u32, limit: i32) -> bool {
    limit == -1 || i64::from(count) < i64::from(limit)
}
