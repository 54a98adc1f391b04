//! The two kinds of status: what a node answers, and what an observer sees.

/// What a node answers when it is ticked.
///
/// There is no `Idle`: a node that has been ticked has an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Status {
    /// Not finished; tick again.
    Running = 1,
    /// Finished, the goal is reached or the condition holds.
    Success = 2,
    /// Finished, the goal is out of reach or the condition does not hold.
    Failure = 3,
    /// Did not take part: the parent goes on as if the node were not there.
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
/// A skipped node keeps the status it had, so there is no `Skipped` here. The numbers are those of BehaviorTree.CPP, so
/// that a snapshot can be handed to its tools as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum NodeStatus {
    /// Not ticked since its parent last reset it.
    #[default]
    Idle = 0,
    /// Ticked and not finished.
    Running = 1,
    /// Finished, and its parent has not reset it yet.
    Success = 2,
    /// Finished, and its parent has not reset it yet.
    Failure = 3,
}

impl NodeStatus {
    /// True for [`NodeStatus::Success`] and [`NodeStatus::Failure`].
    pub const fn is_completed(self) -> bool {
        matches!(self, NodeStatus::Success | NodeStatus::Failure)
    }

    /// The word used in dumps: `idle`, `running`, `success` or `failure`.
    pub const fn word(self) -> &'static str {
        match self {
            NodeStatus::Idle => "idle",
            NodeStatus::Running => "running",
            NodeStatus::Success => "success",
            NodeStatus::Failure => "failure",
        }
    }
}

impl std::fmt::Display for NodeStatus {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.word())
    }
}

impl std::fmt::Display for Status {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Status::Running => "running",
            Status::Success => "success",
            Status::Failure => "failure",
            Status::Skipped => "skipped",
        })
    }
}
