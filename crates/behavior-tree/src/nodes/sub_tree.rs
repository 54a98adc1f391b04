//! # `SubTree`
//!
//! Another tree of the library in this place. `ID` names it; the other attributes connect its keys to those of this tree.
//!
//! | attribute | |
//! |---|---|
//! | `goal="{target}"` | the key `goal` inside is the key `target` outside |
//! | `goal="{=}"` | the key `goal` inside is the key `goal` outside |
//! | `goal="12"` | the key `goal` inside starts with this value |
//! | `_autoremap="true"` | every key inside is the key of the same name outside, unless it starts with `_` |
//! | `@goal` (inside, in any port or expression) | the key `goal` of the outermost tree |
//!
//! All of it is resolved when the library is loaded: at run time a key is a place in an array.
//!
//! | the tree answers | the node |
//! |---|---|
//! | success, failure | resets it, answers the same |
//! | running, skipped | answers the same |
//!
//! Halted: halts the tree. Its keys keep their values.

use super::{BuiltIn, Class};
use crate::kind::Kind;
use crate::run::Run;
use crate::status::{NodeStatus, Status};

pub(crate) const BUILT_IN: BuiltIn =
    BuiltIn { tag: "SubTree", class: Class::SubTree, children: 0..=0, ports: &[], kind: |_| Kind::SubTree };

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Status {
    if run.status(at) == NodeStatus::Idle {
        run.set_status(at, NodeStatus::Running);
    }
    let answer = run.execute(at + 1);
    if answer.is_completed() {
        run.reset(at + 1);
    }
    answer
}
