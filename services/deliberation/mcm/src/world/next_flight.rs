//! The next flight: a mission that was uploaded after the end of the one before, begun by an operator's order.
//!
//! Nothing begins by itself: that a mission waits is shown like one that waits for its first start, and `start` begins it. What
//! belonged to the flight before is over then (its end, its report, its plan, what was ordered, what was granted); what is known of the
//! vehicle and of the numbers of the tower's decisions stays. A vehicle that has crashed begins nothing: it is inspected first.

use domain::contingency::{MEMORY_UNUSABLE, MEMORY_UNWRITABLE};
use domain::trust::Known;

use super::orders::{self, Operator};
use super::{Mission, SELF, World};

impl World {
    /// Begins the mission that was uploaded since the end.
    pub(super) fn begin_next_flight(&mut self) -> Result<String, String> {
        self.refuse_if_over().or_else(|over| match self.why_not_to_begin() {
            // Not before the report: the end is still under way.
            None if self.report().is_some() => Ok(()),
            None => Err(over),
            Some(why) => Err(format!("{over}; {why}")),
        })?;
        self.accept_loss()?;
        for flag in self.flags_of_the_last_flight() {
            self.lower(&flag);
        }
        self.begin_anew();
        self.mission.begins_again = true;
        self.planner.forget_flight();
        (self.answer.response, self.answer.response_way, self.landings.no_landing_at) = (None, None, None);
        self.answer.in_transition = false;
        self.count_what_is_still_listed();
        self.landings.blocked_sites.clear();
        Ok(format!("the next mission starts: `{}`", self.planner.mission.status.mission))
    }

    /// The vehicle that flew another mission stands, as after a loss of power in flight and a way home by hand. Nothing
    /// is carried over to the current mission but that an operator decides when that begins.
    pub(super) fn forget_other_mission(&mut self) {
        let of_memory = [MEMORY_UNUSABLE, MEMORY_UNWRITABLE];
        for flag in self.flags_of_the_last_flight().into_iter().filter(|it| !of_memory.contains(&&**it)) {
            self.lower(&flag);
        }
        self.begin_anew();
        self.restore_taking(false);
        self.landings.by_plan = None;
    }

    /// Nothing has begun, ended or been ordered yet; the frame is the current one, and its time begins.
    fn begin_anew(&mut self) {
        let Mission { vehicle_name, clock, .. } = std::mem::take(&mut self.mission);
        self.mission = Mission { vehicle_name, clock, ..Mission::default() };
        // Answers are remembered, so that a repeated order begins nothing again.
        let answers = std::mem::take(&mut self.people.operator.answers);
        self.people.operator = Operator { has_started: true, answers, ..Operator::default() };
        self.restore_frame(None);
        self.permissions.begin_flight();
        self.landings.unplanned = None;
        self.seen.flies = Some(Known::live(false, self.now.time));
        self.mission.clock.begin(self.now);
    }

    /// Flags that are up by orders, or by the manager itself, and belong to a flight that is over. Those that the monitor raises stay for
    /// as long as their condition holds.
    fn flags_of_the_last_flight(&self) -> Vec<String> {
        let is_own = |source: &String| [orders::SOURCE, SELF].contains(&&**source);
        let of_flight = self.flags.iter().filter(|(_, flag)| flag.sources.iter().all(is_own));
        of_flight.map(|(name, _)| name.to_owned()).collect()
    }

    /// Whether another flight has begun since this was asked last: the tree begins at its root again.
    pub(crate) fn takes_new_tree(&mut self) -> bool {
        std::mem::take(&mut self.mission.begins_again)
    }
}
