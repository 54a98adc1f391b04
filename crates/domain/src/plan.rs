//! Plans, and the requests and replies of the planner and the mission manager about them.

use std::fmt;
use std::time::Duration;

use crate::airspace::Grants;
use crate::area::Area;
use crate::feed::Feed;
use crate::fmu::FlightMode;
use crate::geodesy::Origin;
use crate::mission::ObjectiveStatus;
use crate::mission::terms::Order;
use crate::site::Site;
use crate::skill::Goal;
use crate::state::State;

/// Names a step; unique among the steps of all plans of a mission.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct StepId(pub u64);

impl fmt::Display for StepId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// Clauses about the state, all of which must hold; a clause that is `None` or names no area is not checked.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Condition {
    /// In the air or on the ground.
    pub flying: Option<bool>,
    /// The actual flight mode.
    pub mode: Option<FlightMode>,
    /// Areas whose permission must be held.
    pub permissions: Vec<String>,
}

/// One way to fly a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// The goal for the skill manager.
    pub goal: Goal,
    /// What must hold before it starts.
    pub precondition: Condition,
    /// What must hold while it is flown.
    pub invariant: Condition,
}

/// A step of a plan as it is flown.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Its id.
    pub id: StepId,
    /// Index of the objective that it serves.
    pub objective: u32,
    /// The state that it reaches.
    pub reaches: State,
    /// How it is flown.
    pub nominal: Parameters,
    /// Permissions to get during it, each area once.
    pub ask: Vec<PermissionNeed>,
    /// Permissions to ask for while it is flown because a later step needs them, each area once.
    pub ask_ahead: Vec<AskAhead>,
    /// Added by the communication plan.
    pub auxiliary: bool,
    /// What it does, in words.
    pub text: String,
}

impl Step {
    /// Whether it ends by itself: it flies to a place, and stays there only while it asks for an area. A velocity leads nowhere in
    /// particular, so that nobody could say beforehand which areas it would enter.
    pub fn ends(&self) -> bool {
        let is_for_no_place = matches!(self.nominal.goal, Goal::Velocity { .. });
        !is_for_no_place && (!self.nominal.goal.is_endless() || !self.ask.is_empty())
    }
}

/// A permission to get, and how long it must hold.
#[derive(Debug, Clone, PartialEq)]
pub struct PermissionNeed {
    /// Which area.
    pub area: String,
    /// For how long it must hold from the grant on, in mission time: the stay and the time to leave.
    pub lasts: Duration,
}

/// A permission to ask for before the step that needs it begins.
#[derive(Debug, Clone, PartialEq)]
pub struct AskAhead {
    /// Which, and for how long it must hold from the grant on: until the flight to the step that needs it and that step's own need
    /// are over.
    pub need: PermissionNeed,
    /// How long after the beginning of the step it is asked for, in mission time.
    pub after: Duration,
}

/// A plan for one objective.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Index of the objective.
    pub objective: u32,
    /// The remaining steps, first to fly first.
    pub steps: Vec<Step>,
    /// Counts plans.
    pub revision: u64,
    /// The epoch it was made in; one of an earlier epoch must not be flown.
    pub epoch: u64,
}

/// A permission that was not given as needed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Denial {
    /// Which area.
    pub area: String,
    /// How it was not given.
    pub kind: DenialKind,
    /// The reason, for the operator.
    pub reason: String,
}

/// How a permission was not given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DenialKind {
    /// The tower refused or revoked it.
    Refused,
    /// The tower never answered.
    Silent,
    /// It was granted for less time than is needed.
    TooShort,
    /// The vehicle itself does not use it: a flag that is up forbids to enter an area.
    Withheld,
}

/// A step that could not be flown to its end.
#[derive(Debug, Clone, PartialEq)]
pub struct FailedStep {
    /// The step.
    pub id: StepId,
    /// The reason.
    pub reason: String,
    /// An operator's order, or a response that only holds the vehicle, came first: it was not the step that failed.
    pub interrupted: bool,
}

/// The mission manager asks for a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanRequest {
    /// A repeated request with the same id gets the answer to the first one.
    pub request_id: String,
    /// Where the vehicle is and what it may enter.
    pub state: State,
    /// For how long each permission holds from now on.
    pub grants: Grants,
    /// The step that failed, if any.
    pub failed: Option<FailedStep>,
    /// Areas whose permission was denied during it.
    pub denials: Vec<Denial>,
    /// The loss of the planner's memory that an operator has accepted; zero without one.
    pub accepted_loss: u64,
}

/// The planner's answer.
#[derive(Debug, Clone, PartialEq)]
pub enum PlanReply {
    /// Fly this; it has at least one step.
    Plan(Plan),
    /// Nothing can be flown now; ask again after the wait.
    Hold {
        /// In mission time.
        wait: Duration,
        /// The reason, for the operator.
        reason: String,
        /// The mission asks for this stay: it is no wait for a plan.
        planned: bool,
    },
    /// Every objective has reached its final state.
    Finished,
    /// The request is invalid, for this reason.
    Refused(String),
}

/// A step was flown to its end.
#[derive(Debug, Clone, PartialEq)]
pub struct StepDone {
    /// The step.
    pub id: StepId,
    /// The state of the vehicle after it.
    pub state: State,
}

/// The planner's status.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannerStatus {
    /// The mission's name.
    pub mission: String,
    /// In the order in which they are attempted.
    pub objectives: Vec<ObjectiveStatus>,
    /// Every area of the mission.
    pub areas: Vec<Area>,
    /// The remaining steps of the present plan, first to fly first.
    pub steps: Vec<Step>,
    /// Counts plans.
    pub revision: u64,
    /// Index of the objective worked on; the number of objectives once all have reached their final state.
    pub current_objective: u32,
    /// Why the planner waits; empty if it does not.
    pub hold: String,
    /// Counts changes that void the plans made before.
    pub epoch: u64,
    /// In which order the objectives are attempted; a free one was chosen when the first plan was made.
    pub order: Order,
    /// Where a flight may end early.
    pub sites: Vec<Site>,
    /// Where the mission's places count from, if it says so: the vehicle's local frame must have its origin there.
    pub origin: Option<Origin>,
    /// The data sets that areas came from.
    pub feeds: Vec<Feed>,
}
