//! The objectives, in order, and their progress.

use std::collections::BTreeSet;

use domain::mission::{self, ObjectiveStatus, Progress};
use domain::state::State;

use crate::plan::Step;

/// The objectives of the mission; the first that is not terminal is the current one.
#[derive(Debug)]
pub struct Objectives {
    list: Vec<Objective>,
}

/// An objective and its course so far.
#[derive(Debug)]
pub struct Objective {
    /// Unique within the mission.
    pub name: String,
    /// The state to reach.
    pub goal: State,
    /// Its progress.
    pub progress: Progress,
    /// Total number of steps planned for it.
    pub plan_steps: u32,
    /// Number of plans made for it.
    pub plans: u32,
    /// Areas whose permission was requested for it, each once, in the order of the plan.
    pub permissions: Vec<String>,
}

impl Objectives {
    /// Those of the mission, all waiting.
    pub fn new(objectives: &[mission::Objective]) -> Objectives {
        Objectives { list: objectives.iter().map(Objective::waiting).collect() }
    }

    /// Those of a mission that was begun.
    pub fn with_past(list: Vec<Objective>) -> Objectives {
        Objectives { list }
    }

    /// Puts one in at `index`, which is no less than the current one's and no more than their number.
    pub fn insert(&mut self, index: usize, objective: &mission::Objective) {
        self.list.insert(index.min(self.list.len()), Objective::waiting(objective));
    }

    /// Takes one out.
    pub fn remove(&mut self, index: usize) {
        self.list.remove(index);
    }

    /// Gives one up.
    pub fn give_up(&mut self, index: usize, reason: String) {
        if let Some(objective) = self.list.get_mut(index) {
            objective.progress = Progress::Failure(reason);
        }
    }

    /// All of them, in order.
    pub fn all(&self) -> &[Objective] {
        &self.list
    }

    /// The index of the one worked on; the number of objectives once all are terminal.
    pub fn current_index(&self) -> usize {
        self.list.iter().position(|it| it.progress == Progress::Waiting).unwrap_or(self.list.len())
    }

    /// The one worked on.
    pub fn current(&mut self) -> Option<&mut Objective> {
        self.list.iter_mut().find(|it| it.progress == Progress::Waiting)
    }
}

impl Objective {
    /// An objective that was not attempted yet.
    pub fn waiting(it: &mission::Objective) -> Objective {
        Objective {
            name: it.name.clone(),
            goal: State::new(it.position, it.flying),
            progress: Progress::Waiting,
            plan_steps: 0,
            plans: 0,
            permissions: Vec::new(),
        }
    }

    /// A plan was made for it, of which `new_steps` were not in the one before.
    pub fn planned(&mut self, new_steps: &[Step]) {
        self.plans += 1;
        self.plan_steps += new_steps.len() as u32;
        let mut known: BTreeSet<String> = self.permissions.iter().cloned().collect();
        let asked = new_steps.iter().flat_map(|it| &it.communication.ask);
        self.permissions.extend(asked.filter(|it| known.insert((*it).clone())).cloned());
    }

    /// As in the planner's status.
    pub fn status(&self) -> ObjectiveStatus {
        ObjectiveStatus {
            objective: self.objective(),
            progress: self.progress.clone(),
            plan_steps: self.plan_steps,
            replans: self.plans.saturating_sub(1),
            permissions: self.permissions.clone(),
        }
    }

    /// As a mission file has it.
    pub fn objective(&self) -> mission::Objective {
        mission::Objective { name: self.name.clone(), position: self.goal.position, flying: self.goal.flying }
    }
}
