//! Inputs of a skill, what a task may give for them, and what is calculated from them.

use crate::control_character::is_control;
use crate::task::{Task, Value};

/// The least and the greatest of all inputs are tried together.
pub(super) const MOST_INPUTS: usize = 8;
/// Characters of an input.
const LONGEST_TEXT: usize = 100;

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Input {
    pub(super) name: String,
    pub(super) kind: InputKind,
    /// Its value where a mission leaves it out.
    pub(super) usual: Option<Value>,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum InputKind {
    Number {
        least: f64,
        most: f64,
    },
    /// One of these; any if there are none.
    Text(Vec<String>),
}

impl Input {
    pub(super) fn of(&self, task: &Task) -> Option<Value> {
        let given = task.inputs.iter().find(|(name, _)| *name == self.name);
        given.map(|(_, value)| value.clone()).or_else(|| self.usual.clone())
    }

    /// What it may be instead, if `value` does not fit.
    pub(super) fn unfit(&self, value: &Value) -> Option<String> {
        let fits = match (&self.kind, value) {
            (InputKind::Number { least, most }, Value::Number(number)) => (*least..=*most).contains(number),
            (InputKind::Text(choices), Value::Text(text)) => {
                is_text(text) && (choices.is_empty() || choices.contains(text))
            }
            _ => false,
        };
        (!fits).then(|| self.expected())
    }

    /// `from 2 to 30`
    pub(super) fn expected(&self) -> String {
        match &self.kind {
            InputKind::Number { least, most } => format!("from {least} to {most}"),
            InputKind::Text(choices) if choices.is_empty() => "a text in quotes".to_owned(),
            InputKind::Text(choices) => format!("one of {}", choices.join(", ")),
        }
    }

    /// The least number, or the first text.
    pub(super) fn first(&self) -> Value {
        match &self.kind {
            InputKind::Number { least, .. } => Value::Number(*least),
            InputKind::Text(choices) => Value::Text(choices.first().cloned().unwrap_or_else(|| "text".to_owned())),
        }
    }

    /// `length_m from 2 to 30, usually 5`
    pub(super) fn in_words(&self) -> String {
        let usual = self.usual.as_ref().map(|it| format!(", usually {it}")).unwrap_or_default();
        format!("{} {}{usual}", self.name, self.expected())
    }
}

pub(super) const TEXTS: &str = "a text has 1 to 100 characters, none of them a control character";

pub(super) fn is_text(text: &str) -> bool {
    (1..=LONGEST_TEXT).contains(&text.chars().count()) && !text.chars().any(is_control)
}

/// Every set of least and greatest numbers.
pub(super) fn corners(inputs: &[Input]) -> Vec<Vec<(String, f64)>> {
    let range = |it: &Input| match it.kind {
        InputKind::Number { least, most } => Some((it.name.clone(), least, most)),
        InputKind::Text(_) => None,
    };
    let ranges: Vec<(String, f64, f64)> = inputs.iter().filter_map(range).take(MOST_INPUTS).collect();
    let end = |set: usize, at: usize, (name, least, most): &(String, f64, f64)| {
        (name.clone(), if (set >> at) & 1 == 0 { *least } else { *most })
    };
    let corner = |set| ranges.iter().enumerate().map(|(at, it)| end(set, at, it)).collect();
    (0..1 << ranges.len()).map(corner).collect()
}

/// Looks up a value by its name.
pub(super) fn value_in(values: &[(String, f64)]) -> impl Fn(&str) -> Option<f64> {
    |name| values.iter().find(|(it, _)| it == name).map(|(_, value)| *value)
}

/// ` with length_m 12`; empty without inputs.
pub(super) fn with(values: &[(String, f64)]) -> String {
    let values: Vec<String> = values.iter().map(|(name, value)| format!("{name} {value}")).collect();
    if values.is_empty() { String::new() } else { format!(" with {}", values.join(" and ")) }
}
