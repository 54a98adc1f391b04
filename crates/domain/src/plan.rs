//! Plans, and the questions and answers of the mission manager and the planner about them.

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use kittiwake_proto::{Bytes, v1};

use crate::airspace::Grants;
use crate::area::Area;
use crate::feed::Feed;
use crate::fmu::FlightMode;
use crate::geodesy::Origin;
use crate::geometry::Ned;
use crate::mission::terms::Order;
use crate::mission::{Mission, MissionAreas, ObjectiveStatus, Progress};
use crate::site::Site;
use crate::skill::Goal;
use crate::state::State;
use crate::task::TaskGoal;
use crate::time::Now;

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
    /// The declared skill whose own condition must hold too.
    pub skill: Option<String>,
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
    /// Where the plan has the vehicle when it begins.
    pub from: Ned,
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
    /// How many turns of the objective's survey have been passed once it is flown; 0 where it reaches none.
    pub passed: u32,
    /// Tasks that go on while it is flown, each of another skill.
    pub along: Vec<Arc<TaskGoal>>,
    /// What it does, in words.
    pub text: String,
}

impl Step {
    /// The straight way it is planned to take.
    pub fn way(&self) -> (Ned, Ned) {
        (self.from, self.reaches.position)
    }

    /// Whether it asks for `area`.
    pub fn asks_for(&self, area: &str) -> bool {
        self.ask.iter().any(|need| need.area == area)
    }

    /// Whether the load is released by it.
    pub fn releases(&self) -> bool {
        self.nominal.goal.is_release()
    }

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

/// How a step could not be flown to its end.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    /// The reason.
    pub reason: String,
    /// An operator's order, or a response that only holds the vehicle, came first: it was not the step that failed.
    pub interrupted: bool,
}

/// A step that was flown to its end.
#[derive(Debug, Clone, PartialEq)]
pub struct FlownStep {
    /// The step.
    pub step: Step,
    /// The state of the vehicle after it.
    pub state: State,
    /// When.
    pub at: Now,
    /// Why a task along it has failed, if one has.
    pub along_failure: Option<String>,
}

/// All that an answer of the planner depends on, beside what is asked.
#[derive(Debug, Clone, PartialEq)]
pub struct Basis {
    /// When it is asked, by the mission's clock.
    pub at: Now,
    /// Where the vehicle is and what it may enter.
    pub state: State,
    /// Where its local frame has its origin, if that is known.
    pub vehicle_origin: Option<Origin>,
    /// The wind as it is estimated, towards north and east in m/s; `None` where it is not.
    pub wind: Option<(f64, f64)>,
    /// The mission as far as it has come, without areas, feeds and steps.
    pub mission: MissionStatus,
    /// What the planner has noted with its last answer; `None` before the first.
    pub notes: Option<v1::PlannerNotes>,
    /// Names the mission's areas.
    pub areas_id: String,
    /// The areas, encoded; `None` where the planner is thought to know them.
    pub areas: Option<Bytes>,
    /// Steps that were flown since the notes, first flown first.
    pub flown: Vec<FlownStep>,
    /// The steps of the present plan that were not flown; the first one is flown, or has failed.
    pub rest: Vec<Step>,
}

impl Basis {
    /// Nothing of `mission` has been attempted by a vehicle in `state`.
    pub fn beginning(mission: &Mission, state: State, at: Now) -> Basis {
        let areas = MissionAreas::of(&mission.areas, &mission.feeds);
        Basis {
            at,
            state,
            vehicle_origin: None,
            wind: None,
            mission: MissionStatus::beginning(mission),
            notes: None,
            areas_id: areas.id().to_owned(),
            areas: Some(areas.encoded().clone()),
            flown: Vec::new(),
            rest: Vec::new(),
        }
    }
}

/// The mission manager asks for a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanRequest {
    /// A repeated request with the same id gets the answer to the first one.
    pub request_id: String,
    /// What the answer depends on.
    pub basis: Basis,
    /// For how long each permission holds from now on.
    pub grants: Grants,
    /// How the first step of the rest has failed, if it has.
    pub failed: Option<Failure>,
    /// Areas whose permission was denied during it.
    pub denials: Vec<Denial>,
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
        /// The mission asks for this stay: the vehicle does not wait for a plan.
        planned: bool,
    },
    /// Every objective has reached its final state.
    Finished,
    /// The request is invalid, for this reason.
    Refused(String),
    /// The areas are not known that were named: they are to be sent.
    AreasUnknown,
}

/// The planner's answer, and what has become of the mission by it.
#[derive(Debug, Clone, PartialEq)]
pub struct Answered {
    /// What is to be flown.
    pub reply: PlanReply,
    /// As in [`Basis`]; `None` with a refusal and with unknown areas.
    pub course: Option<Course>,
}

/// A mission as far as it has come, and what the planner has noted.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// Without areas, feeds and steps.
    pub mission: MissionStatus,
    /// For the next question.
    pub notes: v1::PlannerNotes,
}

/// The mission that is flown.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MissionStatus {
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
    /// What is waited for; empty if nothing is.
    pub hold: String,
    /// In which order the objectives are attempted; a free one was chosen when the first plan was made.
    pub order: Order,
    /// Where a flight may end early.
    pub sites: Vec<Site>,
    /// Where the mission's places count from, if it says so: the vehicle's local frame must have its origin there.
    pub origin: Option<Origin>,
    /// The data sets that areas came from.
    pub feeds: Vec<Feed>,
}

impl MissionStatus {
    /// `mission` without its areas, nothing of which has been attempted.
    pub fn beginning(mission: &Mission) -> MissionStatus {
        MissionStatus {
            mission: mission.name.clone(),
            objectives: mission.objectives.iter().map(ObjectiveStatus::waiting).collect(),
            order: mission.order,
            sites: mission.sites.clone(),
            origin: mission.origin,
            ..MissionStatus::default()
        }
    }

    /// Whether every objective has reached its final state.
    pub fn is_settled(&self) -> bool {
        self.objectives.iter().all(|it| it.progress != Progress::Waiting)
    }
}
