//! # `Inverter`
//!
//! | the child answers | the inverter |
//! |---|---|
//! | success | resets the child, answers failure |
//! | failure | resets the child, answers success |
//! | running, skipped | answers the same |
//!
//! Halted: halts the child.

use super::{BuiltIn, Class};
use crate::kind::Kind;
use crate::run::Run;
use crate::status::{NodeStatus, Status};

pub(crate) const BUILT_IN: BuiltIn =
    BuiltIn { tag: "Inverter", class: Class::Decorator, children: 1..=1, ports: &[], kind: |_| Kind::Inverter };

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Status {
    run.set_status(at, NodeStatus::Running);
    let answer = match run.execute(at + 1) {
        Status::Success => Status::Failure,
        Status::Failure => Status::Success,
        unfinished => return unfinished,
    };
    run.reset(at + 1);
    answer
}
