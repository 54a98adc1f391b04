//! What operators change in the mission.

use domain::area::Area;
use domain::feed::Feed;
use domain::mission::Mission;

use super::MissionPlanner;
use crate::objectives::Objectives;
use crate::permissions::Permissions;
use crate::plan::Plan;
use crate::stuck::Stuck;

impl MissionPlanner {
    /// Replaces the present mission by another one, of which nothing was attempted. Denials by the
    /// tower are remembered.
    pub(crate) fn take_over(&mut self, mission: Mission) {
        self.objectives = Objectives::new(&mission.objectives);
        (self.mission, self.begun, self.chosen_order) = (mission, None, None);
        self.withdraw_plan();
    }

    /// Replaces all areas. What was reached stays reached; the plan was made for other areas.
    pub(crate) fn replace_airspace(&mut self, areas: Vec<Area>, feeds: Vec<Feed>) {
        let is_same = self.mission.areas == areas;
        (self.mission.areas, self.mission.feeds) = (areas, feeds);
        if !is_same {
            self.withdraw_plan();
        }
    }

    /// What the tower has answered during a flight that is over says nothing of the next one.
    pub(crate) fn forget_answers_of_tower(&mut self) {
        self.permissions = Permissions::default();
    }

    /// Puts an objective in at `index`; see [`Objectives::insert`].
    pub(crate) fn insert(&mut self, index: usize, objective: domain::mission::Objective) {
        let is_next = index == self.objectives.current_index();
        self.objectives.insert(index, &objective);
        if is_next {
            self.withdraw_plan();
        }
    }

    /// Takes out the objective at `index`, which is not settled.
    pub(crate) fn remove(&mut self, index: usize) {
        let was_current = index == self.objectives.current_index();
        self.objectives.remove(index);
        if was_current {
            self.withdraw_plan();
        }
    }

    /// Gives up the objective at `index`, which is not settled.
    pub(crate) fn skip(&mut self, index: usize, reason: String) {
        let was_current = index == self.objectives.current_index();
        self.objectives.give_up(index, reason);
        if was_current {
            self.withdraw_plan();
        }
    }

    /// The plan becomes void; the mission manager learns it by the epoch.
    pub(super) fn withdraw_plan(&mut self) {
        self.plan = Plan::default();
        self.last_done = None;
        self.stuck = Stuck::default();
        self.hold = None;
        self.epoch += 1;
    }
}
