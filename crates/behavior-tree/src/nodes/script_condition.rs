//! # `ScriptCondition`
//!
//! | port | type | |
//! |---|---|---|
//! | `code` | expression | see [`conditions`](super::conditions); written in the tree, not in a key |
//!
//! | | the node |
//! |---|---|
//! | the expression is true | answers success |
//! | the expression is false | answers failure; [`Tree::why`](crate::Tree::why) tells what was compared |
//! | it cannot be computed | answers failure, with a [`Fault`](crate::Fault) |

use super::conditions::{blame, holds};
use super::{BuiltIn, BuiltInPort, Class};
use crate::kind::Kind;
use crate::run::Run;
use crate::shape::NONE;
use crate::status::Status;

pub(crate) const BUILT_IN: BuiltIn = BuiltIn {
    tag: "ScriptCondition",
    class: Class::Condition,
    children: 0..=0,
    ports: &[BuiltInPort::text("code", None, "what must be true")],
    kind: |_| Kind::ScriptCondition(NONE),
};

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, script: u32) -> Status {
    let holds = holds(run, at, script);
    if holds == Some(false) {
        blame(run, at, script);
    }
    Status::from_bool(holds == Some(true))
}
