//! `Script`: computes an expression.
//!
//! | port | type | |
//! |---|---|---|
//! | `code` | expression | see [`conditions`](super::conditions); written in the tree, not in a key |
//!
//! | | the node |
//! |---|---|
//! | the expression was computed | returns success |
//! | it cannot be computed | returns failure, with a [`NodeError`](crate::NodeError) |

use super::built_in::{BuiltIn, BuiltInPort, Class, Holds};
use super::conditions::compute;
use super::run::Run;
use crate::kind::Kind;
use crate::script::Purpose;
use crate::status::Status;

pub(super) const BUILT_INS: &[BuiltIn] =
    &[BuiltIn::new("Script", Class::Action, |node| Kind::Script { script: node.script })
        .with_ports(&[BuiltInPort::new("code", Holds::Script(Purpose::Effects), "what to compute")])];

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, script: u32) -> Status {
    match compute(run, script) {
        Ok(_) => Status::Success,
        Err(error) => run.fail_with(at, error),
    }
}
