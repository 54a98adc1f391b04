//! Waiting because there is no way now: until an area that closes it is over, or until a permission that is too short has ended.

use std::time::Duration;

use domain::airspace::Grants;
use domain::area::Area;
use domain::area_map::AreaMap;
use domain::state::State;
use domain::time::{Now, Time};
use domain::way::{Leaving, leaving};

use super::{MissionPlanner, OVER, holding, steps_to};
use crate::airspace::{Airspace, Around, Closures};
use crate::hold::Hold;
use crate::survey::Via;

impl MissionPlanner {
    /// The hold after which there is a way through `ahead`, because areas that close it now are over soon; `None` if there is none
    /// then either, or the vehicle must not wait where it is.
    pub(super) fn hold_until_over(
        &self,
        airspace: &Airspace,
        state: &State,
        ahead: &[Via],
        grants: &Grants,
        now: Now,
    ) -> Option<Hold> {
        let soon = airspace.soon_over(self.rules.config.hold_at_most_s.seconds());
        let last = soon.iter().copied().max_by_key(|(_, left)| *left)?;
        let is_trespassing = state.flying && airspace.is_trespassed(state.position);
        let leaves = || leaving(state.position, &airspace.rule, &self.rules.flight_limits());
        let must_leave = is_trespassing && !matches!(leaves(), Leaving::Stays { .. });
        if must_leave {
            return None;
        }
        let opens_a_way = |ends: Duration, most_legs: u32| {
            let is_left = |area: &&Area| soon.iter().all(|(over, left)| ends < *left || over.name != area.name);
            let areas: Vec<Area> = self.mission.areas.iter().filter(is_left).cloned().collect();
            let closures = Closures::new();
            let around = Around { map: AreaMap::new(&areas), ground: self.around.ground.clone() };
            let then = (now, self.pace);
            let later = Airspace::new((&areas, &around), grants, &self.permissions, &closures, then, &self.rules);
            later.legs_left.set(most_legs);
            steps_to(state, ahead, None, self.tolerance(), &later, &self.rules).is_ok()
        };
        let is_worth_it = |(area, left): (&Area, Duration), most_legs: u32| {
            self.permissions.may_still_hold(&area.name, left + OVER, &self.rules) && opens_a_way(left, most_legs)
        };
        // What ends elsewhere is not waited for, unless nothing else helps.
        let ends = holding::ends_in_the_way(state, ahead, airspace, &soon);
        let found = ends.into_iter().find(|it| is_worth_it(*it, holding::MOST_LEGS));
        let (area, left) = found.or_else(|| Some(last).filter(|it| is_worth_it(*it, u32::MAX)))?;
        let wait = left + OVER;
        let reason = format!("area {} is closed for {} s more", area.name, wait.as_secs());
        Some(Hold { area: area.name.clone(), since: now.time, wait, reason, outlasts_grant: false })
    }

    /// The hold after which there may be a way through `ahead` with new grants, because those for the areas in `too_short` have ended:
    /// until then the tower gives the same ones again. Only on the ground, where waiting costs no battery: whether the next grant is
    /// longer nobody knows. `None` if there would be no way either, or too much was waited for these areas already.
    pub(super) fn hold_until_new_grant(
        &self,
        state: &State,
        ahead: &[Via],
        grants: &Grants,
        too_short: &Closures,
        now: Now,
    ) -> Option<Hold> {
        let left_of = |area: &String| self.permissions.short_grant_left(area, now.time);
        let (area, reason) = too_short.iter().max_by_key(|(area, _)| left_of(area))?;
        let left = left_of(area)?;
        let wait = left + OVER;
        if state.flying || !self.permissions.may_still_hold(area, wait, &self.rules) {
            return None;
        }
        let mut permissions = self.permissions.clone();
        permissions.forget_ended_grants(now.time + wait);
        let grants: Grants = grants
            .iter()
            .filter(|(area, _)| !too_short.contains_key(*area))
            .map(|(area, left)| (area.clone(), *left))
            .collect();
        let closures = Closures::new();
        let at = (self.after(now, wait), self.pace);
        let around = (self.mission.areas.as_slice(), &self.around);
        let later = Airspace::new(around, &grants, &permissions, &closures, at, &self.rules);
        steps_to(state, ahead, None, self.tolerance(), &later, &self.rules).ok()?;
        let reason = format!("{reason}; asked for again once it has ended, in {} s", wait.as_secs());
        Some(Hold { area: area.clone(), since: now.time, wait, reason, outlasts_grant: true })
    }

    pub(super) fn end_hold(&mut self, now: Time) {
        let Some(hold) = self.hold.take() else { return };
        // A pause that follows does not count as a wait for the area.
        self.permissions.has_held(&hold.area, (now - hold.since).min(hold.wait));
        if hold.outlasts_grant {
            self.permissions.forget_ended_grants(now);
        }
    }
}
