//! `Switch2` to `Switch6`: ticks the child whose case equals a variable.
//!
//! It has one child for each case, and a last child for all other values.
//!
//! | port | type | |
//! |---|---|---|
//! | `variable` | any | what is compared |
//! | `case_1` to `case_6` | any | what it is compared with: equal texts, equal numbers, or doubles closer than 1.2e-7 |
//!
//! The cases are compared in order at every tick.
//!
//! | | the node |
//! |---|---|
//! | another child was running | resets it before the chosen one is ticked |
//! | the chosen child returns running | returns running |
//! | the chosen child returns skipped | returns skipped |
//! | the chosen child returns success, failure | resets all children, returns the same |
//!
//! Halted: halts the running child.

use super::built_in::{BuiltIn, BuiltInPort, Class, Holds};
use super::run::Run;
use crate::board::Binding;
use crate::kind::Kind;
use crate::status::Status;
use crate::values::value::Value;

const fn port(name: &'static str) -> BuiltInPort {
    BuiltInPort::new(name, Holds::Value, "")
}

const PORTS: &[BuiltInPort] =
    &[port("variable"), port("case_1"), port("case_2"), port("case_3"), port("case_4"), port("case_5"), port("case_6")];

const fn switch(tag: &'static str, cases: usize) -> BuiltIn {
    BuiltIn::new(tag, Class::Control, |node| Kind::Switch { table: node.table })
        .with_children(cases + 1..=cases + 1)
        .with_ports(PORTS.split_at(cases + 1).0)
}

pub(super) const BUILT_INS: &[BuiltIn] =
    &[switch("Switch2", 2), switch("Switch3", 3), switch("Switch4", 4), switch("Switch5", 5), switch("Switch6", 6)];

pub(super) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, table: u32) -> Status {
    let shape = run.shape;
    let Some(chosen) = shape.child(at, chosen_position(run, table)) else {
        return run.fail(at);
    };
    let running = run.state(at).cursor as usize;
    if running != 0 && running != chosen {
        run.reset(running);
    }
    let status = run.execute(chosen);
    match status {
        Status::Running => run.state(at).cursor = chosen as u32,
        Status::Skipped => run.state(at).cursor = 0,
        Status::Success | Status::Failure => run.finish(at),
    }
    status
}

/// The position of the first case that equals the variable, or of the last child.
fn chosen_position<Ctx>(run: &Run<'_, Ctx>, table: u32) -> usize {
    let values = &run.machine.board.values;
    let Some((variable, cases)) = run.shape.switches[table as usize].split_first() else {
        return 0;
    };
    let Some(variable) = variable.value(values) else {
        return cases.len();
    };
    let is_chosen = |case: &Binding| case.value(values).is_some_and(|case| is_equal(variable, case));
    cases.iter().position(is_chosen).unwrap_or(cases.len())
}

fn is_equal(this: &Value, that: &Value) -> bool {
    match (this, that) {
        (Value::Float(_), _) | (_, Value::Float(_)) => match (this.number(), that.number()) {
            (Some(this), Some(that)) => (this - that).abs() <= f64::from(f32::EPSILON),
            _ => false,
        },
        (Value::Bool(flag), Value::Int(number)) | (Value::Int(number), Value::Bool(flag)) => {
            i64::from(*flag) == *number
        }
        _ => this == that,
    }
}
