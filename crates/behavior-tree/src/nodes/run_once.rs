//! # `RunOnce`
//!
//! | port | type | default | |
//! |---|---|---|---|
//! | `then_skip` | bool | true | afterwards answer skipped; else repeat the child's answer |
//!
//! | | the node |
//! |---|---|
//! | the child has finished once, `then_skip` | answers skipped |
//! | the child has finished once, not `then_skip` | answers what the child answered |
//! | the child answers success, failure | resets the child, answers the same and remembers it |
//! | the child answers running, skipped | answers the same |
//!
//! Halted: halts the child. That the child has finished once is never forgotten.

use super::{BuiltIn, BuiltInPort, Class};
use crate::kind::{Kind, Param};
use crate::run::Run;
use crate::status::{NodeStatus, Status};
use crate::types::Type;

pub(crate) const BUILT_IN: BuiltIn = BuiltIn {
    tag: "RunOnce",
    class: Class::Decorator,
    children: 1..=1,
    ports: &[BuiltInPort {
        name: "then_skip",
        ty: Type::Bool,
        default: Some("true"),
        description: "afterwards answer skipped; else repeat the child's answer",
        min: 0,
    }],
    kind: |it| Kind::RunOnce { then_skip: it[0] },
};

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, then_skip: Param) -> Status {
    let Some(then_skip) = run.number(at, then_skip) else {
        return run.give_up(at);
    };
    let remembered = match run.state(at).cursor {
        SUCCEEDED => Some(Status::Success),
        FAILED => Some(Status::Failure),
        _ => None,
    };
    if let Some(answer) = remembered {
        return if then_skip != 0 { Status::Skipped } else { answer };
    }
    run.set_status(at, NodeStatus::Running);
    let answer = run.execute(at + 1);
    match answer {
        Status::Success => run.state(at).cursor = SUCCEEDED,
        Status::Failure => run.state(at).cursor = FAILED,
        Status::Running | Status::Skipped => return answer,
    }
    run.reset(at + 1);
    answer
}

const SUCCEEDED: u32 = 1;
const FAILED: u32 = 2;
