//! `Timeout`: fails if its child runs too long.
//!
//! | port | type | default | |
//! |---|---|---|---|
//! | `msec` | unsigned | | milliseconds the child may run, from its first tick; 0 means no limit |
//!
//! | | the node |
//! |---|---|
//! | the time is up and the child runs | halts the child without ticking it, returns failure |
//! | the child returns success, failure | resets the child, returns the same |
//! | the child returns running | returns running, asks for a tick when the time is up |
//! | the child returns skipped | returns skipped; the time goes on |
//!
//! The time is only checked when the tree is ticked. BehaviorTree.CPP halts the child from a thread of its own.
//! Halted: halts the child; the time starts from 0 next time.

use super::built_in::{BuiltIn, BuiltInPort, Class};
use super::run::Run;
use crate::kind::{Kind, Param};
use crate::record::cause::Cause;
use crate::status::{NodeStatus, Status};

pub(super) const BUILT_INS: &[BuiltIn] =
    &[BuiltIn::new("Timeout", Class::Decorator, |node| Kind::Timeout { limit: node.numbers[0] })
        .with_ports(&[BuiltInPort::milliseconds("msec", "milliseconds the child may run; 0 means no limit")])];

const STARTED: u32 = 1;
const NO_LIMIT: u64 = u64::MAX;

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, limit: Param) -> Status {
    let Some(limit) = run.number(at, limit) else {
        return run.give_up(at);
    };
    if run.state(at).cursor != STARTED {
        let deadline = if limit <= 0 { NO_LIMIT } else { run.now().saturating_add(nanoseconds(limit)) };
        let state = run.state(at);
        (state.cursor, state.memo) = (STARTED, deadline);
        run.set_status(at, NodeStatus::Running);
    }
    let deadline = run.state(at).memo;
    if deadline <= run.now() && run.status(at + 1) == NodeStatus::Running {
        run.finish(at);
        return run.fail_because(at, Cause::Happened(format!("not finished within {limit} ms").into()));
    }
    let status = run.execute(at + 1);
    match status {
        Status::Success | Status::Failure => run.finish(at),
        Status::Running if deadline != NO_LIMIT => run.tick_at(deadline),
        Status::Running | Status::Skipped => {}
    }
    status
}

/// The milliseconds of a port in nanoseconds. Negative ones count as 0.
pub(super) fn nanoseconds(milliseconds: i32) -> u64 {
    u64::try_from(milliseconds).unwrap_or(0) * 1_000_000
}
