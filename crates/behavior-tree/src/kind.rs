//! What a node is, with its parameters.

use crate::status::Status;

/// A whole number that a node takes from an attribute: written there, or read from a key at every tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Param {
    Constant(i32),
    Slot(u32),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    Sequence {
        interruptible: bool,
    },
    SequenceWithMemory,
    ReactiveSequence,
    Fallback {
        interruptible: bool,
    },
    ReactiveFallback,
    Parallel {
        success: Param,
        failure: Param,
    },
    ParallelAll {
        max_failures: Param,
    },
    IfThenElse,
    WhileDoElse,
    /// Index into [`Shape::switches`](crate::shape::Shape).
    Switch(u32),
    Inverter,
    ForceSuccess,
    ForceFailure,
    KeepRunningUntilFailure,
    RetryUntilSuccessful(Param),
    Repeat(Param),
    RunOnce {
        then_skip: Param,
    },
    Timeout(Param),
    Delay(Param),
    SubTree,
    SuccessIsRunning,
    /// Index into [`Shape::leaves`](crate::shape::Shape).
    Leaf(u32),
    AlwaysSuccess,
    AlwaysFailure,
    Sleep(Param),
    /// Index into [`Shape::scripts`](crate::shape::Shape).
    Script(u32),
    /// Index into [`Shape::scripts`](crate::shape::Shape).
    ScriptCondition(u32),
    Precondition {
        /// Index into [`Shape::scripts`](crate::shape::Shape).
        script: u32,
        otherwise: Status,
    },
}

impl Kind {
    /// True for nodes with exactly one child, whose status they reset as soon as it has finished.
    pub(crate) const fn is_decorator(self) -> bool {
        matches!(
            self,
            Kind::Inverter
                | Kind::ForceSuccess
                | Kind::ForceFailure
                | Kind::KeepRunningUntilFailure
                | Kind::RetryUntilSuccessful(_)
                | Kind::Repeat(_)
                | Kind::RunOnce { .. }
                | Kind::Timeout(_)
                | Kind::Delay(_)
                | Kind::SubTree
                | Kind::SuccessIsRunning
                | Kind::Precondition { .. }
        )
    }
}

/// What a node remembers between ticks; what the numbers mean is each kind's own business.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct NodeState {
    pub(crate) cursor: u32,
    pub(crate) count: u32,
    pub(crate) time: u64,
}
