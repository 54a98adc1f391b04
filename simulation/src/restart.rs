//! Processes that are killed and started again, with what the one before has saved or without it.

use std::collections::BTreeMap;
use std::fmt;

use domain::memory::MemoryLoss;
use domain::time::{Now, Time};
use node::Node;
use prost::Message as _;

use crate::resumable::Resumable;
use crate::shared::Shared;

/// What a process that is started again knows of the one before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Memory {
    /// All that it had saved, which is all.
    Restored,
    /// Nothing: what it had saved cannot be read, and it knows that.
    Lost,
}

impl fmt::Display for Memory {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Memory::Restored => "with its memory",
            Memory::Lost => "without its memory",
        })
    }
}

/// How each process is started again.
#[derive(Default)]
pub(crate) struct Starts {
    successors: BTreeMap<&'static str, Successor>,
    /// Starts after the first ones.
    count: u64,
}

/// Makes the node that follows the one before: what it knows of that one, when, and the number of its start.
type Successor = Box<dyn FnMut(Memory, Now, u64) -> Box<dyn Node>>;

impl Starts {
    /// The node that follows the one of this process.
    ///
    /// # Panics
    /// If there is no such process, or it cannot be started again.
    pub(crate) fn again(&mut self, process: &str, memory: Memory, now: Now) -> Box<dyn Node> {
        self.count += 1;
        let successor = self.successors.get_mut(process);
        let Some(successor) = successor else { panic!("`{process}` is not a process that can be started again") };
        successor(memory, now, self.count)
    }

    /// A process that knows nothing of those before it. `make` is given the number of the start, 0 for the first, and the time.
    pub(crate) fn of_forgetful<N: Node + 'static>(&mut self, make: impl Fn(u64, Now) -> N + 'static) -> N {
        let first = make(0, Now { time: Time::ZERO, utc_ms: 0 });
        self.successors.insert(first.name(), Box::new(move |_, now, start| Box::new(make(start, now))));
        first
    }

    /// A process that saves what the next one needs. `make` is given the number of the start, 0 for the first, and the time.
    pub(crate) fn of_resumable<N: Resumable + 'static>(&mut self, make: impl Fn(u64, Now) -> N + 'static) -> Shared<N> {
        let first = Shared::of(make(0, Now { time: Time::ZERO, utc_ms: 0 }));
        let mut latest = first.clone();
        let name = first.name();
        self.successors.insert(
            name,
            Box::new(move |memory, now, start| {
                let mut node = make(start, now);
                // Encoded and decoded, as a disk does: what a disk loses is lost here too.
                let saved = latest.look().memory().encode_to_vec();
                let saved = N::Memory::decode(saved.as_slice()).expect("what was encoded decodes");
                // No two losses have one number, and none has zero.
                let lost = |why| MemoryLoss { id: start, why };
                match memory {
                    Memory::Lost => node.memory_lost(lost("it cannot be read".to_owned())),
                    Memory::Restored => {
                        if let Err(why) = node.resume(saved) {
                            node.memory_lost(lost(format!("{why:?}")));
                        }
                    }
                }
                node.memory_written(Ok(()), None);
                latest = Shared::of(node);
                Box::new(latest.clone())
            }),
        );
        first
    }
}
