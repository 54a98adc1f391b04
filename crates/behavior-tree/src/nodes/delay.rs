//! `Delay`: waits before it ticks its child.
//!
//! | port | type | default | |
//! |---|---|---|---|
//! | `delay_msec` | unsigned | | milliseconds to wait before the child is ticked |
//!
//! | | the node |
//! |---|---|
//! | the time is not up | returns running, asks for a tick when it is |
//! | the time is up | ticks the child and returns the same; once the child has finished, resets it and waits again next time |
//!
//! Halted: halts the child, waits again next time.

use super::built_in::{BuiltIn, BuiltInPort, Class};
use super::run::Run;
use super::timeout::nanoseconds;
use crate::kind::{Kind, Param};
use crate::status::{NodeStatus, Status};

pub(super) const BUILT_INS: &[BuiltIn] =
    &[BuiltIn::new("Delay", Class::Decorator, |node| Kind::Delay { delay: node.numbers[0] })
        .with_ports(&[BuiltInPort::milliseconds("delay_msec", "milliseconds to wait before the child is ticked")])];

const STARTED: u32 = 1;

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, delay: Param) -> Status {
    let Some(delay) = run.number(at, delay) else {
        return run.give_up(at);
    };
    if run.state(at).cursor != STARTED {
        let until = run.now().saturating_add(nanoseconds(delay));
        let state = run.state(at);
        (state.cursor, state.memo) = (STARTED, until);
        run.set_status(at, NodeStatus::Running);
    }
    let until = run.state(at).memo;
    if run.now() < until {
        run.tick_at(until);
        return Status::Running;
    }
    let status = run.execute(at + 1);
    if status.is_completed() {
        run.finish(at);
    }
    status
}
