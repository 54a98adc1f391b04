//! Landings: planned, at the end of the mission, or unexpected.

use std::f64::consts::TAU;
use std::time::Duration;

use domain::flight_state::status_limit;
use domain::mission::MissionOutcome;
use domain::skill::Goal;
use domain::time::Time;

use domain::geometry::Ned;

use super::World;
use crate::config::Start;
use crate::vehicle::Vehicle;

/// The autopilot disarms by itself after a landing (PX4: 2 s, COM_DISARM_LAND); longer than this is not waited for it.
const DISARM_LIMIT: Duration = Duration::from_secs(10);
/// A place nearer than this to a failed landing counts as the same place.
pub(super) const SAME_SITE_M: f64 = 20.0;
/// Where the only landing site is blocked, a landing is tried this far beside it, in so many directions. (ENG: beyond what counts as
/// the same place.)
const ASIDE_M: [f64; 3] = [30.0, 60.0, 90.0];
const DIRECTIONS: u32 = 8;
/// The height of a landing site nearer than this counts for the least height of a flight.
const NEAR_SITE_M: f64 = 50.0;

/// The vehicle has landed where no plan wanted it to: the mission continues only when an operator resumes it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct UnplannedLanding {
    pub(super) since: Time,
    pub(super) why: String,
}

/// Places all round `here`, near ones first.
fn aside(here: Ned) -> impl Iterator<Item = Ned> {
    let place = move |distance_m: f64, direction: u32| {
        let (east, north) = (TAU * f64::from(direction) / f64::from(DIRECTIONS)).sin_cos();
        Ned::new(here.north_m + distance_m * north, here.east_m + distance_m * east, 0.0)
    };
    ASIDE_M.into_iter().flat_map(move |distance_m| (0..DIRECTIONS).map(move |it| place(distance_m, it)))
}

impl World {
    /// Notices a landing and what follows from it.
    pub(super) fn watch_for_the_ground(&mut self) {
        let Some(vehicle) = self.vehicle else { return };
        // A plan of this manager is flown by now: what was flown before it counts no more.
        self.landed_by_plan = self.landed_by_plan.filter(|_| self.planner.step().is_none());
        self.landing_from = self.lands_by_plan().then(|| self.landing_from.unwrap_or(vehicle.position.at_height(0.0)));
        self.remembers_flight();
        let is_flying = self.is_flying();
        let was_flying = std::mem::replace(&mut self.was_flying, is_flying);
        if is_flying {
            // Near the ground a land detector that bounces looks like a flight.
            if !self.is_near_ground() {
                self.unplanned_landing = None;
            }
            if self.vehicle.is_some_and(|it| it.armed) {
                self.forget_inspected_crash();
            }
            if !was_flying {
                self.news.of_monitor.lifts_off();
            }
        } else if was_flying && self.is_on_ground() {
            self.touched_down();
        }
        let since = |before: Option<Time>, holds: bool| before.or(Some(self.now.time)).filter(|_| holds);
        let stands = |armed| self.vehicle.is_some_and(|it| !it.flying && it.armed == armed);
        self.armed_on_ground_since = since(self.armed_on_ground_since, stands(true));
        self.at_rest_since = since(self.at_rest_since, stands(false));
        self.flies_since = since(self.flies_since, is_flying);
        if self.has_settled() {
            self.let_flags_fall_on_ground();
            self.end_where_nothing_is_left();
            // Also while a response holds, as an operator's pause does.
            self.await_go_ahead();
        }
    }

    /// Whether the vehicle has settled on the ground: with its motors off for long enough that every process has
    /// noticed, or with them on for longer than it takes to switch them off by itself.
    pub(crate) fn has_settled(&self) -> bool {
        let lasts = |since: Option<Time>, limit| since.is_some_and(|since| limit <= self.now.time - since);
        lasts(self.at_rest_since, self.limits.settle) || lasts(self.armed_on_ground_since, DISARM_LIMIT)
    }

    /// Whether the status of `vehicle` is so old that its motors and its mode may have changed since.
    pub(crate) fn is_status_silent(&self, vehicle: &Vehicle) -> bool {
        status_limit(self.limits.pace) < self.now.time - vehicle.status_at
    }

    fn touched_down(&mut self) {
        // Not who responds from now on, on the ground: who did until now.
        let brought_down = self.responding();
        let is_here =
            |began: Ned| self.vehicle.is_some_and(|it| it.position.horizontal_distance_m(began) < SAME_SITE_M);
        // Elsewhere somebody else has landed it meanwhile.
        let is_planned = brought_down.is_none() && (self.lands_by_plan() || self.landed_by_plan.is_some_and(is_here));
        if is_planned || self.mission.over.is_some() || self.unplanned_landing.is_some() {
            return;
        }
        let why = match brought_down.map(|row| self.flags.name(row)) {
            Some(flag) => format!("landed because of `{flag}`"),
            None => "landed although nothing had ordered it".to_owned(),
        };
        self.planner.withdraw(&why);
        self.unplanned_landing = Some(UnplannedLanding { since: self.now.time, why });
    }

    /// Where the landing of a step began that is flown, or was before a restart.
    pub(super) fn landing_by_plan(&self) -> Option<Ned> {
        self.landed_by_plan.or(self.landing_from)
    }

    /// Whether what is flown is the landing of a step.
    pub(super) fn lands_by_plan(&self) -> bool {
        self.responding().is_none() && self.planner.step().is_some_and(|(step, ..)| step.nominal.goal == Goal::Land)
    }

    /// Whether the mission waits for the operator to start or resume it. A mission in flight has been
    /// started, whatever the persisted state says.
    pub(crate) fn awaits_start(&self) -> bool {
        let is_not_started =
            self.limits.start == Start::Operator && !self.operator.has_started() && self.mission.started.is_none();
        // What has landed and bounces is not in flight.
        let has_landed = self.unplanned_landing.is_some() && self.is_near_ground();
        self.mission.over.is_none()
            && (has_landed || !self.is_flying())
            && (is_not_started || self.is_stopped_on_ground())
    }

    /// What has begun on the ground, or come down, goes on only by an operator's order.
    fn is_stopped_on_ground(&self) -> bool {
        self.unplanned_landing.is_some() || self.memory.is_lost() || self.may_not_start_after_crash()
    }

    /// When a mission that waits to be resumed after an unplanned landing is given up; gives it up if that is now.
    pub(super) fn await_go_ahead(&mut self) -> Option<Time> {
        let UnplannedLanding { since, why } = self.unplanned_landing.as_ref()?;
        let until = *since + self.limits.go_ahead_limit;
        if until <= self.now.time {
            let limit_s = self.limits.go_ahead_limit.as_secs();
            let reason = format!("{why}, and no operator resumed the mission within {limit_s} s");
            self.end_mission(MissionOutcome::Failure, reason);
            return None;
        }
        Some(until)
    }

    /// A landing at the vehicle's place did not come down.
    pub(crate) fn landing_failed_here(&mut self) {
        if let Some(vehicle) = &self.vehicle {
            self.blocked_sites.push(vehicle.position);
        }
    }

    /// How many landings have failed at `place`.
    pub(super) fn failed_landings_at(&self, place: Ned) -> u32 {
        let is_there = |it: &&Ned| it.horizontal_distance_m(place) < SAME_SITE_M;
        self.blocked_sites.iter().filter(is_there).count() as u32
    }

    /// Where a landing has failed `here`: places beside it, near ones first, at which none has, and where one is allowed. To hover
    /// over a blocked place ends with the battery.
    pub(super) fn places_beside(&self, here: Ned) -> Vec<Ned> {
        if self.failed_landings_at(here) == 0 {
            return Vec::new();
        }
        let is_fit = |it: &Ned| self.failed_landings_at(*it) == 0 && self.unfit_to_land(*it).is_none();
        aside(here).filter(is_fit).collect()
    }

    /// The height at which a response flies home or to another place to land at: that of returns, or higher where the vehicle is higher.
    pub(crate) fn transit_height_m(&self, here: Ned) -> f64 {
        self.clear_height_m(here).max(self.limits.return_height_m)
    }

    /// The height to fly at from `here`: the present one, or more where that is low over the origin or a landing site.
    pub(crate) fn clear_height_m(&self, here: Ned) -> f64 {
        let near = self.sites().filter(|it| it.horizontal_distance_m(here) < NEAR_SITE_M);
        let ground_m = near.map(|it| it.height_m()).fold(0.0, f64::max);
        here.height_m().max(ground_m + self.limits.flight.least_height_m)
    }

    fn sites(&self) -> impl Iterator<Item = Ned> {
        let on_ground = self.planner.status().objectives.iter().filter(|it| !it.objective.flying);
        let of_mission = self.mission_sites().iter().map(|it| it.position);
        let of_mission = of_mission.chain(on_ground.map(|it| it.objective.position));
        [Ned::default()].into_iter().chain(self.operator.landing_site()).chain(of_mission)
    }

    /// An operator resumes the mission after an unplanned landing.
    pub(super) fn go_ahead(&mut self) {
        self.unplanned_landing = None;
        self.count_what_is_still_listed();
    }
}
