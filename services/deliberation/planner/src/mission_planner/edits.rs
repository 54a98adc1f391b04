//! What operators change in the mission.

use domain::area::Area;
use domain::feed::Feed;
use domain::mission::Mission;

use super::MissionPlanner;
use crate::objectives::Objectives;
use crate::permissions::Permissions;
use crate::stuck::Stuck;

/// What was changed besides the objectives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Edited {
    /// The plan is for what was changed.
    pub(crate) voids_plan: bool,
    /// The areas are others, or came from others.
    pub(crate) areas: bool,
}

impl MissionPlanner {
    /// Replaces the present mission by another one, of which nothing was attempted. Denials by the
    /// tower are remembered.
    pub(crate) fn take_over(&mut self, mission: Mission) {
        self.objectives = Objectives::new(&mission.objectives);
        (self.mission, self.begun) = (mission, None);
        self.edited().areas = true;
        self.withdraw_plan();
    }

    /// Replaces all areas. What was reached stays reached; the plan was made for other areas.
    pub(crate) fn replace_airspace(&mut self, areas: Vec<Area>, feeds: Vec<Feed>) {
        let is_same = self.mission.areas == areas;
        (self.mission.areas, self.mission.feeds) = (areas, feeds);
        self.edited().areas = true;
        if !is_same {
            self.withdraw_plan();
        }
    }

    /// What the tower has answered during a flight that is over says nothing of the next one.
    pub(crate) fn forget_answers_of_tower(&mut self) {
        self.permissions = Permissions::default();
    }

    /// Changes the objectives at `index`, which is not settled. The plan is for the first one that is not.
    pub(crate) fn change(&mut self, index: usize, change: impl FnOnce(&mut Objectives)) {
        let is_current = index == self.objectives.current_index();
        change(&mut self.objectives);
        self.edited();
        if is_current {
            self.withdraw_plan();
        }
    }

    fn withdraw_plan(&mut self) {
        self.rest.clear();
        self.stuck = Stuck::default();
        self.hold = None;
        self.edited().voids_plan = true;
    }

    fn edited(&mut self) -> &mut Edited {
        self.edited.get_or_insert_default()
    }
}

#[cfg(test)]
impl MissionPlanner {
    /// As many steps of the plan were flown.
    pub(crate) fn drop_first(&mut self, count: usize) {
        self.rest.drain(..count);
    }
}
