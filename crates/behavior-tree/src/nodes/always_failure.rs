//! `AlwaysFailure`: fails.
//!
//! | | the node |
//! |---|---|
//! | ticked | returns failure |

use super::built_in::{BuiltIn, Class};
use super::run::Run;
use crate::kind::Kind;
use crate::status::Status;

pub(super) const BUILT_INS: &[BuiltIn] = &[BuiltIn::new("AlwaysFailure", Class::Action, |_| Kind::AlwaysFailure)];

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Status {
    run.fail(at)
}
