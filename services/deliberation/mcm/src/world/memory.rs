//! What is known about the manager's memory: one that is lost waits for an operator, one that cannot be written prevents a takeoff.
//! Which files there are, and how they are written, is the shell's business.

use domain::contingency::{MEMORY_UNUSABLE, MEMORY_UNWRITABLE};
use domain::memory::{MemoryHealth, MemoryLoss};

use super::{SELF, World};
use crate::clients::planner::FlownMission;

/// The manager's memory.
#[derive(Debug, Default)]
pub(super) struct Memory {
    health: MemoryHealth,
    /// Whether there was a memory, or a loss of one, when the vehicle was first seen, or an operator has decided without one.
    is_known: bool,
    /// It is of a flight with another mission file, and no operator has decided since, nor was the vehicle seen on the ground: the identity of
    /// that one, and the mission of the present file.
    of_another: Option<(String, FlownMission)>,
}

impl Memory {
    /// Its persisted part.
    pub(super) fn restored(loss: Option<MemoryLoss>) -> Memory {
        Memory { health: MemoryHealth { loss, failing: None }, is_known: true, of_another: None }
    }

    /// The same of a flight with the mission file `flown`, and not with the present one.
    pub(super) fn of_another_mission(loss: MemoryLoss, flown: String, of_file: FlownMission) -> Memory {
        Memory { of_another: Some((flown, of_file)), ..Memory::restored(Some(loss)) }
    }

    /// The identity of the mission file that is flown by, if it is not the present one.
    pub(super) fn flown_file(&self) -> Option<&str> {
        self.of_another.as_ref().map(|(flown, _)| flown.as_str())
    }

    /// How it is.
    pub(super) fn health(&self) -> &MemoryHealth {
        &self.health
    }

    /// What is lost waits for an operator.
    pub(super) fn is_lost(&self) -> bool {
        self.health.loss.is_some()
    }
}

impl World {
    /// What a manager before has saved last is lost.
    pub(crate) fn memory_lost(&mut self, loss: MemoryLoss) {
        self.memory.health.loss = Some(loss);
        self.memory.is_known = true;
        self.show_memory();
    }

    /// The outcome of the newest attempt to save.
    pub(crate) fn memory_written(&mut self, outcome: Result<(), String>, loss: Option<u64>) {
        self.memory.health.written(outcome, loss);
        self.show_memory();
    }

    /// The vehicle is seen. One that is in the air at first sight was flown by somebody before: a manager that remembers nothing does not
    /// know for what. Returns whether what is remembered is of another mission, and the vehicle stands.
    pub(super) fn remembers_flight(&mut self) -> bool {
        let is_known = std::mem::replace(&mut self.memory.is_known, true);
        if !is_known && self.is_flying() {
            let why = "there is none, but the vehicle is in the air".to_owned();
            self.memory_lost(MemoryLoss { id: self.planner.instance().max(1), why });
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
        self.memory.is_known = true;
        self.take_mission_of_file();
        self.show_memory();
        Ok(())
    }

    /// From here on the mission of the file is flown, if it is another one than that of the memory.
    fn take_mission_of_file(&mut self) {
        if let Some((_, of_file)) = self.memory.of_another.take() {
            *self.planner.mission_mut() = of_file;
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
