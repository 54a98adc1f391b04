//! Tasks: uses of declared skills, which processes of their own carry out while the vehicle hovers, flies or stands.

use std::fmt;
use std::time::Duration;

use serde::Deserialize;

use crate::geometry::Ned;

/// A process reports at least once a second of wall time; one that was heard longer ago than this is lost. (ENG: three reports.)
pub const SILENT: Duration = Duration::from_secs(3);
/// An order is repeated after this much wall time until a report names it. (ENG)
pub const REPEAT: Duration = Duration::from_millis(500);

/// What the vehicle does while a declared skill is under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stance {
    /// It hovers over a place.
    #[default]
    Hovers,
    /// It flies a leg: the task begins and ends with that.
    Flies,
    /// It stands where it has landed.
    Stands,
}

impl Stance {
    /// At an objective, which is reached in flight or on the ground.
    pub fn at_place(flying: bool) -> Stance {
        if flying { Stance::Hovers } else { Stance::Stands }
    }
}

/// As users read it: the vehicle ..
impl fmt::Display for Stance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Stance::Hovers => "hovers",
            Stance::Flies => "flies",
            Stance::Stands => "stands",
        })
    }
}

/// One use of a declared skill, as a mission asks for it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Task {
    /// The name of the declaration.
    pub skill: String,
    /// What it gives for its inputs. The names of numbers end in their units.
    pub inputs: Vec<(String, Value)>,
}

/// What a task gives for an input.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged, expecting = "expected a number or a text")]
pub enum Value {
    /// In the unit that the name of the input ends in.
    Number(f64),
    /// Never empty.
    Text(String),
}

impl Value {
    /// Its number, if it is one.
    pub fn number(&self) -> Option<f64> {
        match self {
            Value::Number(number) => Some(*number),
            Value::Text(_) => None,
        }
    }
}

impl From<f64> for Value {
    fn from(number: f64) -> Value {
        Value::Number(number)
    }
}

/// As users read it: `12`, `"left"`.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Number(number) => write!(f, "{number}"),
            Value::Text(text) => write!(f, "{text:?}"),
        }
    }
}

/// In a few words: `winch_down (length_m 12)`.
impl fmt::Display for Task {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.skill)?;
        for (index, (name, value)) in self.inputs.iter().enumerate() {
            write!(f, "{}{name} {value}", if index == 0 { " (" } else { ", " })?;
        }
        if self.inputs.is_empty() { Ok(()) } else { f.write_str(")") }
    }
}

/// What the skill manager is asked for: a task with what its declaration says about it.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskGoal {
    /// The place over which the vehicle hovers meanwhile, at which it stands, or to which the leg leads.
    pub over: Ned,
    /// What the vehicle does meanwhile.
    pub stance: Stance,
    /// What is to be done.
    pub task: Task,
    /// How long that takes, in mission seconds; 0 along a leg, which it lasts as long as. Planned with, and not enforced.
    pub estimate_s: f64,
    /// The power it takes besides that of the vehicle, in W. Planned with, and not enforced.
    pub power_w: f64,
    /// It has failed if it has not ended after this many mission seconds.
    pub limit_s: f64,
    /// How long the process may take to make an interruption safe, in mission seconds. No other skill begins before.
    pub interrupt_s: f64,
    /// The outcomes by which it has succeeded.
    pub succeeds_as: Vec<String>,
}
