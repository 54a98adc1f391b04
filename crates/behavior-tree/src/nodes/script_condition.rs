//! `ScriptCondition`: asks whether an expression is true.
//!
//! | port | type | |
//! |---|---|---|
//! | `code` | expression | see [`conditions`](super::conditions); written in the tree, not in a key |
//!
//! | | the node |
//! |---|---|
//! | the expression is true | returns success |
//! | the expression is false | returns failure; [`Tree::why`](crate::Tree::why) has what was compared |
//! | it cannot be computed | returns failure, with a [`NodeError`](crate::NodeError) |

use super::built_in::{BuiltIn, BuiltInPort, Class, Holds};
use super::conditions::judge;
use super::run::Run;
use crate::kind::Kind;
use crate::script::Purpose;
use crate::status::Status;

pub(super) const BUILT_INS: &[BuiltIn] =
    &[BuiltIn::new("ScriptCondition", Class::Condition, |node| Kind::ScriptCondition { script: node.script })
        .with_ports(&[BuiltInPort::new("code", Holds::Script(Purpose::Condition), "what must be true")])];

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, script: u32) -> Status {
    match judge(run, at, script) {
        Some(verdict) if verdict.holds => Status::Success,
        Some(verdict) => verdict.fail(run, at, script),
        None => Status::Failure,
    }
}
