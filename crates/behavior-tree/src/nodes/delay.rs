//! # `Delay`
//!
//! | port | type | default | |
//! |---|---|---|---|
//! | `delay_msec` | unsigned | | milliseconds to wait before the child is ticked |
//!
//! | | the node |
//! |---|---|
//! | the time is not up | answers running, and asks to be ticked when it is |
//! | the time is up | ticks the child and answers the same; once it has finished, resets it and waits anew next time |
//!
//! Halted: halts the child, the time starts anew.

use super::timeout::nanoseconds;
use super::{BuiltIn, BuiltInPort, Class};
use crate::kind::{Kind, Param};
use crate::run::Run;
use crate::status::{NodeStatus, Status};

pub(crate) const BUILT_IN: BuiltIn = BuiltIn {
    tag: "Delay",
    class: Class::Decorator,
    children: 1..=1,
    ports: &[BuiltInPort::milliseconds("delay_msec", "milliseconds to wait before the child is ticked")],
    kind: |it| Kind::Delay(it[0]),
};

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, delay: Param) -> Status {
    let Some(delay) = run.number(at, delay) else {
        return run.give_up(at);
    };
    if run.state(at).cursor == 0 {
        let time = run.now().saturating_add(nanoseconds(delay));
        let state = run.state(at);
        (state.cursor, state.time) = (STARTED, time);
        run.set_status(at, NodeStatus::Running);
    }
    let time = run.state(at).time;
    if run.now() < time {
        run.tick_at(time);
        return Status::Running;
    }
    let answer = run.execute(at + 1);
    if answer.is_completed() {
        run.finish(at);
    }
    answer
}

const STARTED: u32 = 1;
