//! Tasks: uses of declared skills, which processes of their own carry out while the vehicle hovers.

use std::fmt;
use std::time::Duration;

use crate::geometry::Ned;

/// A process reports at least once a second of wall time; one that was heard longer ago than this is lost. (ENG: three reports.)
pub const SILENT: Duration = Duration::from_secs(3);
/// An order is repeated after this much wall time until a report names it. (ENG)
pub const REPEAT: Duration = Duration::from_millis(500);

/// One use of a declared skill, as a mission asks for it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Task {
    /// The name of the declaration.
    pub skill: String,
    /// A number for each of its inputs. The names end in their units.
    pub inputs: Vec<(String, f64)>,
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
    /// The place over which the vehicle hovers meanwhile.
    pub over: Ned,
    /// What is to be done.
    pub task: Task,
    /// How long that takes, in mission seconds. Planned with, and not enforced.
    pub estimate_s: f64,
    /// The power it takes besides hovering, in W. Planned with, and not enforced.
    pub power_w: f64,
    /// It has failed if it has not ended after this many mission seconds.
    pub limit_s: f64,
    /// How long the process may take to make an interruption safe, in mission seconds. No other skill begins before.
    pub interrupt_s: f64,
    /// The outcomes by which it has succeeded.
    pub succeeds_as: Vec<String>,
}
