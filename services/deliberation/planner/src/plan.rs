//! A step of a plan, which has a part in each of the tracks that run side by side. A third track would be a third part.

use domain::geometry::Ned;
use domain::plan::{self, AskAhead, Parameters, PermissionNeed, StepId};
use domain::skill::Goal;
use domain::state::State;

/// What one step has in each track, with the id that names it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Step {
    /// Unique among the steps of all plans; `None`: it is new, and has not been given one yet.
    pub id: Option<StepId>,
    /// Its part of the action track.
    pub action: ActionStep,
    /// Its part of the communication track.
    pub communication: CommunicationStep,
    /// How many turns of the objective's survey have been passed once it is flown; 0 where it reaches none.
    pub passed: usize,
}

/// In a few words: `fly to (0, 90, 10), asking A and B`.
impl std::fmt::Display for Step {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.action.nominal.goal)?;
        match self.communication.ask.as_slice() {
            [] => Ok(()),
            needs => {
                let areas: Vec<&str> = needs.iter().map(|need| need.area.as_str()).collect();
                write!(f, ", asking {}", areas.join(" and "))
            }
        }
    }
}

/// Something to fly.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ActionStep {
    /// Its name in the table of actions.
    pub name: &'static str,
    /// Where the plan has the vehicle when it starts.
    pub from: Ned,
    /// The state it reaches.
    pub to: State,
    /// How it is flown when nothing is amiss. How it is flown while a new plan is made is computed
    /// when that is needed, from where the vehicle is then.
    pub nominal: Parameters,
}

/// What to ask the control tower during a step.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct CommunicationStep {
    /// Permissions to be got, and how long each must hold; empty for none.
    pub ask: Vec<PermissionNeed>,
    /// What later steps need and is asked for during this one already; see [`crate::asking_ahead`].
    pub ask_ahead: Vec<AskAhead>,
    /// The communication plan added the step.
    pub auxiliary: bool,
}

impl Step {
    /// As it is flown for the objective of this index; `None` if it has no id yet.
    pub(crate) fn flyable(&self, objective: usize) -> Option<plan::Step> {
        Some(plan::Step {
            id: self.id?,
            objective: objective as u32,
            from: self.action.from,
            reaches: self.action.to.clone(),
            nominal: self.action.nominal.clone(),
            ask: self.communication.ask.clone(),
            ask_ahead: self.communication.ask_ahead.clone(),
            auxiliary: self.communication.auxiliary,
            passed: self.passed as u32,
            text: self.to_string(),
        })
    }
}

/// A step that was given out.
impl From<plan::Step> for Step {
    fn from(step: plan::Step) -> Step {
        let name = match step.nominal.goal {
            Goal::Takeoff { .. } => "takeoff",
            Goal::Land => "land",
            Goal::Stop => "stop",
            Goal::Release { .. } => "release",
            Goal::Position { .. } | Goal::Velocity { .. } => "position",
        };
        let communication = CommunicationStep { ask: step.ask, ask_ahead: step.ask_ahead, auxiliary: step.auxiliary };
        Step {
            id: Some(step.id),
            action: ActionStep { name, from: step.from, to: step.reaches, nominal: step.nominal },
            communication,
            passed: step.passed as usize,
        }
    }
}
