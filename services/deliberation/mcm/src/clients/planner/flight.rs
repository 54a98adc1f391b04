//! The step that is flown, and the next one.

use std::sync::Arc;

use domain::plan::{Denial, FailedStep, Plan, Step, StepId};
use domain::skill::Goal;
use domain::time::Time;

/// The state of the flight of a plan.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) enum Flight {
    /// No step: there is no plan, or it has no further step.
    #[default]
    Idle,
    /// A step is flown, or is about to be.
    Flying {
        /// That step.
        step: Arc<Step>,
        /// Its place in the plan, from 1, and how many steps the plan had.
        number: u32,
        /// The number of steps in the plan.
        count: u32,
        /// The next step.
        next: Next,
        /// Why the step is to be given up; its executor will do so.
        withdrawn: Option<String>,
    },
    /// The step was given up. The transition flies towards its goal until there is a plan.
    Interrupted {
        /// Its goal.
        goal: Goal,
        /// What the planner must know about it; `None` if the next plan does not depend on it.
        failed: Option<FailedStep>,
        /// Areas that were denied during it; kept until the planner knows of them.
        denials: Vec<Denial>,
    },
}

/// The step after the present one.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Next {
    /// Not asked for yet; not before this time.
    Unknown(Time),
    /// Asked for.
    Asked,
    /// Known; `None`: the plan has no further step.
    Known(Option<Arc<Step>>),
}

/// An event in the flight of a plan.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Event {
    /// A plan was adopted.
    Adopted(Plan),
    /// The next step was asked for.
    NextAsked,
    /// The planner has named the step after this one.
    NextKnown(StepId, Option<Arc<Step>>),
    /// The planner has not answered; ask again at this time.
    NextLost(StepId, Time),
    /// The present step was flown, and the next one becomes the present one.
    Advanced,
    /// The present step was flown or is void, and no next one is known.
    Dropped,
    /// The present step has failed, for this reason and because of these denials.
    Failed(String, Vec<Denial>),
    /// An operator's order, or a response that only holds the vehicle, came first.
    Interrupted(String),
    /// The present step is to be given up, for this reason.
    Withdrawn(String),
    /// The step is given up, and the planner need not know why.
    GivenUp,
    /// The planner knows of the denials.
    DenialsHeard,
    /// No step is left.
    Finished,
}

impl Flight {
    /// Takes in an event. An event about another step, or without a present step, changes nothing, because replies and
    /// failures may cross.
    pub(crate) fn on(&mut self, event: Event) {
        use {Event as E, Flight as F};
        *self = match (std::mem::take(self), event) {
            (flight, E::Adopted(plan)) => match begin(plan) {
                Some(begun) => begun,
                None => flight,
            },
            (F::Flying { step, number, count, next: Next::Unknown(_), withdrawn }, E::NextAsked) => {
                F::Flying { step, number, count, next: Next::Asked, withdrawn }
            }
            (F::Flying { step, number, count, next: Next::Asked, withdrawn }, E::NextKnown(after, next))
                if step.id == after =>
            {
                F::Flying { step, number, count, next: Next::Known(next), withdrawn }
            }
            (F::Flying { step, number, count, next: Next::Asked, withdrawn }, E::NextLost(after, again))
                if step.id == after =>
            {
                F::Flying { step, number, count, next: Next::Unknown(again), withdrawn }
            }
            (F::Flying { number, count, next: Next::Known(Some(step)), .. }, E::Advanced) => {
                F::Flying { step, number: number + 1, count, next: Next::Unknown(Time::ZERO), withdrawn: None }
            }
            (F::Flying { .. }, E::Advanced | E::Dropped) => F::Idle,
            (F::Flying { step, .. }, E::Failed(reason, denials)) => {
                let failed = Some(FailedStep { id: step.id, reason, interrupted: false });
                F::Interrupted { goal: step.nominal.goal, failed, denials }
            }
            (F::Flying { step, .. }, E::Interrupted(reason)) => {
                let failed = Some(FailedStep { id: step.id, reason, interrupted: true });
                F::Interrupted { goal: step.nominal.goal, failed, denials: Vec::new() }
            }
            (F::Flying { step, number, count, next, .. }, E::Withdrawn(reason)) => {
                F::Flying { step, number, count, next, withdrawn: Some(reason) }
            }
            (F::Flying { step, .. }, E::GivenUp) => {
                F::Interrupted { goal: step.nominal.goal, failed: None, denials: Vec::new() }
            }
            (F::Interrupted { goal, failed, .. }, E::DenialsHeard) => {
                F::Interrupted { goal, failed, denials: Vec::new() }
            }
            (F::Interrupted { goal, .. }, E::Finished) => F::Interrupted { goal, failed: None, denials: Vec::new() },
            (flight, _) => flight,
        };
    }

    /// The step that is flown, its place in the plan, and the number of steps in the plan.
    pub(crate) fn step(&self) -> Option<(&Arc<Step>, u32, u32)> {
        match self {
            Flight::Flying { step, number, count, .. } => Some((step, *number, *count)),
            Flight::Idle | Flight::Interrupted { .. } => None,
        }
    }

    /// What is known about the next step; `None` if there is no present one.
    pub(crate) fn next(&self) -> Option<&Next> {
        match self {
            Flight::Flying { next, .. } => Some(next),
            Flight::Idle | Flight::Interrupted { .. } => None,
        }
    }

    /// Why the present step is to be given up, if it is.
    pub(crate) fn withdrawal(&self) -> Option<&str> {
        match self {
            Flight::Flying { withdrawn, .. } => withdrawn.as_deref(),
            Flight::Idle | Flight::Interrupted { .. } => None,
        }
    }

    /// The goal of the step that was given up.
    pub(crate) fn interrupted_goal(&self) -> Option<Goal> {
        match self {
            Flight::Interrupted { goal, .. } => Some(*goal),
            Flight::Idle | Flight::Flying { .. } => None,
        }
    }

    /// What the planner must know about the step that was given up: its id, the reason and the denials.
    pub(crate) fn failure(&self) -> (Option<&FailedStep>, &[Denial]) {
        match self {
            Flight::Interrupted { failed, denials, .. } => (failed.as_ref(), denials),
            Flight::Idle | Flight::Flying { .. } => (None, &[]),
        }
    }
}

fn begin(plan: Plan) -> Option<Flight> {
    let count = plan.steps.len() as u32;
    let step = Arc::new(plan.steps.into_iter().next()?);
    Some(Flight::Flying { step, number: 1, count, next: Next::Unknown(Time::ZERO), withdrawn: None })
}

#[cfg(test)]
#[path = "flight_table.rs"]
mod table;
