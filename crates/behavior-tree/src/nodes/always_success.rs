//! `AlwaysSuccess`: succeeds.
//!
//! | | the node |
//! |---|---|
//! | ticked | returns success |

use super::built_in::{BuiltIn, Class};
use super::run::Run;
use crate::kind::Kind;
use crate::status::Status;

pub(super) const BUILT_INS: &[BuiltIn] = &[BuiltIn::new("AlwaysSuccess", Class::Action, |_| Kind::AlwaysSuccess)];

pub(super) fn tick<Ctx>(_: &mut Run<'_, Ctx>, _: usize) -> Status {
    Status::Success
}
