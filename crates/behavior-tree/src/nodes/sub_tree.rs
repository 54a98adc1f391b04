//! `SubTree`: includes another tree of the library.
//!
//! `ID` names the tree. The other attributes connect its keys to those of this tree.
//!
//! | attribute | |
//! |---|---|
//! | `goal="{target}"` | the key `goal` inside is the key `target` outside |
//! | `goal="{=}"` | the key `goal` inside is the key `goal` outside |
//! | `goal="12"` | the key `goal` inside starts with this value |
//! | `_autoremap="true"` | every key inside is the key of the same name outside, unless it starts with `_` |
//! | `@goal` (inside, in any port or expression) | the key `goal` of the outermost tree |
//!
//! All keys are resolved when the library is loaded: at run time a key is a place in an array.
//!
//! | the tree returns | the node |
//! |---|---|
//! | success, failure | resets the tree, returns the same |
//! | running, skipped | returns the same |
//!
//! Halted: halts the tree. Its keys keep their values.

use super::built_in::{BuiltIn, Class};
use super::run::Run;
use crate::kind::Kind;
use crate::status::{NodeStatus, Status};

pub(super) const BUILT_INS: &[BuiltIn] = &[BuiltIn::new("SubTree", Class::SubTree, |_| Kind::SubTree)];

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Status {
    if run.status(at) == NodeStatus::Idle {
        run.set_status(at, NodeStatus::Running);
    }
    let status = run.execute(at + 1);
    if status.is_completed() {
        run.reset(at + 1);
    }
    status
}
