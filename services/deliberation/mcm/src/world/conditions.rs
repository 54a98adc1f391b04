//! Whether the state meets a step's precondition or invariant.

use domain::plan::Condition;
use domain::skill::Goal;
use kittiwake_proto::v1::DeclaredSkill;

use super::World;

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
        // Whether its process lives, the skill manager notices; and a monitor that was just started says nothing yet.
        let told = condition.skill.as_ref().and_then(|name| self.seen.skills.iter().find(|it| it.name == *name));
        let of_skill = told.map(|it| it.unmet_invariant.clone()).filter(|it| !it.is_empty());
        self.first_unmet(condition, self.skills.has_shown_its_mode()).or(of_skill)
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
