//! A service that can continue from the state of a process before it.

use control_tower::ControlTower;
use domain::memory::MemoryLoss;
use kittiwake_proto::v1::{McmMemory, TowerMemory};
use mcm::Mcm;
use node::Node;
use prost::{Message, Name};

use crate::recording::{Input, Recorded, Sink};

/// A service with a persisted state.
pub trait Resumable: Node {
    /// The persisted state.
    type Memory: Message + Name + Default + PartialEq;

    /// The form of its state, for the store: a state in an earlier form is not read.
    const FORMAT: u32 = 1;

    /// The present state.
    fn memory(&self) -> Self::Memory;

    /// Continues from a state. The error says why it does not, and then nothing is changed.
    fn resume(&mut self, memory: Self::Memory) -> Result<(), Resumed>;

    /// What was saved last by the process before is lost.
    fn memory_lost(&mut self, loss: MemoryLoss);

    /// The outcome of the newest attempt to save; `loss` names the loss that a failure is, as long as none has succeeded.
    fn memory_written(&mut self, outcome: Result<(), String>, loss: Option<u64>);

    /// This state is on the disk.
    fn memory_saved(&mut self, memory: &Self::Memory) {
        let _ = memory;
    }
}

/// Why a service does not continue from a state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Resumed {
    /// Somebody has given it another mission since: it begins again.
    AnotherMission,
    /// The state makes no sense, for this reason.
    Unusable(String),
}

/// What a recorded service is given by its shell is recorded, too.
impl<N: Resumable, S: Sink> Resumable for Recorded<N, S> {
    type Memory = N::Memory;

    const FORMAT: u32 = N::FORMAT;

    fn memory(&self) -> N::Memory {
        self.node().memory()
    }

    fn resume(&mut self, memory: N::Memory) -> Result<(), Resumed> {
        self.given(Input::Resume(memory.encode_to_vec())).resume(memory)
    }

    fn memory_lost(&mut self, loss: MemoryLoss) {
        self.given(Input::Lost(loss.clone())).memory_lost(loss);
    }

    fn memory_written(&mut self, outcome: Result<(), String>, loss: Option<u64>) {
        self.given(Input::Written(outcome.clone(), loss)).memory_written(outcome, loss);
    }
}

impl Resumable for Mcm {
    type Memory = McmMemory;

    /// The first one had no mission, and the second one no groups.
    const FORMAT: u32 = 3;

    fn memory(&self) -> McmMemory {
        self.memory()
    }

    fn resume(&mut self, memory: McmMemory) -> Result<(), Resumed> {
        self.resume(memory).map_err(|it| match it {
            mcm::UnusableState::OfAnotherMission => Resumed::AnotherMission,
            other => Resumed::Unusable(other.to_string()),
        })
    }

    fn memory_lost(&mut self, loss: MemoryLoss) {
        self.memory_lost(loss);
    }

    fn memory_written(&mut self, outcome: Result<(), String>, loss: Option<u64>) {
        self.memory_written(outcome, loss);
    }
}

impl Resumable for ControlTower {
    type Memory = TowerMemory;

    fn memory(&self) -> TowerMemory {
        self.memory()
    }

    fn resume(&mut self, memory: TowerMemory) -> Result<(), Resumed> {
        self.resume(memory).map_err(|it| Resumed::Unusable(it.to_string()))
    }

    fn memory_lost(&mut self, loss: MemoryLoss) {
        self.memory_lost(loss);
    }

    fn memory_written(&mut self, outcome: Result<(), String>, loss: Option<u64>) {
        self.memory_written(outcome, loss);
    }

    fn memory_saved(&mut self, memory: &TowerMemory) {
        self.memory_saved(memory);
    }
}
