//! `Precondition`: asks a condition before it starts its child.
//!
//! | port | type | default | |
//! |---|---|---|---|
//! | `if` | expression | | see [`conditions`](super::conditions); written in the tree, not in a key |
//! | `else` | status | FAILURE | what to return if it is false: SUCCESS, FAILURE, SKIPPED or RUNNING |
//!
//! | | the node |
//! |---|---|
//! | the child has not been started, and the expression is false | returns `else` |
//! | else | ticks the child and returns the same; once the child has finished, resets it |
//!
//! The expression is not computed again while the child runs. Halted: halts the child, asks again next time.

use super::built_in::{BuiltIn, BuiltInPort, Class, Holds};
use super::conditions::judge;
use super::run::Run;
use crate::kind::Kind;
use crate::script::Purpose;
use crate::status::Status;

pub(super) const BUILT_INS: &[BuiltIn] = &[BuiltIn::new("Precondition", Class::Decorator, |node| Kind::Precondition {
    script: node.script,
    otherwise: node.status,
})
.with_ports(&[
    BuiltInPort::new("if", Holds::Script(Purpose::Condition), "what must be true for the child to start"),
    BuiltInPort::new("else", Holds::Status, "what to return if it is not").with_default("FAILURE"),
])];

const STARTED: u32 = 1;

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, script: u32, otherwise: Status) -> Status {
    if run.state(at).cursor != STARTED {
        let Some(verdict) = judge(run, at, script) else {
            return Status::Failure;
        };
        match (verdict.holds, otherwise) {
            (true, _) => run.state(at).cursor = STARTED,
            (false, Status::Failure) => return verdict.fail(run, at, script),
            (false, otherwise) => return otherwise,
        }
    }
    let status = run.execute(at + 1);
    if status.is_completed() {
        run.finish(at);
    }
    status
}
