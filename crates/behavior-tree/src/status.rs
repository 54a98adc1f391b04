//! The two kinds of status: what a tick returns, and what an observer sees.

use std::fmt;

/// What a node returns when it is ticked.
///
/// There is no `Idle`: an idle node has not been ticked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Status {
    /// Not finished; tick the node again.
    Running = 1,
    /// Finished: the goal is reached, or the condition holds.
    Success = 2,
    /// Finished: the goal cannot be reached, or the condition does not hold.
    Failure = 3,
    /// The node did not take part. Its parent goes on as if the node were not there.
    Skipped = 4,
}

impl Status {
    /// True for [`Status::Success`] and [`Status::Failure`].
    pub const fn is_completed(self) -> bool {
        matches!(self, Status::Success | Status::Failure)
    }

    /// [`Status::Success`] if `holds`, else [`Status::Failure`].
    pub const fn from_bool(holds: bool) -> Self {
        if holds { Status::Success } else { Status::Failure }
    }
}

/// What an observer sees of a node between two ticks.
///
/// A skipped node keeps its status, so there is no `Skipped` here. The numbers are those of BehaviorTree.CPP, so that
/// its tools understand a copy of the statuses as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum NodeStatus {
    /// Not ticked since its parent last reset it.
    #[default]
    Idle = 0,
    /// Ticked and not finished.
    Running = 1,
    /// Finished with success. Its parent has not reset it yet.
    Success = 2,
    /// Finished with failure. Its parent has not reset it yet.
    Failure = 3,
}

impl NodeStatus {
    /// True for [`NodeStatus::Success`] and [`NodeStatus::Failure`].
    pub const fn is_completed(self) -> bool {
        matches!(self, NodeStatus::Success | NodeStatus::Failure)
    }

    /// The lower-case word for it: `idle`, `running`, `success` or `failure`.
    pub const fn word(self) -> &'static str {
        match self {
            NodeStatus::Idle => "idle",
            NodeStatus::Running => "running",
            NodeStatus::Success => "success",
            NodeStatus::Failure => "failure",
        }
    }
}

impl fmt::Display for NodeStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Status::Running => "running",
            Status::Success => "success",
            Status::Failure => "failure",
            Status::Skipped => "skipped",
        })
    }
}
