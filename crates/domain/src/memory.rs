//! Whether what a process has stored can be relied on.

use kittiwake_proto::v1;

/// The state of a process's memory.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct MemoryHealth {
    /// What was known before a restart is lost, and no operator has accepted that yet.
    pub loss: Option<MemoryLoss>,
    /// Why it cannot be written at present.
    pub failing: Option<String>,
}

/// A process has started without the state that was saved last.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MemoryLoss {
    /// Differs from loss to loss, never zero.
    pub id: u64,
    /// Why.
    pub why: String,
}

impl MemoryHealth {
    /// Takes in the outcome of a write. A failure before any success is also a loss, which `loss` names then: a process
    /// before may have failed in the same way, so what was read may be outdated.
    pub fn written(&mut self, outcome: Result<(), String>, loss: Option<u64>) {
        if let (Err(why), None, Some(id)) = (&outcome, &self.loss, loss) {
            self.loss = Some(MemoryLoss { id, why: why.clone() });
        }
        self.failing = outcome.err();
    }
}

impl From<MemoryLoss> for v1::MemoryLoss {
    fn from(loss: MemoryLoss) -> v1::MemoryLoss {
        v1::MemoryLoss { id: loss.id, why: loss.why }
    }
}

impl From<v1::MemoryLoss> for MemoryLoss {
    fn from(loss: v1::MemoryLoss) -> MemoryLoss {
        MemoryLoss { id: loss.id, why: loss.why }
    }
}

impl From<MemoryHealth> for v1::MemoryHealth {
    fn from(health: MemoryHealth) -> v1::MemoryHealth {
        v1::MemoryHealth { loss: health.loss.map(Into::into), failing: health.failing.unwrap_or_default() }
    }
}

impl From<v1::MemoryHealth> for MemoryHealth {
    fn from(health: v1::MemoryHealth) -> MemoryHealth {
        MemoryHealth { loss: health.loss.map(Into::into), failing: Some(health.failing).filter(|it| !it.is_empty()) }
    }
}
