//! # `Sleep`
//!
//! | port | type | default | |
//! |---|---|---|---|
//! | `msec` | unsigned | | milliseconds to wait |
//!
//! | | the node |
//! |---|---|
//! | started, with 0 | answers success |
//! | started | answers running, and asks to be ticked when the time is up |
//! | running, the time is not up | answers running |
//! | running, the time is up | answers success |
//!
//! Halted: the time starts anew.

use super::timeout::nanoseconds;
use super::{BuiltIn, BuiltInPort, Class};
use crate::kind::{Kind, Param};
use crate::run::Run;
use crate::status::{NodeStatus, Status};

pub(crate) const BUILT_IN: BuiltIn = BuiltIn {
    tag: "Sleep",
    class: Class::Action,
    children: 0..=0,
    ports: &[BuiltInPort::milliseconds("msec", "milliseconds to wait")],
    kind: |it| Kind::Sleep(it[0]),
};

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, duration: Param) -> Status {
    match run.status(at) {
        NodeStatus::Idle => {
            let Some(duration) = run.number(at, duration) else {
                return Status::Failure;
            };
            run.state(at).time = run.now().saturating_add(nanoseconds(duration));
        }
        NodeStatus::Running => {}
        NodeStatus::Success => return Status::Success,
        NodeStatus::Failure => return Status::Failure,
    }
    let time = run.state(at).time;
    if run.now() < time {
        run.tick_at(time);
        return Status::Running;
    }
    Status::Success
}
