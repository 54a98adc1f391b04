//! Whether the state meets a step's precondition or invariant.

use domain::plan::Condition;

use super::World;

impl World {
    /// The first clause of a precondition that is not met. The mode is not checked before the start, since no skill of
    /// the step executes yet.
    pub(crate) fn unmet_precondition(&self, condition: &Condition) -> Option<String> {
        self.first_unmet(condition, false)
    }

    /// The first clause of an invariant that is not met. The flight mode is checked only once the vehicle was seen in
    /// the mode of the skill that executes.
    pub(crate) fn unmet_invariant(&self, condition: &Condition) -> Option<String> {
        self.first_unmet(condition, self.skills.has_shown_its_mode())
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
