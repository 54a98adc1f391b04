//! # `RetryUntilSuccessful`
//!
//! | port | type | default | |
//! |---|---|---|---|
//! | `num_attempts` | int | | how often the child may be started; -1 for ever |
//!
//! | the child answers | the node |
//! |---|---|
//! | success | resets the child, answers success; counts anew next time |
//! | failure, attempts are left | resets the child and starts it again; if this attempt began in this very tick, answers running first and asks to be ticked again at once |
//! | failure, none is left | resets the child, answers failure; counts anew next time |
//! | running | answers running |
//! | skipped | resets the child, answers skipped; keeps the count |
//!
//! With `num_attempts` 0 the child is never ticked and the node answers failure. Halted: halts the child, counts anew.

use super::{BuiltIn, BuiltInPort, Class};
use crate::kind::{Kind, Param};
use crate::run::Run;
use crate::status::{NodeStatus, Status};

pub(crate) const BUILT_IN: BuiltIn = BuiltIn {
    tag: "RetryUntilSuccessful",
    class: Class::Decorator,
    children: 1..=1,
    ports: &[BuiltInPort::number("num_attempts", None, "how often the child may be started; -1 for ever")],
    kind: |it| Kind::RetryUntilSuccessful(it[0]),
};

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, attempts: Param) -> Status {
    let Some(mut limit) = run.number(at, attempts) else {
        return run.give_up(at);
    };
    run.set_status(at, NodeStatus::Running);
    while is_left(run.state(at).count, limit) {
        let before = run.status(at + 1);
        match run.execute(at + 1) {
            Status::Success => {
                run.finish(at);
                return Status::Success;
            }
            Status::Failure => {
                run.state(at).count = run.state(at).count.saturating_add(1);
                run.reset(at + 1);
                // The child may have changed the key the limit comes from.
                match run.number(at, attempts) {
                    Some(now) => limit = now,
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
    run.give_up(at)
}

/// True if a node that may do something `limit` times has not yet done it that often; -1 is without end.
pub(super) fn is_left(count: u32, limit: i32) -> bool {
    limit == -1 || i64::from(count) < i64::from(limit)
}
