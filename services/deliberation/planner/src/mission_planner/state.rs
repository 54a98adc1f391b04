//! What the planner knows of its mission, and what became of the current objective.

use std::time::Duration;

use domain::airspace::Grants;
use domain::mission::{Mission, Progress};
use domain::state::Tolerance;
use domain::time::{Now, Time};

use super::MissionPlanner;
use crate::airspace::{Airspace, Closures};
use crate::objectives::Objective;
use crate::rules::Rules;

impl MissionPlanner {
    /// The mission's areas as they stand `now` for a vehicle that holds `grants`.
    pub(super) fn airspace<'a>(&'a self, grants: &'a Grants, closures: &Closures, now: Now) -> Airspace<'a> {
        let areas = (self.mission.areas.as_slice(), &self.around);
        Airspace::new(areas, grants, &self.permissions, closures, (now, self.pace), &self.rules)
    }

    /// Whether every objective is settled.
    pub(crate) fn is_over(&self) -> bool {
        self.objectives.all().len() <= self.objectives.current_index()
    }

    /// This much mission time after `now`.
    pub(crate) fn after(&self, now: Now, time: Duration) -> Now {
        let wall_ms = i64::try_from(self.pace.to_wall(time).as_millis()).unwrap_or(i64::MAX);
        Now { time: now.time + time, utc_ms: now.utc_ms.saturating_add(wall_ms) }
    }

    pub(crate) fn rules(&self) -> &Rules {
        &self.rules
    }

    /// The mission as it would be put into a file now, with only what is still to be attempted.
    pub(crate) fn rest_of_mission(&self) -> Mission {
        let waiting = self.objectives.all().iter().filter(|it| it.status.progress == Progress::Waiting);
        Mission { objectives: waiting.map(|it| it.rest()).collect(), ..self.mission.clone() }
    }

    /// How near to the current objective is there.
    pub(super) fn tolerance(&self) -> Tolerance {
        self.objectives.tolerance(self.objectives.current_index(), self.rules.tolerance())
    }

    /// How long it is until `objective` must be arrived at, in mission seconds; less than nothing once that is over.
    pub(super) fn time_left_s(&self, objective: &Objective, now: Now) -> Option<f64> {
        let passed = self.begun.map_or(Duration::ZERO, |it| now.time - it);
        let within_s = objective.terms().within.map(|it| it.as_secs_f64() - passed.as_secs_f64());
        let by_utc_s = objective.terms().by_utc_ms.map(|by_utc_ms| {
            let wall_s = by_utc_ms.saturating_sub(now.utc_ms) as f64 / 1e3;
            wall_s * self.pace.speed()
        });
        within_s.into_iter().chain(by_utc_s).min_by(f64::total_cmp)
    }

    /// The current objective was reached, and the vehicle has stayed there for as long as was asked.
    pub(super) fn arrived(&mut self, now: Now) {
        let Some(objective) = self.objectives.current() else { return };
        let since = objective.dwells_since.map_or(Duration::ZERO, |since| now.time - since);
        let arrived = Now {
            time: Time::after(now.time.since_start().saturating_sub(since)),
            utc_ms: now.utc_ms - self.pace.to_wall(since).as_millis() as i64,
        };
        let along_failure = objective.status.along_failure.clone();
        let left_s =
            self.objectives.all().get(self.objectives.current_index()).and_then(|it| self.time_left_s(it, arrived));
        self.conclude(match left_s.filter(|it| *it < 0.0) {
            Some(left_s) => Progress::Failure(format!("reached {:.0} s too late", -left_s)),
            None => along_failure.map_or(Progress::Success, Progress::Failure),
        });
    }

    pub(super) fn conclude(&mut self, progress: Progress) {
        if let Some(objective) = self.objectives.current() {
            objective.status.progress = progress;
        }
        self.stuck.next_objective();
    }
}
