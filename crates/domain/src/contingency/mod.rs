//! The contingency table: which facts raise which flag, and what is done about it.
//!
//! The table is a file, `config/contingencies.toml`, reviewed like code. The monitor evaluates each
//! row's [`Rule`]; the mission manager generates its contingency subtree from the rest.

use serde::Deserialize;

pub mod rule;
mod table;

pub use rule::Rule;

/// A checked table: rows with distinct flags and priorities, most urgent first.
#[derive(Debug, Clone, PartialEq)]
pub struct Contingencies {
    rows: Vec<Row>,
}

impl Contingencies {
    /// The rows, most urgent first.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// The row of a flag.
    pub fn row(&self, flag: &str) -> Option<&Row> {
        self.rows.iter().find(|it| it.flag == flag)
    }
}

/// One flag and the response to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The flag's name.
    pub flag: String,
    /// Lower is more urgent; a more urgent flag preempts the response to a less urgent one.
    pub priority: u32,
    /// Rows of one group nest under one check, so that a quiet group costs one look.
    pub group: Option<String>,
    /// When the monitor raises it; `None`: only by hand, or by the mission manager itself.
    pub raise: Option<Rule>,
    /// Tried in order until one succeeds; names of trees.
    pub actions: Vec<String>,
    /// Tried when all of them failed. If it fails too, the mission is over.
    pub emergency: String,
    /// When the flag goes down again.
    pub clears: Clears,
    /// What follows once the response has ended and the flag is down.
    pub then: Then,
}

/// When a flag goes down again. It never does while its response is under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Clears {
    /// Once its response has ended.
    AfterAction,
    /// Once its response has ended and what raised it is gone; until then the vehicle holds.
    WithCondition,
    /// Not before an operator lowers it or the vehicle has landed.
    Never,
}

/// What follows a response.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Then {
    /// The mission is replanned and goes on.
    Resume,
    /// The mission is over.
    EndMission,
}

/// Raised by the mission manager when a transition action fails; its row must exist.
pub const TRANSITION_FAILED: &str = "transition_failed";
