//! How busy the machine is on which the nodes run.

use std::time::Duration;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

/// How long events and nodes wait besides for each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Machine {
    /// Nothing: a message is there when it is sent, and a process has its turn when it wants it.
    Ideal,
    /// A message is under way for a while, and a process that has had its turn waits for its next one: most often for
    /// hardly any time, one time in eight for anything up to `worst`. The same seed gives the same delays.
    Busy {
        /// Of every draw.
        seed: u64,
        /// The longest a message is under way, and a process waits.
        worst: Duration,
    },
}

/// The delays of one machine, one after the other.
pub(super) struct Delays {
    machine: Machine,
    dice: ChaCha8Rng,
}

impl Delays {
    pub(super) fn of(machine: Machine) -> Delays {
        let seed = if let Machine::Busy { seed, .. } = machine { seed } else { 0 };
        Delays { machine, dice: ChaCha8Rng::seed_from_u64(seed) }
    }

    pub(super) fn draw(&mut self) -> Duration {
        let Machine::Busy { worst, .. } = self.machine else { return Duration::ZERO };
        let most = if self.dice.next_u32().is_multiple_of(8) { worst } else { worst / 50 };
        most.mul_f64(f64::from(self.dice.next_u32()) / f64::from(u32::MAX))
    }
}
