//! What is known about the manager's memory: one that is lost waits for an operator, one that cannot be written prevents a takeoff.
//! Which files there are, and how they are written, is the shell's business.

use domain::contingency::{MEMORY_UNUSABLE, MEMORY_UNWRITABLE};
use domain::memory::{MemoryHealth, MemoryLoss};
use domain::trust::{Doubt, Known, Source};

use super::{SELF, World};
use crate::clients::planner::FlownMission;

#[derive(Debug, Default)]
pub(super) struct Memory {
    pub(super) health: MemoryHealth,
    /// It is of a flight with another mission file, and no operator has decided since, nor was the vehicle seen on the ground: the identity of
    /// that one, and the mission of the present file.
    pub(super) of_another: Option<(String, FlownMission)>,
}

impl Memory {
    /// What is lost waits for an operator.
    pub(super) fn is_lost(&self) -> bool {
        self.health.loss.is_some()
    }

    /// Where the mission is from, with its progress and orders: what the manager has decided itself is as good after a restart as before.
    pub(super) fn source(&self) -> Source {
        if self.is_lost() { Source::Doubted(Doubt::StateLost) } else { Source::Live }
    }
}

impl World {
    /// What a manager before has saved last is lost.
    pub(crate) fn memory_lost(&mut self, loss: MemoryLoss) {
        self.memory.health.loss = Some(loss);
        self.show_memory();
    }

    pub(crate) fn memory_written(&mut self, outcome: Result<(), String>, loss: Option<u64>) {
        self.memory.health.written(outcome, loss);
        self.show_memory();
    }

    /// The vehicle is seen. One that is in the air at first sight was flown by somebody before: a manager that remembers nothing, or
    /// no mission that has begun, does not know for what. Returns whether what is remembered is of another mission, and the vehicle stands.
    pub(super) fn remembers_flight(&mut self) -> bool {
        let has_begun = self.people.operator.has_started || self.mission.started_s.is_some() || self.over().is_some();
        let why = match self.seen.flies {
            None => Some("there is none, but the vehicle is in the air"),
            Some(it) if !it.is_live() && !has_begun => {
                Some("by it no mission has begun, but the vehicle is in the air")
            }
            Some(_) => None,
        };
        if let Some(why) = why.filter(|_| !self.memory.is_lost() && self.is_flying()) {
            self.memory_lost(MemoryLoss { id: self.planner.instance.max(1), why: why.to_owned() });
        }
        let is_over = self.memory.of_another.is_some() && !self.is_flying();
        if is_over {
            self.take_mission_of_file();
        }
        is_over
    }

    /// An operator lets the mission begin or go on without what is lost.
    ///
    /// # Errors
    /// If what follows could not be remembered either; on the ground nothing begins then.
    pub(super) fn accept_loss(&mut self) -> Result<(), String> {
        if let Some(why) = self.memory.health.failing.as_ref().filter(|_| !self.is_flying()) {
            return Err(format!("what happens could not be remembered: {why}; make it writable, then start"));
        }
        self.memory.health.loss = None;
        // Nor is it a loss if a vehicle that was not seen yet turns out to fly.
        self.seen.flies.get_or_insert(Known::live(false, self.now.time));
        self.take_mission_of_file();
        self.show_memory();
        Ok(())
    }

    /// From here on the mission of the file is flown, if it is another one than that of the memory.
    fn take_mission_of_file(&mut self) {
        if let Some((_, of_file)) = self.memory.of_another.take() {
            self.planner.mission = of_file;
            self.watch.airspace.invalidate();
        }
    }

    /// Puts the flags up or down.
    pub(super) fn show_memory(&mut self) {
        let MemoryHealth { loss, failing } = self.memory.health.clone();
        for (flag, why) in [(MEMORY_UNUSABLE, loss.map(|it| it.why)), (MEMORY_UNWRITABLE, failing)] {
            match why {
                Some(why) => self.raise(flag, SELF, why),
                None => self.flags.condition_gone(flag, SELF),
            }
        }
    }
}
