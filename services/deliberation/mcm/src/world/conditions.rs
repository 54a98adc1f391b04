//! Whether the state meets a step's precondition or invariant.

use std::sync::Arc;

use domain::plan::{Condition, Step};
use domain::skill::Goal;
use domain::task::TaskGoal;
use kittiwake_proto::v1::DeclaredSkill;

use super::World;
use crate::clients::skills::Handle;

impl World {
    /// The first clause of a precondition that is not met. The mode is not checked before the start, since no skill of
    /// the step executes yet.
    pub(crate) fn unmet_precondition(&self, condition: &Condition) -> Option<String> {
        let of_skill = condition.skill.as_ref().and_then(|it| self.unmet_of_skill(it, |it| &it.unmet_precondition));
        self.first_unmet(condition, false).or(of_skill)
    }

    /// The first clause of an invariant that is not met. The flight mode is checked only once the vehicle was seen in
    /// the mode of the skill that executes.
    pub(crate) fn unmet_invariant(&self, condition: &Condition) -> Option<String> {
        let of_skill = condition.skill.as_ref().and_then(|it| self.unmet_invariant_of_skill(it));
        self.first_unmet(condition, self.skills.has_shown_its_mode()).or(of_skill)
    }

    /// Whether its process lives, the skill manager notices; and a monitor that was just started says nothing yet.
    fn unmet_invariant_of_skill(&self, name: &str) -> Option<String> {
        let told = self.seen.skills.iter().find(|it| it.name == name);
        told.map(|it| it.unmet_invariant.clone()).filter(|it| !it.is_empty())
    }

    /// The tasks along the present step that go on, or may begin. Of one that may not the objective's failure is noted.
    pub(crate) fn begin_along(&mut self) -> Vec<Arc<TaskGoal>> {
        let along = self.planner.flight.step().map_or_else(Vec::new, |(step, ..)| step.along.clone());
        let may_begin = |goal: &Arc<TaskGoal>| match self.skills.along(None).contains(goal) {
            true => None,
            false => self.unmet_of_skill(&goal.task.skill, |it| &it.unmet_precondition),
        };
        let unmet: Vec<Option<String>> = along.iter().map(may_begin).collect();
        self.keep_along(along, unmet, "precondition")
    }

    /// Those along this flight that may go on, if one of them may not any more.
    pub(crate) fn broken_along(&mut self, flight: Handle) -> Option<Vec<Arc<TaskGoal>>> {
        let along = self.skills.along(Some(flight));
        let unmet: Vec<_> = along.iter().map(|it| self.unmet_invariant_of_skill(&it.task.skill)).collect();
        if unmet.iter().all(Option::is_none) {
            return None;
        }
        let along = along.to_vec();
        Some(self.keep_along(along, unmet, "invariant"))
    }

    pub(crate) fn along(&self, flight: Handle) -> Vec<Arc<TaskGoal>> {
        self.skills.along(Some(flight)).to_vec()
    }

    fn keep_along(&mut self, along: Vec<Arc<TaskGoal>>, unmet: Vec<Option<String>>, what: &str) -> Vec<Arc<TaskGoal>> {
        let mut kept = Vec::new();
        for (goal, unmet) in along.into_iter().zip(unmet) {
            match unmet {
                None => kept.push(goal),
                Some(unmet) => self.along_failed(format!("{}: {what} not met: {unmet}", goal.task.skill)),
            }
        }
        kept
    }

    /// Whether what the monitor says about the conditions of the present step's skill is older than the landing before it.
    pub(crate) fn conditions_are_late(&self) -> bool {
        let of_skill = |step: &Step| step.nominal.precondition.skill.is_some();
        let step = self.planner.flight.step().filter(|(step, ..)| of_skill(step));
        step.is_some() && self.seen.vehicle.is_some_and(|it| it.flying != self.seen.skills_in_flight)
    }

    /// What a declared skill promises and does not hold although it has succeeded.
    pub(crate) fn unmet_postcondition(&self, goal: &Goal) -> Option<String> {
        let Goal::Task(it) = goal else { return None };
        self.unmet_of_skill(&it.task.skill, |it| &it.unmet_postcondition)
    }

    /// Why the mission cannot do one of its tasks, if the present step begins the flight. On the ground the row of `skill_missing` waits for
    /// the process: this is for the moment before its flag is heard.
    pub(crate) fn skill_missing_at_takeoff(&self) -> Option<String> {
        let (step, ..) = self.planner.flight.step()?;
        let begins = matches!(step.nominal.goal, Goal::Takeoff { .. });
        let offered = |name: &String| self.seen.skills.iter().any(|it| it.name == *name && it.not_offered.is_empty());
        let missing = self.skills_needed().into_iter().filter(|_| begins).find(|it| !offered(it))?;
        Some(format!("no process offers skill `{missing}`"))
    }

    /// Why this condition of a declared skill does not hold, as the monitor says.
    fn unmet_of_skill(&self, name: &str, condition: fn(&DeclaredSkill) -> &String) -> Option<String> {
        let Some(skill) = self.seen.skills.iter().find(|it| it.name == name) else {
            return Some(format!("the monitor does not say whether a process offers skill `{name}`"));
        };
        // In flight nothing is given up because the monitor has just been started: the skill manager finds out.
        if !skill.not_offered.is_empty() && !skill.may_be_late {
            return Some(skill.not_offered.clone());
        }
        Some(condition(skill)).filter(|it| !it.is_empty()).cloned()
    }

    fn first_unmet(&self, condition: &Condition, judge_mode: bool) -> Option<String> {
        let unmet = |what: &str, found: String, wanted: String| Some(format!("{what} is {found}, wanted {wanted}"));
        let Some(vehicle) = &self.seen.vehicle else {
            return unmet("the vehicle's state", "unknown".into(), "data from the monitor".into());
        };
        if let Some(wanted) = condition.flying.filter(|it| *it != vehicle.flying) {
            let word = |flying| if flying { "in the air" } else { "on the ground" }.to_owned();
            return unmet("the vehicle", word(vehicle.flying), word(wanted));
        }
        // A step that holds before what a flag forbids is not flown in its own mode.
        let flown = self.skills.present().map(|(goal, _)| goal.mode());
        let wanted_mode = condition.mode.map(|wanted| flown.unwrap_or(wanted));
        if let Some(wanted) = wanted_mode.filter(|it| judge_mode && vehicle.mode != Some(*it)) {
            let found = vehicle.mode.map_or_else(|| "unspecified".to_owned(), |mode| mode.to_string());
            return unmet("the flight mode", found, wanted.to_string());
        }
        let held = |area: &str| self.permissions.holds(area, self.now.time, self.setup.limits.permission_margin);
        let missing = condition.permissions.iter().find(|it| !held(it))?;
        unmet("the permission", "not held".into(), format!("to enter area {missing}"))
    }
}
