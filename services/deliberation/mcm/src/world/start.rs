//! What a mission waits for on the ground before it begins or goes on.

use domain::mission::MissionOutcome;
use domain::trust::{Known, To};

use super::World;
use super::crash::INSPECT_FIRST;
use crate::config::Start;
use crate::decide::{Awaited, Wait};

impl World {
    /// Whether the mission waits for the operator to start or resume it. A mission in flight has been
    /// started, whatever the persisted state says.
    pub(crate) fn awaits_start(&self) -> bool {
        let is_not_started = self.setup.limits.config.start == Start::Operator
            && !self.people.operator.has_started
            && self.mission.started_s.is_none();
        let may_begin = self.memory.source().permits(To::Begin);
        // What has landed and bounces is not in flight.
        let has_landed = self.landings.unplanned.is_some() && self.is_near_ground();
        self.mission.over.is_none()
            && (has_landed || !self.is_flying())
            && (is_not_started || self.landings.unplanned.is_some() || !may_begin || self.may_not_start_after_crash())
    }

    /// The vehicle stands where no plan wanted it to.
    pub(super) fn has_landed_unplanned(&mut self, why: String) {
        self.planner.withdraw(&why);
        self.landings.unplanned.get_or_insert(Known::live(why, self.now.time));
    }

    /// What an operator must order before the mission begins or goes on.
    pub(super) fn awaited_order(&self) -> Option<Wait> {
        if self.report().is_some() {
            let waits = self.why_not_to_begin().is_none();
            return waits.then_some(Wait { what: Awaited::NextStart, until: None });
        }
        let go_ahead = |since| Wait {
            what: Awaited::GoAhead,
            until: Some(since + self.setup.limits.config.go_ahead_limit_s.seconds()),
        };
        let landed = self.landings.unplanned.as_ref().map(|it| go_ahead(it.since));
        self.awaits_start().then(|| landed.unwrap_or(Wait { what: Awaited::Start, until: None }))
    }

    pub(super) fn why_not_to_begin(&self) -> Option<&'static str> {
        if self.uninspected_crash().is_some() {
            Some(INSPECT_FIRST)
        } else if !self.mission.over.as_ref().is_some_and(|it| it.is_next_uploaded) || self.planner.mission.is_settled()
        {
            Some("upload the next mission to fly again")
        } else if !self.is_on_ground() || self.seen.vehicle.is_none_or(|it| it.armed) {
            Some("the vehicle is not seen on the ground, disarmed")
        } else {
            None
        }
    }

    /// Gives up a mission that has waited for as long as it may to be resumed after an unplanned landing.
    pub(super) fn give_up_waiting(&mut self) {
        let is_over = |it: Wait| it.what == Awaited::GoAhead && it.is_over(self.now.time);
        if let Some(landing) = self.landings.unplanned.as_ref().filter(|_| self.awaited_order().is_some_and(is_over)) {
            let limit_s = self.setup.limits.config.go_ahead_limit_s.seconds().as_secs();
            let reason = format!("{}, and no operator resumed the mission within {limit_s} s", landing.value);
            self.end_mission(MissionOutcome::Failure, reason);
        }
    }

    /// An operator resumes the mission after an unplanned landing.
    pub(super) fn go_ahead(&mut self) {
        self.landings.unplanned = None;
        self.count_what_is_still_listed();
    }

    /// What the monitor still lists counts for a flight that begins, also where it was answered, or taken down on the ground, before.
    pub(super) fn count_what_is_still_listed(&mut self) {
        self.monitor.listed.next_flight(|name| self.flags.is_up(name));
    }
}
