//! What travels through the tree's ports.

use behavior_tree::Object;
use kittiwake_proto::v1;

/// What to fly.
#[derive(Debug, Clone)]
pub(crate) struct Goal(pub(crate) domain::skill::Goal);

impl Object for Goal {
    const NAME: &'static str = "Goal";
}

/// A precondition or an invariant.
#[derive(Debug, Clone)]
pub(crate) struct Condition(pub(crate) v1::Condition);

impl Object for Condition {
    const NAME: &'static str = "Condition";
}
