//! `Sleep`: succeeds after a time.
//!
//! | port | type | default | |
//! |---|---|---|---|
//! | `msec` | unsigned | | milliseconds to wait |
//!
//! | | the node |
//! |---|---|
//! | started, with 0 | returns success |
//! | started | returns running, asks for a tick when the time is up |
//! | running, the time is not up | returns running |
//! | running, the time is up | returns success |
//!
//! Halted: waits for the whole time again next time.

use super::built_in::{BuiltIn, BuiltInPort, Class};
use super::run::Run;
use super::timeout::nanoseconds;
use crate::kind::{Kind, Param};
use crate::status::{NodeStatus, Status};

pub(super) const BUILT_INS: &[BuiltIn] =
    &[BuiltIn::new("Sleep", Class::Action, |node| Kind::Sleep { duration: node.numbers[0] })
        .with_ports(&[BuiltInPort::milliseconds("msec", "milliseconds to wait")])];

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, duration: Param) -> Status {
    match run.status(at) {
        NodeStatus::Idle => {
            let Some(duration) = run.number(at, duration) else {
                return Status::Failure;
            };
            run.state(at).memo = run.now().saturating_add(nanoseconds(duration));
        }
        NodeStatus::Running => {}
        NodeStatus::Success => return Status::Success,
        NodeStatus::Failure => return run.fail_as(at),
    }
    let until = run.state(at).memo;
    if run.now() < until {
        run.tick_at(until);
        return Status::Running;
    }
    Status::Success
}
