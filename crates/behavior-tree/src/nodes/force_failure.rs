//! # `ForceFailure`
//!
//! | the child answers | the node |
//! |---|---|
//! | success, failure | resets the child, answers failure |
//! | running, skipped | answers the same |
//!
//! Halted: halts the child.

use super::{BuiltIn, Class};
use crate::kind::Kind;
use crate::run::Run;
use crate::status::{NodeStatus, Status};

pub(crate) const BUILT_IN: BuiltIn =
    BuiltIn { tag: "ForceFailure", class: Class::Decorator, children: 1..=1, ports: &[], kind: |_| Kind::ForceFailure };

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Status {
    run.set_status(at, NodeStatus::Running);
    let answer = run.execute(at + 1);
    if !answer.is_completed() {
        return answer;
    }
    run.reset(at + 1);
    Status::Failure
}
