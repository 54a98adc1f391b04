//! What is known about the manager's own memory and the planner's: one that is lost waits for an operator, one that cannot
//! be written prevents a takeoff. Which files there are, and how they are written, is the shell's business.

use domain::contingency::{MEMORY_UNUSABLE, MEMORY_UNWRITABLE};
use domain::memory::{MemoryHealth, MemoryLoss};

use super::{SELF, World};

/// The source of these flags where it is the planner's memory.
const PLANNER: &str = "planner";

/// Both memories.
#[derive(Debug, Default)]
pub(super) struct Memory {
    own: MemoryHealth,
    planner: MemoryHealth,
    /// The loss of the planner's memory that an operator has accepted; zero without one.
    accepted: u64,
    /// Whether the manager has found a memory, an operator has decided without one, or the planner has told that there was
    /// nothing to remember.
    is_settled: bool,
    /// Whether there was a memory, or a loss of one, when the vehicle was first seen, or an operator has decided without one.
    is_known: bool,
    /// It is of a flight with another mission file, and the vehicle was not seen since.
    is_of_another: bool,
    /// The mission file was changed in flight: a planner that was started since may know only the new one.
    is_planner_in_doubt: bool,
}

impl Memory {
    /// The persisted part of it.
    pub(super) fn restored(loss: Option<MemoryLoss>, accepted: u64, is_planner_in_doubt: bool) -> Memory {
        let own = MemoryHealth { loss, failing: None };
        Memory { own, accepted, is_settled: true, is_known: true, is_planner_in_doubt, ..Memory::default() }
    }

    /// The same of a flight with another mission file.
    pub(super) fn of_another_mission(loss: MemoryLoss, accepted: u64) -> Memory {
        Memory { is_of_another: true, ..Memory::restored(Some(loss), accepted, true) }
    }

    /// Whether the planner may have started over with another mission file.
    pub(super) fn is_planner_in_doubt(&self) -> bool {
        self.is_planner_in_doubt
    }

    /// The manager's own.
    pub(super) fn own(&self) -> &MemoryHealth {
        &self.own
    }

    /// The loss of the planner's memory that an operator has accepted; zero without one.
    pub(super) fn accepted_loss(&self) -> u64 {
        self.accepted
    }

    /// What is lost waits for an operator.
    pub(super) fn is_lost(&self) -> bool {
        self.own.loss.is_some() || self.planner_loss().is_some()
    }

    /// Whether the planner must be heard before anything begins: a manager without a memory does not know whether this is its first start.
    pub(super) fn is_settled(&self) -> bool {
        self.is_settled
    }

    /// Why one of them cannot be written.
    fn failing(&self) -> Option<&str> {
        self.own.failing.as_deref().or(self.planner.failing.as_deref())
    }

    fn planner_loss(&self) -> Option<&MemoryLoss> {
        self.unaccepted(&self.planner)
    }

    fn unaccepted<'a>(&self, health: &'a MemoryHealth) -> Option<&'a MemoryLoss> {
        health.loss.as_ref().filter(|it| it.id != self.accepted)
    }
}

impl World {
    /// What a manager before has saved last is lost.
    pub(crate) fn memory_lost(&mut self, loss: MemoryLoss) {
        self.memory.own.loss = Some(loss);
        (self.memory.is_settled, self.memory.is_known) = (true, true);
        self.planner.known_areas_mut().doubt_memory();
        self.show_memory();
    }

    /// The outcome of the newest attempt to save.
    pub(crate) fn memory_written(&mut self, outcome: Result<(), String>, loss: Option<u64>) {
        let had_lost = self.memory.own.loss.is_some();
        self.memory.own.written(outcome, loss);
        if !had_lost && self.memory.own.loss.is_some() {
            self.planner.known_areas_mut().doubt_memory();
        }
        self.show_memory();
    }

    /// Whether the planner's areas may be those of another mission: its memory is lost, it may have started over with another file, or it has
    /// made no plan while the manager's own memory is lost. An operator who accepts the loss ends that.
    pub(super) fn has_planner_lost(&self, health: &MemoryHealth, plans: u64) -> bool {
        let knows_nothing = self.memory.own.loss.is_some() && plans == 0;
        knows_nothing || self.memory.is_planner_in_doubt || self.memory.unaccepted(health).is_some()
    }

    /// The planner tells about its memory, and how many plans it has made. A manager that remembers nothing while its planner has made plans
    /// is no first one: what the one before knew, above all an end, is lost.
    pub(super) fn planner_memory(&mut self, health: MemoryHealth, plans: u64) {
        if !self.memory.is_settled && 0 < plans {
            let why = "there is none, but the planner has made plans for a manager before this one".to_owned();
            self.memory_lost(MemoryLoss { id: self.planner.instance().max(1), why });
        }
        self.memory.is_settled = true;
        if self.memory.planner != health {
            self.memory.planner = health;
            self.show_memory();
        }
    }

    /// The vehicle is seen. One that is in the air at first sight was flown by somebody before: a manager that remembers nothing does not
    /// know for what. Returns whether what is remembered is of another mission, and the vehicle stands.
    pub(super) fn remembers_flight(&mut self) -> bool {
        let is_known = std::mem::replace(&mut self.memory.is_known, true);
        if !is_known && self.is_flying() {
            let why = "there is none, but the vehicle is in the air".to_owned();
            if self.planner.has_made_no_plan() {
                self.planner.known_areas_mut().forget();
            }
            self.memory_lost(MemoryLoss { id: self.planner.instance().max(1), why });
        }
        let is_over = std::mem::take(&mut self.memory.is_of_another) && !self.is_flying();
        self.memory.is_planner_in_doubt &= !is_over;
        is_over
    }

    /// An operator lets the mission begin or go on without what is lost.
    ///
    /// # Errors
    /// If what follows could not be remembered either; on the ground nothing begins then.
    pub(super) fn accept_loss(&mut self) -> Result<(), String> {
        if let Some(why) = self.memory.failing().filter(|_| !self.is_flying()) {
            return Err(format!("what happens could not be remembered: {why}; make it writable, then start"));
        }
        self.memory.own.loss = None;
        (self.memory.is_settled, self.memory.is_known, self.memory.is_planner_in_doubt) = (true, true, false);
        self.memory.accepted = self.memory.planner.loss.as_ref().map_or(self.memory.accepted, |it| it.id);
        self.planner.believe_areas();
        self.airspace_watch.invalidate();
        self.show_memory();
        Ok(())
    }

    /// Puts the flags up or down.
    pub(super) fn show_memory(&mut self) {
        let Memory { own, planner, .. } = &self.memory;
        let planner_loss = self.memory.planner_loss().map(|it| format!("the planner's: {}", it.why));
        let planner_failing = planner.failing.as_ref().map(|why| format!("the planner's: {why}"));
        let flags = [
            (MEMORY_UNUSABLE, SELF, own.loss.as_ref().map(|it| it.why.clone())),
            (MEMORY_UNUSABLE, PLANNER, planner_loss),
            (MEMORY_UNWRITABLE, SELF, own.failing.clone()),
            (MEMORY_UNWRITABLE, PLANNER, planner_failing),
        ];
        for (flag, source, why) in flags {
            match why {
                Some(why) => self.raise(flag, source, why),
                None => self.flags.condition_gone(flag, source),
            }
        }
    }
}
