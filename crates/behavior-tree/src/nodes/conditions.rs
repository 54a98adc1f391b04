//! # Pre- and postconditions, and the expression language
//!
//! Attributes that every node may have. Each holds an expression.
//!
//! | attribute | computed | effect |
//! |---|---|---|
//! | `_failureIf` | before a tick of the idle node | true: returns failure, the node is not ticked |
//! | `_successIf` | before a tick of the idle node | true: returns success, the node is not ticked |
//! | `_skipIf` | before a tick of the idle node | true: returns skipped, the node is not ticked |
//! | `_while` | before every tick | false: halts the node if it runs, returns skipped |
//! | `_onSuccess` | when the node returns success | |
//! | `_onFailure` | when the node returns failure | |
//! | `_post` | when the node returns success or failure, after the one above | |
//! | `_onHalted` | when the node is halted while it runs | |
//!
//! They are computed in this order. The first precondition that decides ends the search.
//!
//! ## Expressions
//!
//! A name is a key of the blackboard (`@name` a key of the outermost tree) or a number that
//! [`Registry::constant`](crate::Registry::constant) gave this name. Statements are separated by `;`, and the value of
//! the last one is the value of the expression. The operators, from the loosest to the tightest:
//!
//! | operators | on | result |
//! |---|---|---|
//! | `:=` | a key, which is made if it does not exist | the value |
//! | `=` `+=` `-=` `*=` `/=` | a key that exists | the value |
//! | `a ? b : c` | | `b` or `c` |
//! | `\|\|` | true or false; the right side is computed only if needed | bool |
//! | `&&` | true or false; the right side is computed only if needed | bool |
//! | `==` `!=` `<` `>` `<=` `>=`, also chained: `0 < x <= 9` | two numbers or two texts | bool |
//! | `\|` `^` | integers | int |
//! | `&` | integers | int |
//! | `+` `-` | numbers; `+` also two texts | int or double; text |
//! | `..` | texts and numbers, one of them a text | text |
//! | `*` `/` | numbers; `/` always gives a double | int or double |
//! | `-a` `~a` `!a` | number; integer; true or false | |
//!
//! Literals: `42`, `0x2A`, `1.5`, `2e3`, `true`, `false`, `'text'`. As numbers, booleans are 0 and 1; as conditions,
//! numbers other than 0 are true. Doubles closer than 1.2e-7 are equal. Integers stay integers, and overflow is an error.
//!
//! Types are inferred and checked when the tree is loaded. What can only be found at run time, such as a key without a
//! value or an overflow, is a [`NodeError`](crate::NodeError) and fails the node.

use super::run::Run;
use crate::record::cause::Cause;
use crate::record::error::NodeErrorKind;
use crate::script::Script;
use crate::script::error::EvalError;
use crate::script::eval::Scene;
use crate::shape::{NONE, Shape};
use crate::status::{NodeStatus, Status};
use crate::values::value::Value;

/// What the preconditions decide, if they do.
pub(super) fn before<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Option<Status> {
    let scripts = run.shape.conditions[run.shape.nodes[at].conditions as usize];
    match run.status(at) {
        NodeStatus::Idle => {
            let deciding = [
                (scripts.failure_if, Status::Failure),
                (scripts.success_if, Status::Success),
                (scripts.skip_if, Status::Skipped),
            ];
            for (script, status) in deciding.into_iter().filter(|(script, _)| *script != NONE) {
                let Some(verdict) = judge(run, at, script) else {
                    return Some(Status::Failure);
                };
                if verdict.holds && status == Status::Failure {
                    return Some(verdict.fail(run, at, script));
                }
                if verdict.holds {
                    return Some(status);
                }
            }
            if scripts.while_true == NONE {
                return None;
            }
            match judge(run, at, scripts.while_true) {
                Some(verdict) => (!verdict.holds).then_some(Status::Skipped),
                None => Some(Status::Failure),
            }
        }
        NodeStatus::Running if scripts.while_true != NONE => {
            let status = match judge(run, at, scripts.while_true) {
                Some(Verdict { holds: true, .. }) => return None,
                Some(_) => Status::Skipped,
                None => Status::Failure,
            };
            run.halt(at);
            Some(status)
        }
        _ => None,
    }
}

/// Runs the postconditions. One that cannot be computed fails the node.
pub(super) fn after<Ctx>(run: &mut Run<'_, Ctx>, at: usize, status: Status) -> Status {
    let scripts = run.shape.conditions[run.shape.nodes[at].conditions as usize];
    let own = match status {
        Status::Success => scripts.on_success,
        Status::Failure => scripts.on_failure,
        Status::Running | Status::Skipped => return status,
    };
    for script in [own, scripts.post].into_iter().filter(|script| *script != NONE) {
        if let Err(error) = compute(run, script) {
            return run.fail_with(at, error);
        }
    }
    status
}

/// Runs `_onHalted`.
pub(super) fn halted<Ctx>(run: &mut Run<'_, Ctx>, at: usize) {
    let script = run.shape.conditions[run.shape.nodes[at].conditions as usize].on_halted;
    if script != NONE
        && let Err(error) = compute(run, script)
    {
        run.report(at, error);
    }
}

/// Computes an expression.
pub(super) fn compute<Ctx>(run: &mut Run<'_, Ctx>, script: u32) -> Result<Value, NodeErrorKind> {
    let shape = run.shape;
    let script = &shape.scripts[script as usize];
    script.run(&mut scene(run)).map_err(|error| described(shape, script, &error))
}

/// The value of an expression as a condition.
pub(super) struct Verdict {
    pub(super) holds: bool,
    /// The two sides of the last comparison, if there was one.
    compared: Option<(Value, Value)>,
}

/// Computes an expression as a condition. On `None` the node has failed with an error.
pub(super) fn judge<Ctx>(run: &mut Run<'_, Ctx>, at: usize, script: u32) -> Option<Verdict> {
    let shape = run.shape;
    let script = &shape.scripts[script as usize];
    let mut scene = scene(run);
    match script.holds(&mut scene) {
        Ok(holds) => Some(Verdict { holds, compared: scene.compared }),
        Err(error) => {
            run.fail_with(at, described(shape, script, &error));
            None
        }
    }
}

impl Verdict {
    /// Fails a node with the expression as the cause.
    pub(super) fn fail<Ctx>(self, run: &mut Run<'_, Ctx>, at: usize, script: u32) -> Status {
        let text = run.shape.scripts[script as usize].text.clone().into();
        run.fail_because(at, Cause::Expression { text, holds: self.holds, compared: self.compared })
    }
}

fn scene<'r, Ctx>(run: &'r mut Run<'_, Ctx>) -> Scene<'r> {
    Scene { values: &mut run.machine.board.values, slots: &run.shape.slots, compared: None }
}

fn described(shape: &Shape, script: &Script, error: &EvalError) -> NodeErrorKind {
    NodeErrorKind::Expression(format!("expression `{}`: {}", script.text, error.describe(&shape.keys)))
}
