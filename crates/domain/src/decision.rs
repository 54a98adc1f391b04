//! One record for each decision of the mission manager: what was decided, by which value, what was done, what was not done and
//! why not, and which decision led to it.
//!
//! The manager makes the records; recordings, HTTP, the operator's page and `kittiwake why` show them by the same words
//! ([`DecisionRecord::sentence`]).

use crate::measured::Measured;

pub mod chain;
mod sentence;

/// A decision.
#[derive(Debug, Clone, PartialEq)]
pub struct DecisionRecord {
    /// Later decisions of a flight have higher numbers.
    pub number: u64,
    /// Mission seconds since the manager started.
    pub at_s: f64,
    /// Milliseconds since the Unix epoch, UTC; 0 if it is not known.
    pub utc_ms: i64,
    /// The subject: `plan`, `step`, `permission`, `contingency`, `operator` or `mission`.
    pub topic: String,
    /// What it is about.
    pub kind: DecisionKind,
    /// In words.
    pub text: String,
    /// The flag of the contingency row that it is about; empty if it is about none.
    pub flag: String,
    /// The value that led to it, and its threshold.
    pub measured: Option<Measured>,
    /// What is done: an action of the contingency table, or a place to land at; empty if nothing is.
    pub response: String,
    /// What speaks for that, in figures; may be empty.
    pub response_reason: String,
    /// What is not done instead.
    pub rejected: Vec<Rejected>,
    /// The number of the decision that led to this one.
    pub parent: Option<u64>,
}

/// What was not done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rejected {
    /// An action, or a place.
    pub what: String,
    /// Why not.
    pub why: String,
}

/// What a decision is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum DecisionKind {
    /// Told under its topic; no choice between alternatives.
    Note,
    /// A flag rose.
    ContingencyRaised,
    /// The row of a flag responds from here on.
    ContingencyAnswered,
    /// A flag is up, and another row responds, or it does not count in this phase.
    ContingencyWaits,
    /// A flag fell.
    ContingencyCleared,
    /// A try of an action was flown and failed.
    ResponseFailed,
    /// An action was impossible: nothing was flown for it.
    ResponseSkipped,
    /// A response holds until there is a way.
    ResponseWaits,
    /// The place to land at.
    SiteChosen,
    /// An operator's order is carried out.
    OrderAccepted,
    /// An operator's order is not carried out.
    OrderRefused,
    /// A plan is flown from here on.
    PlanAdopted,
    /// A plan waits for an operator's approval.
    PlanProposed,
    /// There is no answer of the planner, or not in time.
    PlanLate,
    /// A plan is not flown, or the planner's answer cannot be used.
    PlanRejected,
    /// By the planner nothing can be flown now.
    PlanHold,
    /// Nothing is left to plan.
    PlanFinished,
    /// The control tower is asked.
    PermissionAsked,
    /// The control tower has decided.
    PermissionDecided,
    /// A step of the plan begins.
    StepBegun,
    /// A step was flown.
    StepSucceeded,
    /// A step failed, or was given up.
    StepFailed,
    /// The mission is over.
    MissionOver,
}

impl DecisionKind {
    /// Every kind.
    pub const ALL: [DecisionKind; 23] = [
        DecisionKind::Note,
        DecisionKind::ContingencyRaised,
        DecisionKind::ContingencyAnswered,
        DecisionKind::ContingencyWaits,
        DecisionKind::ContingencyCleared,
        DecisionKind::ResponseFailed,
        DecisionKind::ResponseSkipped,
        DecisionKind::ResponseWaits,
        DecisionKind::SiteChosen,
        DecisionKind::OrderAccepted,
        DecisionKind::OrderRefused,
        DecisionKind::PlanAdopted,
        DecisionKind::PlanProposed,
        DecisionKind::PlanLate,
        DecisionKind::PlanRejected,
        DecisionKind::PlanHold,
        DecisionKind::PlanFinished,
        DecisionKind::PermissionAsked,
        DecisionKind::PermissionDecided,
        DecisionKind::StepBegun,
        DecisionKind::StepSucceeded,
        DecisionKind::StepFailed,
        DecisionKind::MissionOver,
    ];
}

#[cfg(test)]
pub(crate) mod samples {
    use super::*;

    /// A note of this number and text, and what led to it.
    pub(crate) fn note(number: u64, text: &str, parent: Option<u64>) -> DecisionRecord {
        DecisionRecord {
            number,
            at_s: 0.0,
            utc_ms: 43_424_200,
            topic: "contingency".into(),
            kind: DecisionKind::Note,
            text: text.into(),
            flag: String::new(),
            measured: None,
            response: String::new(),
            response_reason: String::new(),
            rejected: Vec::new(),
            parent,
        }
    }
}
