//! Tasks, and what is asked of the processes that carry them out.

use std::sync::Arc;

use kittiwake_proto::v1;

use super::{InvalidMessage, finite, not_negative, positive};
use crate::task::{Stance, Task, TaskGoal, Value};

/// Numbers by their names.
pub fn values_to_wire(values: &[(String, f64)]) -> Vec<v1::TaskValue> {
    let number =
        |(name, value): &(String, f64)| v1::TaskValue { name: name.clone(), value: *value, ..Default::default() };
    values.iter().map(number).collect()
}

/// The inputs of a task.
pub fn inputs_to_wire(inputs: &[(String, Value)]) -> Vec<v1::TaskValue> {
    let input = |(name, value): &(String, Value)| match value {
        Value::Number(number) => v1::TaskValue { name: name.clone(), value: *number, text: String::new() },
        Value::Text(text) => v1::TaskValue { name: name.clone(), value: 0.0, text: text.clone() },
    };
    inputs.iter().map(input).collect()
}

fn inputs_from_wire(inputs: Vec<v1::TaskValue>) -> Result<Vec<(String, Value)>, InvalidMessage> {
    let value = |it: v1::TaskValue| match it.text.is_empty() {
        true => Ok((it.name, Value::Number(finite("task value", it.value)?))),
        false => Ok((it.name, Value::Text(it.text))),
    };
    inputs.into_iter().map(value).collect()
}

/// The same from a message.
///
/// # Errors
/// If one is not a finite number.
pub fn values_from_wire(values: Vec<v1::TaskValue>) -> Result<Vec<(String, f64)>, InvalidMessage> {
    values.into_iter().map(|it| Ok((it.name, finite("task value", it.value)?))).collect()
}

/// What an order asks for.
///
/// # Errors
/// If it names no skill, or an input is not a number.
pub fn task_of_order(order: v1::TaskOrder) -> Result<Task, InvalidMessage> {
    v1::Task { skill: order.skill, inputs: order.inputs }.try_into()
}

impl From<&Task> for v1::Task {
    fn from(task: &Task) -> v1::Task {
        v1::Task { skill: task.skill.clone(), inputs: inputs_to_wire(&task.inputs) }
    }
}

impl TryFrom<v1::Task> for Task {
    type Error = InvalidMessage;
    fn try_from(task: v1::Task) -> Result<Task, InvalidMessage> {
        if task.skill.is_empty() {
            return Err(InvalidMessage::Missing("skill"));
        }
        Ok(Task { skill: task.skill, inputs: inputs_from_wire(task.inputs)? })
    }
}

impl From<Stance> for v1::Stance {
    fn from(stance: Stance) -> v1::Stance {
        match stance {
            Stance::Hovers => v1::Stance::Hovers,
            Stance::Flies => v1::Stance::Flies,
            Stance::Stands => v1::Stance::Stands,
        }
    }
}

/// Tasks beside a flight, from a message.
///
/// # Errors
/// If one of them is invalid.
pub fn along_from_wire(along: Vec<v1::TaskGoal>) -> Result<Vec<Arc<TaskGoal>>, InvalidMessage> {
    along.into_iter().map(|it| Ok(Arc::new(it.try_into()?))).collect()
}

/// The same as a message has them.
pub fn along_to_wire(along: &[Arc<TaskGoal>]) -> Vec<v1::TaskGoal> {
    along.iter().map(|it| it.as_ref().into()).collect()
}

impl From<&TaskGoal> for v1::TaskGoal {
    fn from(goal: &TaskGoal) -> v1::TaskGoal {
        v1::TaskGoal {
            over: Some(goal.over.into()),
            stance: v1::Stance::from(goal.stance) as i32,
            task: Some((&goal.task).into()),
            estimate_s: goal.estimate_s,
            power_w: goal.power_w,
            limit_s: goal.limit_s,
            interrupt_s: goal.interrupt_s,
            succeeds_as: goal.succeeds_as.clone(),
        }
    }
}

impl TryFrom<v1::TaskGoal> for TaskGoal {
    type Error = InvalidMessage;
    fn try_from(goal: v1::TaskGoal) -> Result<TaskGoal, InvalidMessage> {
        let stance = match goal.stance() {
            v1::Stance::Unspecified => return Err(InvalidMessage::Missing("stance")),
            v1::Stance::Hovers => Stance::Hovers,
            v1::Stance::Flies => Stance::Flies,
            v1::Stance::Stands => Stance::Stands,
        };
        Ok(TaskGoal {
            stance,
            over: goal.over.ok_or(InvalidMessage::Missing("over"))?.try_into()?,
            task: goal.task.ok_or(InvalidMessage::Missing("task"))?.try_into()?,
            estimate_s: not_negative("estimate_s", goal.estimate_s)?,
            power_w: not_negative("power_w", goal.power_w)?,
            limit_s: positive("limit_s", goal.limit_s)?,
            interrupt_s: not_negative("interrupt_s", goal.interrupt_s)?,
            succeeds_as: goal.succeeds_as,
        })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use proptest::prelude::*;

    use super::super::generators::name;
    use super::*;

    pub(crate) fn task() -> impl Strategy<Value = Task> {
        let value = prop_oneof![(-1e6..1e6).prop_map(Value::Number), "[a-z]{1,5}".prop_map(Value::Text)];
        let inputs = prop::collection::vec((name(), value), 0..3);
        let skill = name().prop_filter("a task names a skill", |it| !it.is_empty());
        (skill, inputs).prop_map(|(skill, inputs)| Task { skill, inputs })
    }
}
