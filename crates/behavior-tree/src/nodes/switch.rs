//! # `Switch2` .. `Switch6`
//!
//! As many cases as the name says, each with a child, and a last child for everything else.
//!
//! | port | type | |
//! |---|---|---|
//! | `variable` | any | what is compared |
//! | `case_1` .. `case_6` | any | what it is compared with: as text first, then as whole numbers, then as real ones |
//!
//! The cases are compared at every tick, in order.
//!
//! | | the node |
//! |---|---|
//! | another child ran before | halts and resets it, before the chosen one is ticked |
//! | the chosen child answers running | answers running |
//! | the chosen child answers skipped | answers skipped |
//! | the chosen child answers success, failure | resets all children, answers the same |
//!
//! Halted: halts the running child.

use super::{BuiltIn, BuiltInPort, Class};
use crate::board::Binding;
use crate::kind::Kind;
use crate::run::Run;
use crate::status::Status;
use crate::types::Type;
use crate::value::Value;

const fn port(name: &'static str) -> BuiltInPort {
    BuiltInPort { name, ty: Type::Any, default: None, description: "", min: i32::MIN }
}

const PORTS: &[BuiltInPort] =
    &[port("variable"), port("case_1"), port("case_2"), port("case_3"), port("case_4"), port("case_5"), port("case_6")];

const fn built_in(tag: &'static str, cases: usize) -> BuiltIn {
    BuiltIn {
        tag,
        class: Class::Control,
        children: cases + 1..=cases + 1,
        ports: PORTS.split_at(cases + 1).0,
        kind: |_| Kind::Switch(crate::shape::NONE),
    }
}

pub(crate) const SWITCH_2: BuiltIn = built_in("Switch2", 2);
pub(crate) const SWITCH_3: BuiltIn = built_in("Switch3", 3);
pub(crate) const SWITCH_4: BuiltIn = built_in("Switch4", 4);
pub(crate) const SWITCH_5: BuiltIn = built_in("Switch5", 5);
pub(crate) const SWITCH_6: BuiltIn = built_in("Switch6", 6);

pub(crate) fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, table: usize) -> Status {
    let shape = run.shape;
    let chosen = chosen_position(run, table);
    let Some(chosen) = shape.child(at, chosen) else {
        return run.give_up(at);
    };
    let running = run.state(at).cursor as usize;
    if running != 0 && running != chosen {
        run.reset(running);
    }
    let answer = run.execute(chosen);
    match answer {
        Status::Running => run.state(at).cursor = chosen as u32,
        Status::Skipped => run.state(at).cursor = 0,
        Status::Success | Status::Failure => {
            run.finish(at);
        }
    }
    answer
}

/// The position of the first case that equals the variable, or of the last child.
fn chosen_position<Ctx>(run: &Run<'_, Ctx>, table: usize) -> usize {
    let ports = &run.shape.switches[table];
    let values = &run.machine.board.values;
    let Some((variable, cases)) = ports.split_first() else {
        return 0;
    };
    let Some(variable) = variable.value(values) else {
        return cases.len();
    };
    let is_chosen = |case: &Binding| case.value(values).is_some_and(|it| equal(variable, it));
    cases.iter().position(is_chosen).unwrap_or(cases.len())
}

fn equal(this: &Value, that: &Value) -> bool {
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
