//! A plan: tracks that run side by side, each a stack whose first entry is the last to be flown.
//!
//! Entries at the same height of the stacks are one step. A third track would be a third field here
//! and its part in [`Step`].

use domain::geometry::Ned;
use domain::plan::{AskAhead, Parameters, PermissionNeed, StepId};
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

/// The steps that are still to be flown for the current objective.
#[derive(Debug, Clone, Default)]
pub(crate) struct Plan {
    ids: Track<Option<StepId>>,
    actions: Track<ActionStep>,
    communications: Track<CommunicationStep>,
    passed: Track<usize>,
}

#[derive(Debug, Clone)]
struct Track<T> {
    stack: Vec<T>,
}

impl<T> Default for Track<T> {
    fn default() -> Track<T> {
        Track { stack: Vec::new() }
    }
}

impl Plan {
    /// A plan of `steps`, first to fly first.
    pub(crate) fn new(steps: Vec<Step>) -> Plan {
        let mut plan = Plan::default();
        for step in steps.into_iter().rev() {
            plan.push(step);
        }
        plan
    }

    /// Plans a step that is flown before all others.
    fn push(&mut self, step: Step) {
        self.ids.stack.push(step.id);
        self.actions.stack.push(step.action);
        self.communications.stack.push(step.communication);
        self.passed.stack.push(step.passed);
    }

    /// Takes the step that is flown next.
    fn pop(&mut self) -> Option<Step> {
        Some(Step {
            id: self.ids.stack.pop()?,
            action: self.actions.stack.pop()?,
            communication: self.communications.stack.pop()?,
            passed: self.passed.stack.pop()?,
        })
    }

    /// Whether nothing is left to fly.
    pub(crate) fn is_empty(&self) -> bool {
        self.ids.stack.is_empty()
    }

    /// Whether step `id` is still to be flown.
    fn contains(&self, id: StepId) -> bool {
        self.ids.stack.contains(&Some(id))
    }

    /// All steps, first to fly first.
    pub(crate) fn steps(&self) -> Vec<Step> {
        let mut rest = self.clone();
        std::iter::from_fn(|| rest.pop()).collect()
    }

    /// The step to fly after step `id`, if both are still to be flown.
    pub(crate) fn after(&self, id: StepId) -> Option<Step> {
        let mut rest = self.clone();
        rest.drop_through(id)?;
        rest.pop()
    }

    /// Step `id` has been flown, and so has what came before it. Returns those before it, and itself, if it was still there.
    pub(crate) fn drop_through(&mut self, id: StepId) -> Option<(Vec<Step>, Step)> {
        if !self.contains(id) {
            return None;
        }
        let mut before = Vec::new();
        while let Some(step) = self.pop() {
            if step.id == Some(id) {
                return Some((before, step));
            }
            before.push(step);
        }
        None
    }
}
