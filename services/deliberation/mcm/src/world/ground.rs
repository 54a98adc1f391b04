//! Landings: planned, at the end of the mission, or unexpected.

use domain::flight_state::status_limit;
use domain::geometry::Ned;
use domain::time::Time;
use domain::trust::{Known, To};

use super::World;
use super::places::SAME_SITE_M;
use crate::vehicle::Vehicle;

impl World {
    /// Notices a landing and what follows from it.
    pub(super) fn watch_for_the_ground(&mut self) {
        let Some(vehicle) = self.seen.vehicle else { return };
        self.watch_landing_by_plan(vehicle.position);
        if self.remembers_flight() {
            self.forget_other_mission();
        }
        let (is_flying, was_flying) = (self.is_flying(), self.was_flying());
        let same = self.seen.flies.filter(|it| it.is_live() && it.value == is_flying);
        self.seen.flies = same.or(Some(Known::live(is_flying, self.now.time)));
        if is_flying {
            self.landings.rests_at = Some(vehicle.position);
            // Near the ground a land detector that bounces looks like a flight.
            if !self.is_near_ground() {
                self.landings.unplanned = None;
            }
            if self.seen.vehicle.is_some_and(|it| it.armed) {
                // A later crash is another one.
                self.landings.crash.take_if(|it| it.is_inspected);
            }
            if !was_flying {
                self.monitor.listed.lifts_off();
            }
        } else if was_flying && self.is_on_ground() {
            // After a restart nobody has seen where it came down.
            self.landings.rests_at = Some(vehicle.position);
            self.touched_down();
        }
        if let Some(vehicle) = self.seen.vehicle.filter(|it| !it.flying && !it.armed) {
            self.planner.mission.ground.measure(vehicle.position);
        }
        let since = |before: Option<Time>, holds: bool| before.or(Some(self.now.time)).filter(|_| holds);
        let stands = |armed| self.seen.vehicle.is_some_and(|it| !it.flying && it.armed == armed);
        self.seen.armed_on_ground_since = since(self.seen.armed_on_ground_since, stands(true));
        self.seen.at_rest_since = since(self.seen.at_rest_since, stands(false));
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
        // Where a restored landing began the vehicle stays; elsewhere somebody else has landed it meanwhile.
        let to = |began: Ned| if is_here(began) { To::Stay } else { To::GoOn };
        let landing = self.landings.by_plan.filter(|_| brought_down.is_none());
        let is_planned = landing.is_some_and(|it| it.source.permits(to(it.value)));
        if is_planned || self.mission.over.is_some() || self.landings.unplanned.is_some() {
            return;
        }
        let why = match brought_down.map(|row| self.flags.name(row)) {
            Some(flag) => format!("landed because of `{flag}`"),
            None => "landed although nothing had ordered it".to_owned(),
        };
        self.has_landed_unplanned(why);
    }

    /// Notices where the landing of a step begins. A restored one counts until a plan of this manager is flown.
    fn watch_landing_by_plan(&mut self, here: Ned) {
        let step = self.planner.flight.step();
        let lands = self.response_row().is_none() && step.is_some_and(|(step, ..)| step.nominal.goal.lands());
        let known = self.landings.by_plan.filter(|it| if it.is_live() { lands } else { step.is_none() });
        let begins = Known::live(here.at_height(0.0), self.now.time);
        self.landings.by_plan = known.or(lands.then_some(begins));
    }
}
