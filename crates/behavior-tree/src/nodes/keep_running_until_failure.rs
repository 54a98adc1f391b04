//! # `KeepRunningUntilFailure`
//!
//! | the child answers | the node |
//! |---|---|
//! | success | resets the child, answers running; the child starts again at the next tick |
//! | failure | resets the child, answers failure |
//! | running, skipped | answers running |
//!
//! Halted: halts the child.

use super::{BuiltIn, Class};
use crate::kind::Kind;
use crate::run::Run;
use crate::status::{NodeStatus, Status};

pub(crate) const BUILT_IN: BuiltIn = BuiltIn {
    tag: "KeepRunningUntilFailure",
    class: Class::Decorator,
    children: 1..=1,
    ports: &[],
    kind: |_| Kind::KeepRunningUntilFailure,
};

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Status {
    run.set_status(at, NodeStatus::Running);
    let answer = run.execute(at + 1);
    if answer.is_completed() {
        run.reset(at + 1);
    }
    if answer == Status::Failure { Status::Failure } else { Status::Running }
}
