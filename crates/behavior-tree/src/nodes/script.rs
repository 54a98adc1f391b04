//! # `Script`
//!
//! | port | type | |
//! |---|---|---|
//! | `code` | expression | see [`conditions`](super::conditions); written in the tree, not in a key |
//!
//! | | the node |
//! |---|---|
//! | the expression was computed | answers success |
//! | it cannot be computed | answers failure, with a [`Fault`](crate::Fault) |

use super::conditions::compute;
use super::{BuiltIn, BuiltInPort, Class};
use crate::kind::Kind;
use crate::run::Run;
use crate::shape::NONE;
use crate::status::Status;

pub(crate) const BUILT_IN: BuiltIn = BuiltIn {
    tag: "Script",
    class: Class::Action,
    children: 0..=0,
    ports: &[BuiltInPort::text("code", None, "what to compute")],
    kind: |_| Kind::Script(NONE),
};

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, script: u32) -> Status {
    Status::from_bool(compute(run, at, script).is_some())
}
