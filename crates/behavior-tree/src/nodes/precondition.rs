//! # `Precondition`
//!
//! | port | type | default | |
//! |---|---|---|---|
//! | `if` | expression | | see [`conditions`](super::conditions); written in the tree, not in a key |
//! | `else` | status | FAILURE | what to answer if it is false: SUCCESS, FAILURE, SKIPPED or RUNNING |
//!
//! | | the node |
//! |---|---|
//! | the child has not been started and the expression is false | answers `else` |
//! | else | ticks the child and answers the same; once it has finished, resets it |
//!
//! The expression is not asked again while the child runs. Halted: halts the child, asks anew next time.

use super::conditions::{blame, holds};
use super::{BuiltIn, BuiltInPort, Class};
use crate::kind::Kind;
use crate::run::Run;
use crate::shape::NONE;
use crate::status::Status;

pub(crate) const BUILT_IN: BuiltIn = BuiltIn {
    tag: "Precondition",
    class: Class::Decorator,
    children: 1..=1,
    ports: &[
        BuiltInPort::text("if", None, "what must be true for the child to be started"),
        BuiltInPort::text("else", Some("FAILURE"), "what to answer if it is not"),
    ],
    kind: |_| Kind::Precondition { script: NONE, otherwise: Status::Failure },
};

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, script: u32, otherwise: Status) -> Status {
    if run.state(at).cursor != STARTED {
        match holds(run, at, script) {
            Some(true) => run.state(at).cursor = STARTED,
            Some(false) => {
                if otherwise == Status::Failure {
                    blame(run, at, script);
                }
                return otherwise;
            }
            None => return Status::Failure,
        }
    }
    let answer = run.execute(at + 1);
    if answer.is_completed() {
        run.finish(at);
    }
    answer
}

const STARTED: u32 = 1;
