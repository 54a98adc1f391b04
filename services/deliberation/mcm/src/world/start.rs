//! What a mission waits for on the ground before it begins or goes on.

use domain::mission::MissionOutcome;
use domain::time::Time;
use domain::trust::{Known, To};

use super::World;
use crate::config::Start;

impl World {
    /// Whether the mission waits for the operator to start or resume it. A mission in flight has been
    /// started, whatever the persisted state says.
    pub(crate) fn awaits_start(&self) -> bool {
        let is_not_started = self.setup.limits.start == Start::Operator
            && !self.people.operator.has_started
            && self.mission.started_s.is_none();
        // What has landed and bounces is not in flight.
        let has_landed = self.landings.unplanned.is_some() && self.is_near_ground();
        self.mission.over.is_none()
            && (has_landed || !self.is_flying())
            && (is_not_started || self.is_stopped_on_ground())
    }

    /// What has begun on the ground, or come down, goes on only by an operator's order.
    fn is_stopped_on_ground(&self) -> bool {
        let may_begin = self.memory.source().permits(To::Begin);
        self.landings.unplanned.is_some() || !may_begin || self.may_not_start_after_crash()
    }

    /// The vehicle stands where no plan wanted it to.
    pub(super) fn has_landed_unplanned(&mut self, why: String) {
        self.planner.withdraw(&why);
        self.landings.unplanned.get_or_insert(Known::live(why, self.now.time));
    }

    /// When a mission that waits to be resumed after an unplanned landing is given up; gives it up if that is now.
    pub(super) fn await_go_ahead(&mut self) -> Option<Time> {
        let Known { value: why, since, .. } = self.landings.unplanned.as_ref()?;
        let until = *since + self.setup.limits.go_ahead_limit;
        if until <= self.now.time {
            let limit_s = self.setup.limits.go_ahead_limit.as_secs();
            let reason = format!("{why}, and no operator resumed the mission within {limit_s} s");
            self.end_mission(MissionOutcome::Failure, reason);
            return None;
        }
        Some(until)
    }

    /// An operator resumes the mission after an unplanned landing.
    pub(super) fn go_ahead(&mut self) {
        self.landings.unplanned = None;
        self.count_what_is_still_listed();
    }

    /// What the monitor still lists counts for a flight that begins, also where it was answered, or taken down on the ground, before.
    pub(super) fn count_what_is_still_listed(&mut self) {
        self.monitor.news.of_monitor.next_flight(|name| self.flags.is_up(name));
    }
}
