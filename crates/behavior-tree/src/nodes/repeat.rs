//! # `Repeat`
//!
//! | port | type | default | |
//! |---|---|---|---|
//! | `num_cycles` | int | | how often the child must succeed; -1 for ever |
//!
//! | the child answers | the node |
//! |---|---|
//! | success, cycles are left | resets the child and starts it again; if this cycle began in this very tick, answers running first and asks to be ticked again at once |
//! | success, none is left | resets the child, answers success; counts anew next time |
//! | failure | resets the child, answers failure; counts anew next time |
//! | running | answers running |
//! | skipped | resets the child, answers skipped; keeps the count |
//!
//! With `num_cycles` 0 the child is never ticked and the node answers success. Halted: halts the child, counts anew.

use super::retry_until_successful::is_left;
use super::{BuiltIn, BuiltInPort, Class};
use crate::kind::{Kind, Param};
use crate::run::Run;
use crate::status::{NodeStatus, Status};

pub(crate) const BUILT_IN: BuiltIn = BuiltIn {
    tag: "Repeat",
    class: Class::Decorator,
    children: 1..=1,
    ports: &[BuiltInPort::number("num_cycles", None, "how often the child must succeed; -1 for ever")],
    kind: |it| Kind::Repeat(it[0]),
};

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, cycles: Param) -> Status {
    let Some(limit) = run.number(at, cycles) else {
        return run.give_up(at);
    };
    run.set_status(at, NodeStatus::Running);
    while is_left(run.state(at).count, limit) {
        let before = run.status(at + 1);
        match run.execute(at + 1) {
            Status::Success => {
                run.state(at).count = run.state(at).count.saturating_add(1);
                run.reset(at + 1);
                if before == NodeStatus::Idle && is_left(run.state(at).count, limit) {
                    run.tick_again();
                    return Status::Running;
                }
            }
            Status::Failure => return run.give_up(at),
            Status::Running => return Status::Running,
            Status::Skipped => {
                run.reset(at + 1);
                return Status::Skipped;
            }
        }
    }
    run.finish(at);
    Status::Success
}
