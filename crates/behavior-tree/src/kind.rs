//! The table of node kinds.

use crate::status::Status;

/// Passes the table to another macro. A row is a kind of node, its parameters, and its file in `nodes/`.
macro_rules! with_node_kinds {
    ($callback:ident) => {
        $callback! {
            Sequence { interruptible: bool } in sequence;
            SequenceWithMemory in sequence_with_memory;
            ReactiveSequence in reactive_sequence;
            Fallback { interruptible: bool } in fallback;
            ReactiveFallback in reactive_fallback;
            Parallel { success: Param, failure: Param } in parallel;
            ParallelAll { max_failures: Param } in parallel_all;
            IfThenElse in if_then_else;
            WhileDoElse in while_do_else;
            Switch { table: u32 } in switch;
            Inverter in inverter;
            ForceSuccess in force_success;
            ForceFailure in force_failure;
            KeepRunningUntilFailure in keep_running_until_failure;
            SuccessIsRunning in success_is_running;
            RetryUntilSuccessful { attempts: Param } in retry_until_successful;
            Repeat { cycles: Param } in repeat;
            RunOnce { then_skip: Param } in run_once;
            Timeout { limit: Param } in timeout;
            Delay { delay: Param } in delay;
            Precondition { script: u32, otherwise: Status } in precondition;
            SubTree in sub_tree;
            AlwaysSuccess in always_success;
            AlwaysFailure in always_failure;
            Sleep { duration: Param } in sleep;
            Script { script: u32 } in script;
            ScriptCondition { script: u32 } in script_condition;
            Leaf { leaf: u32 } in leaf;
        }
    };
}

pub(crate) use with_node_kinds;

macro_rules! define_kind {
    ($($kind:ident $({ $($param:ident: $ty:ty),* })? in $file:ident;)*) => {
        /// What a node is, with its parameters. `script`, `leaf` and `table` are indices into the lists of
        /// [`Shape`](crate::shape::Shape).
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub(crate) enum Kind {
            $($kind $({ $($param: $ty),* })?),*
        }
    };
}

with_node_kinds!(define_kind);

/// An integer that a node takes from an attribute: written there, or read from a key at every tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Param {
    Constant(i32),
    Slot(u32),
}

/// What a node remembers between ticks. What the numbers mean is up to the kind of node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct NodeState {
    pub(crate) cursor: u32,
    pub(crate) count: u32,
    /// A time in nanoseconds, or the node that decided a failure.
    pub(crate) memo: u64,
}
