//! Flags: what raises them, and what is recorded about them.

use domain::contingency::INTROSPECTION_LOST;
use domain::measured::{Measured, Unit};
use domain::time::Time;
use kittiwake_proto::topics::Topic;

use super::monitor_flags::{FlagNews, ListedFlag, MONITOR};
use super::{SELF, World};

/// Of a name that has no row, which may be as long as a message.
const MOST_CHARACTERS: usize = 64;

impl World {
    /// Takes in the monitor's messages since the last tick: the newest introspection, and flags. Returns when the
    /// monitor counts as lost if nothing more comes.
    pub(crate) fn take_in_news(&mut self) -> Option<Time> {
        if let Some(vehicle) = self.monitor.vehicle.take() {
            let vehicle = self.seen.confirmed.correct(vehicle, self.now.time, &self.setup.limits);
            if let Some(mode) = vehicle.mode {
                self.skills.on_mode(mode, vehicle.status_at);
            }
            self.seen.vehicle = Some(vehicle);
            self.answer.permits.take();
            self.measure_consumption();
            self.flags.condition_gone(INTROSPECTION_LOST, SELF);
        }
        for flag in std::mem::take(&mut self.monitor.flags) {
            let (FlagNews::Raised(ListedFlag { name, .. }) | FlagNews::Fell(name)) = &flag;
            if self.flags.number(name).is_none() {
                // Counted with what the heartbeat calls malformed: a name that nobody knows cannot be acted on.
                let name: String = name.chars().take(MOST_CHARACTERS).collect();
                self.out.outbox.refuse(Topic::Introspection, format_args!("flag `{name}` has no row"));
                continue;
            }
            match flag {
                FlagNews::Raised(it) => self.raise_by(&it.name, MONITOR, it.reason, it.measured),
                FlagNews::Fell(name) => self.flags.condition_gone(&name, MONITOR),
            }
        }
        self.watch_control();
        self.watch_traffic();
        self.watch_airspace();
        self.watch_for_the_ground();
        // Also while a response holds, as an operator's pause does.
        self.give_up_waiting();
        let lost_from = self.watch_the_monitor();
        self.let_unanswered_flags_fall();
        self.take_decision();
        self.watch_progress();
        lost_from
    }

    fn watch_the_monitor(&mut self) -> Option<Time> {
        let began = *self.monitor.watches_since.get_or_insert(self.now.time);
        if let Some(until) = self.looks_first_until() {
            return Some(until);
        }
        let seen_at = match self.seen.vehicle {
            Some(vehicle) if vehicle.flying => vehicle.heard.at,
            // Not seen since this process was started, and it flew before.
            None if self.was_flying() => began,
            _ => return None,
        };
        let lost_from = seen_at + self.setup.limits.introspection;
        if self.now.time < lost_from {
            return Some(lost_from);
        }
        let (silent_s, limit_s) =
            ((self.now.time - seen_at).as_secs_f64(), self.setup.limits.introspection.as_secs_f64());
        let measured = Measured::new(silent_s, limit_s, Unit::Second);
        self.raise_by(INTROSPECTION_LOST, SELF, "the monitor is silent", measured);
        None
    }

    pub(crate) fn set_in_transition(&mut self, flies: bool) {
        self.answer.in_transition = flies;
    }
}
