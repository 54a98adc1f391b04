//! # Pre- and postconditions, and the expression language
//!
//! Attributes that every node may have, each holding an expression.
//!
//! | attribute | computed | effect |
//! |---|---|---|
//! | `_failureIf` | before a tick of the idle node | true: answers failure without being ticked |
//! | `_successIf` | before a tick of the idle node | true: answers success without being ticked |
//! | `_skipIf` | before a tick of the idle node | true: answers skipped without being ticked |
//! | `_while` | before every tick | false: halts the node if it runs, answers skipped |
//! | `_onSuccess` | when the node answers success | |
//! | `_onFailure` | when the node answers failure | |
//! | `_post` | when it answers success or failure, after the one above | |
//! | `_onHalted` | when the node is halted while it runs | |
//!
//! They are looked at in this order, and the first precondition that decides ends it.
//!
//! ## Expressions
//!
//! Names are keys of the blackboard (`@name` those of the outermost tree) or numbers that
//! [`Registry::constant`](crate::Registry::constant) gave a name. Statements are separated by `;`, the value of the last
//! one counts. Loosest first:
//!
//! | operators | on | result |
//! |---|---|---|
//! | `:=` | makes the key if it does not exist | the value |
//! | `=` `+=` `-=` `*=` `/=` | the key exists | the value |
//! | `a ? b : c` | | `b` or `c` |
//! | `\|\|` | true or false; the right side only if needed | bool |
//! | `&&` | true or false; the right side only if needed | bool |
//! | `==` `!=` `<` `>` `<=` `>=`, also chained: `0 < x <= 9` | two numbers or two texts | bool |
//! | `\|` `^` | whole numbers | int |
//! | `&` | whole numbers | int |
//! | `+` `-` | numbers; `+` also two texts | int or double; text |
//! | `..` | texts and numbers, one of them a text | text |
//! | `*` `/` | numbers; `/` always gives a real one | int or double |
//! | `-a` `~a` `!a` | number; whole number; true or false | |
//!
//! Literals: `42`, `0x2A`, `1.5`, `2e3`, `true`, `false`, `'text'`. Booleans count as 0 and 1 among numbers, and numbers
//! other than 0 as true. Real numbers closer than 1.2e-7 are equal. Whole numbers stay whole and overflow is an error.
//!
//! Types are found and checked when the tree is loaded. What is left for run time, a key that nothing has been written
//! to yet or a number too large, is a [`Fault`](crate::Fault) and fails the node.

use crate::cause::{Cause, Words};
use crate::fault::FaultKind;
use crate::run::Run;
use crate::script::eval::{EvalError, Scene};
use crate::shape::NONE;
use crate::status::{NodeStatus, Status};
use crate::value::Value;

/// What the preconditions decide, if they do.
pub(crate) fn before<Ctx>(run: &mut Run<'_, Ctx>, at: usize) -> Option<Status> {
    let scripts = run.shape.conditions[run.shape.nodes[at].conditions as usize];
    match run.status(at) {
        NodeStatus::Idle => {
            let deciding = [
                (scripts.failure_if, Status::Failure),
                (scripts.success_if, Status::Success),
                (scripts.skip_if, Status::Skipped),
            ];
            for (script, answer) in deciding.into_iter().filter(|(script, _)| *script != NONE) {
                match holds(run, at, script) {
                    Some(true) => {
                        if answer == Status::Failure {
                            blame(run, at, script);
                        }
                        return Some(answer);
                    }
                    Some(false) => {}
                    None => return Some(Status::Failure),
                }
            }
            if scripts.while_true == NONE {
                return None;
            }
            match holds(run, at, scripts.while_true) {
                Some(true) => None,
                Some(false) => Some(Status::Skipped),
                None => Some(Status::Failure),
            }
        }
        NodeStatus::Running if scripts.while_true != NONE => match holds(run, at, scripts.while_true) {
            Some(true) => None,
            Some(false) => {
                run.halt(at);
                Some(Status::Skipped)
            }
            None => {
                run.halt(at);
                Some(Status::Failure)
            }
        },
        _ => None,
    }
}

/// Runs the postconditions; one that cannot be computed fails the node.
pub(crate) fn after<Ctx>(run: &mut Run<'_, Ctx>, at: usize, answer: Status) -> Status {
    let scripts = run.shape.conditions[run.shape.nodes[at].conditions as usize];
    let own = match answer {
        Status::Success => scripts.on_success,
        Status::Failure => scripts.on_failure,
        Status::Running | Status::Skipped => return answer,
    };
    for script in [own, scripts.post].into_iter().filter(|script| *script != NONE) {
        if compute(run, at, script).is_none() {
            return Status::Failure;
        }
    }
    answer
}

/// Runs `_onHalted`.
pub(crate) fn halted<Ctx>(run: &mut Run<'_, Ctx>, at: usize) {
    let script = run.shape.conditions[run.shape.nodes[at].conditions as usize].on_halted;
    if script != NONE {
        compute(run, at, script);
    }
}

/// The value of a script. On `None` the fault is recorded.
pub(super) fn compute<Ctx>(run: &mut Run<'_, Ctx>, at: usize, script: u32) -> Option<Value> {
    let shape = run.shape;
    let mut scene = scene_of(run);
    let result = shape.scripts[script as usize].run(&mut scene);
    reported(run, at, script, result)
}

/// Whether a script is true. On `None` the fault is recorded.
pub(super) fn holds<Ctx>(run: &mut Run<'_, Ctx>, at: usize, script: u32) -> Option<bool> {
    let shape = run.shape;
    let mut scene = scene_of(run);
    let result = shape.scripts[script as usize].holds(&mut scene);
    run.machine.board.compared = scene.compared;
    reported(run, at, script, result)
}

/// Notes the condition asked last as the cause of a failure, with what it compared last.
pub(super) fn blame<Ctx>(run: &mut Run<'_, Ctx>, at: usize, script: u32) {
    let condition = Words::from(run.shape.scripts[script as usize].text.clone());
    let (value, threshold) = run.machine.board.compared.take().unzip();
    run.record_cause(at, Cause { condition, value, threshold });
}

fn scene_of<'r, Ctx>(run: &'r mut Run<'_, Ctx>) -> Scene<'r> {
    Scene { values: &mut run.machine.board.values, slots: &run.shape.slots, compared: None }
}

fn reported<Ctx, T>(run: &mut Run<'_, Ctx>, at: usize, script: u32, result: Result<T, EvalError>) -> Option<T> {
    match result {
        Ok(value) => Some(value),
        Err(error) => {
            let text = &run.shape.scripts[script as usize].text;
            let reason = error.describe(&run.shape.slot_names);
            run.report(at, FaultKind::Expression(format!("{reason} in the expression \"{text}\"")));
            None
        }
    }
}
