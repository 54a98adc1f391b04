//! # `Timeout`
//!
//! | port | type | default | |
//! |---|---|---|---|
//! | `msec` | unsigned | | milliseconds the child may run, from its first tick; 0 is no limit |
//!
//! | | the node |
//! |---|---|
//! | the time is up and the child runs | halts it without ticking it, answers failure |
//! | the child answers success, failure | resets it, answers the same |
//! | the child answers running | answers running, and asks to be ticked when the time is up |
//! | the child answers skipped | answers skipped; the time goes on |
//!
//! The limit is only looked at when the tree is ticked: BehaviorTree.CPP halts the child from a thread of its own.
//! Halted: halts the child, the time starts anew.

use super::{BuiltIn, BuiltInPort, Class};
use crate::cause::Cause;
use crate::kind::{Kind, Param};
use crate::run::Run;
use crate::status::{NodeStatus, Status};
use crate::value::Value;

pub(crate) const BUILT_IN: BuiltIn = BuiltIn {
    tag: "Timeout",
    class: Class::Decorator,
    children: 1..=1,
    ports: &[BuiltInPort::milliseconds("msec", "milliseconds the child may run; 0 is no limit")],
    kind: |it| Kind::Timeout(it[0]),
};

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, limit: Param) -> Status {
    let Some(limit) = run.number(at, limit) else {
        return run.give_up(at);
    };
    if run.state(at).cursor == 0 {
        let deadline = if limit <= 0 { u64::MAX } else { run.now().saturating_add(nanoseconds(limit)) };
        let state = run.state(at);
        (state.cursor, state.time) = (STARTED, deadline);
        run.set_status(at, NodeStatus::Running);
    }
    let deadline = run.state(at).time;
    if deadline <= run.now() && run.status(at + 1) == NodeStatus::Running {
        run.finish(at);
        let limit = Value::Int(i64::from(limit));
        run.record_cause(at, Cause::new("time limit in milliseconds", None, Some(limit)));
        return Status::Failure;
    }
    let answer = run.execute(at + 1);
    match answer {
        Status::Success | Status::Failure => {
            run.finish(at);
        }
        Status::Running if deadline != u64::MAX => run.tick_at(deadline),
        Status::Running | Status::Skipped => {}
    }
    answer
}

const STARTED: u32 = 1;

/// Milliseconds in a port, negative ones counting as none.
pub(super) fn nanoseconds(milliseconds: i32) -> u64 {
    u64::try_from(milliseconds).unwrap_or(0) * 1_000_000
}
