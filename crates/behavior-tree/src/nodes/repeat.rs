//! `Repeat`: repeats its child until it has succeeded a number of times.
//!
//! | port | type | default | |
//! |---|---|---|---|
//! | `num_cycles` | int | | how often the child must succeed; -1 is forever |
//!
//! | the child returns | the node |
//! |---|---|
//! | success, cycles are left | resets the child and starts it again; if this cycle began in the same tick, returns running first and asks for another tick at once |
//! | success, no cycle is left | resets the child, returns success; counts from 0 next time |
//! | failure | resets the child, returns failure; counts from 0 next time |
//! | running | returns running |
//! | skipped | resets the child, returns skipped; keeps the count |
//!
//! With `num_cycles` 0 the child is never ticked and the node returns success. Halted: halts the child, counts from 0
//! next time.

use super::built_in::{BuiltIn, BuiltInPort, Class, Holds};
use super::retry_until_successful::is_left;
use super::run::Run;
use crate::kind::{Kind, Param};
use crate::status::{NodeStatus, Status};

const NUM_CYCLES: BuiltInPort =
    BuiltInPort::new("num_cycles", Holds::Number { min: i32::MIN }, "how often the child must succeed; -1 is forever");

pub(super) const BUILT_INS: &[BuiltIn] =
    &[BuiltIn::new("Repeat", Class::Decorator, |node| Kind::Repeat { cycles: node.numbers[0] })
        .with_ports(&[NUM_CYCLES])];

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, cycles: Param) -> Status {
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
