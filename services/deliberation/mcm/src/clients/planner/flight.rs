//! The plan that is flown, and its present step.

use std::sync::Arc;

use domain::plan::{Denial, Failure, Plan, Step};

#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) enum Flight {
    /// No step: there is no plan, or it has no further step.
    #[default]
    Idle,
    /// A step is flown, or is about to be.
    Flying {
        steps: Arc<[Arc<Step>]>,
        /// Which of them it is, from 0.
        at: usize,
        /// Why the plan is to be given up; the executor of its present step will do so.
        withdrawn: Option<String>,
    },
    /// The step was given up. The transition flies towards its goal until there is a plan.
    Interrupted {
        /// The steps of the plan, and which of them it is.
        steps: Arc<[Arc<Step>]>,
        at: usize,
        /// How it has failed; `None` if the next plan does not depend on it, or the planner knows the failure.
        failed: Option<Failure>,
        /// Areas that were denied during it.
        denials: Vec<Denial>,
    },
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Event {
    /// A plan was adopted.
    Adopted(Plan),
    /// The present step was flown, and the next one becomes the present one, if there is one.
    Advanced,
    /// The present step must not begin.
    Dropped,
    /// The present step has failed, for this reason and because of these denials.
    Failed(String, Vec<Denial>),
    /// An operator's order, or a response that only holds the vehicle, came first.
    Interrupted(String),
    /// The present step is to be given up, for this reason.
    Withdrawn(String),
    /// The step is given up, and the planner need not know why.
    GivenUp,
    /// The planner knows how the plan ended.
    Heard,
}

impl Flight {
    /// Takes in an event. An event about another step, or without a present step, changes nothing, because replies and
    /// failures may cross.
    pub(crate) fn on(&mut self, event: Event) {
        use {Event as E, Flight as F};
        let interrupted = |steps, at, failed, denials| F::Interrupted { steps, at, failed, denials };
        *self = match (std::mem::take(self), event) {
            (flight, E::Adopted(plan)) if plan.steps.is_empty() => flight,
            (_, E::Adopted(plan)) => {
                F::Flying { steps: plan.steps.into_iter().map(Arc::new).collect(), at: 0, withdrawn: None }
            }
            (F::Flying { steps, at, withdrawn }, E::Advanced) if at + 1 < steps.len() => {
                F::Flying { steps, at: at + 1, withdrawn }
            }
            (F::Flying { .. }, E::Advanced | E::Dropped) => F::Idle,
            (F::Flying { steps, at, .. }, E::Failed(reason, denials)) => {
                interrupted(steps, at, Some(Failure { reason, interrupted: false }), denials)
            }
            (F::Flying { steps, at, .. }, E::Interrupted(reason)) => {
                interrupted(steps, at, Some(Failure { reason, interrupted: true }), Vec::new())
            }
            (F::Flying { steps, at, .. }, E::Withdrawn(reason)) => F::Flying { steps, at, withdrawn: Some(reason) },
            (F::Flying { steps, at, .. }, E::GivenUp) | (F::Interrupted { steps, at, .. }, E::Heard) => {
                interrupted(steps, at, None, Vec::new())
            }
            (flight, _) => flight,
        };
    }

    /// The step that is flown, its place in the plan, and the number of steps in the plan.
    pub(crate) fn step(&self) -> Option<(&Arc<Step>, u32, u32)> {
        let Flight::Flying { steps, at, .. } = self else { return None };
        Some((&steps[*at], *at as u32 + 1, steps.len() as u32))
    }

    pub(crate) fn next(&self) -> Option<&Arc<Step>> {
        let Flight::Flying { steps, at, .. } = self else { return None };
        steps.get(at + 1)
    }

    /// The steps that were not flown, the present or interrupted one first.
    pub(crate) fn rest(&self) -> Vec<Step> {
        match self {
            Flight::Flying { steps, at, .. } | Flight::Interrupted { steps, at, failed: Some(_), .. } => {
                steps[*at..].iter().map(|it| (**it).clone()).collect()
            }
            Flight::Idle | Flight::Interrupted { failed: None, .. } => Vec::new(),
        }
    }

    pub(crate) fn withdrawal(&self) -> Option<&str> {
        let Flight::Flying { withdrawn, .. } = self else { return None };
        withdrawn.as_deref()
    }

    pub(crate) fn interrupted(&self) -> Option<&Step> {
        let Flight::Interrupted { steps, at, .. } = self else { return None };
        Some(&steps[*at])
    }

    /// What the planner must know about the step that was given up: how it failed, and the denials.
    pub(crate) fn failure(&self) -> (Option<&Failure>, &[Denial]) {
        let Flight::Interrupted { failed, denials, .. } = self else { return (None, &[]) };
        (failed.as_ref(), denials)
    }
}

#[cfg(test)]
#[path = "flight_table.rs"]
mod table;
