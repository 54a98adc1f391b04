//! Landings: planned, at the end of the mission, or unexpected.

use domain::flight_state::status_limit;
use domain::geometry::Ned;
use domain::skill::Goal;
use domain::time::Time;

use super::World;
use super::places::SAME_SITE_M;
use crate::vehicle::Vehicle;

/// The vehicle has landed where no plan wanted it to: the mission continues only when an operator resumes it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct UnplannedLanding {
    pub(super) since: Time,
    pub(super) why: String,
}

impl World {
    /// Notices a landing and what follows from it.
    pub(super) fn watch_for_the_ground(&mut self) {
        let Some(vehicle) = self.seen.vehicle else { return };
        // A plan of this manager is flown by now: what was flown before it counts no more.
        self.landings.landed_by_plan = self.landings.landed_by_plan.filter(|_| self.planner.step().is_none());
        self.landings.landing_from =
            self.lands_by_plan().then(|| self.landings.landing_from.unwrap_or(vehicle.position.at_height(0.0)));
        if self.remembers_flight() {
            self.forget_other_mission();
        }
        let is_flying = self.is_flying();
        let was_flying = std::mem::replace(&mut self.seen.was_flying, is_flying);
        if is_flying {
            // Near the ground a land detector that bounces looks like a flight.
            if !self.is_near_ground() {
                self.landings.unplanned_landing = None;
            }
            if self.seen.vehicle.is_some_and(|it| it.armed) {
                self.forget_inspected_crash();
            }
            if !was_flying {
                self.monitor.news.of_monitor.lifts_off();
            }
        } else if was_flying && self.is_on_ground() {
            self.touched_down();
        }
        let since = |before: Option<Time>, holds: bool| before.or(Some(self.now.time)).filter(|_| holds);
        let stands = |armed| self.seen.vehicle.is_some_and(|it| !it.flying && it.armed == armed);
        self.seen.armed_on_ground_since = since(self.seen.armed_on_ground_since, stands(true));
        self.seen.at_rest_since = since(self.seen.at_rest_since, stands(false));
        self.seen.flies_since = since(self.seen.flies_since, is_flying);
        if self.has_settled() {
            self.let_flags_fall_on_ground();
            self.end_where_nothing_is_left();
        }
    }

    /// Whether the status of `vehicle` is so old that its motors and its mode may have changed since.
    pub(crate) fn is_status_silent(&self, vehicle: &Vehicle) -> bool {
        status_limit(self.setup.limits.pace) < self.now.time - vehicle.status_at
    }

    fn touched_down(&mut self) {
        // Not who responds from now on, on the ground: who did until now.
        let brought_down = self.response_row();
        let is_here =
            |began: Ned| self.seen.vehicle.is_some_and(|it| it.position.horizontal_distance_m(began) < SAME_SITE_M);
        // Elsewhere somebody else has landed it meanwhile.
        let is_planned =
            brought_down.is_none() && (self.lands_by_plan() || self.landings.landed_by_plan.is_some_and(is_here));
        if is_planned || self.mission.over.is_some() || self.landings.unplanned_landing.is_some() {
            return;
        }
        let why = match brought_down.map(|row| self.flags.name(row)) {
            Some(flag) => format!("landed because of `{flag}`"),
            None => "landed although nothing had ordered it".to_owned(),
        };
        self.planner.withdraw(&why);
        self.landings.unplanned_landing = Some(UnplannedLanding { since: self.now.time, why });
    }

    /// Where the landing of a step began that is flown, or was before a restart.
    pub(super) fn landing_by_plan(&self) -> Option<Ned> {
        self.landings.landed_by_plan.or(self.landings.landing_from)
    }

    /// Whether what is flown is the landing of a step.
    pub(super) fn lands_by_plan(&self) -> bool {
        self.response_row().is_none() && self.planner.step().is_some_and(|(step, ..)| step.nominal.goal == Goal::Land)
    }
}
