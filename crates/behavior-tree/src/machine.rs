//! A tree as it stands between two ticks, and the leaves in it.

use std::sync::Arc;

use crate::board::Board;
use crate::kind::NodeState;
use crate::leaf::ports::Ports;
use crate::record::changes::ChangeRecorder;
use crate::record::error::NodeErrors;
use crate::record::failures::Failures;
use crate::shape::Shape;
use crate::status::{NodeStatus, Status};

/// An error of a leaf. Every error type and text converts into it.
pub type LeafError = Box<dyn std::error::Error + Send + Sync>;

/// What a leaf returns. An error fails the node and is recorded, see [`Tree::errors`].
pub type LeafResult = Result<Status, LeafError>;

/// An action or condition that the user of the engine writes.
///
/// `Ctx` is the user's world: what the leaves read, and the commands that they collect for after the tick. A leaf never
/// waits: one that needs time returns [`Status::Running`] and is ticked again.
pub trait Leaf<Ctx>: Send {
    /// The first tick after the node was idle. Does the same as [`Leaf::tick`] unless it is implemented.
    fn start(&mut self, ctx: &mut Ctx, ports: &mut Ports<'_>) -> LeafResult {
        self.tick(ctx, ports)
    }

    /// A tick while the node is running, and the first one unless [`Leaf::start`] is implemented.
    fn tick(&mut self, ctx: &mut Ctx, ports: &mut Ports<'_>) -> LeafResult;

    /// The tree abandons this node while it is running: stop what was started. Also called after the leaf returned an
    /// error or panicked.
    fn halt(&mut self, ctx: &mut Ctx, ports: &mut Ports<'_>) {
        let (_, _) = (ctx, ports);
    }

    /// The tree that this leaf holds and passes its ticks to. Printed trees show it below the leaf.
    fn subtree(&self) -> Option<&Tree<Ctx>> {
        None
    }
}

/// One instance of a tree, made by [`Template::instantiate`](crate::Template::instantiate).
///
/// A tree reads no clock and waits for nothing: time and the world come in with every tick.
pub struct Tree<Ctx> {
    pub(crate) shape: Arc<Shape>,
    pub(crate) machine: Machine<Ctx>,
}

/// The mutable part of a tree.
pub(crate) struct Machine<Ctx> {
    pub(crate) status: Vec<NodeStatus>,
    pub(crate) state: Vec<NodeState>,
    pub(crate) leaves: Vec<Box<dyn Leaf<Ctx>>>,
    pub(crate) board: Board,
    /// `None` unless changes are recorded.
    pub(crate) changes: Option<ChangeRecorder>,
    pub(crate) failures: Failures,
    pub(crate) errors: NodeErrors,
}

impl<Ctx> Machine<Ctx> {
    /// All of `nodes` nodes are idle.
    pub(crate) fn new(nodes: usize, leaves: Vec<Box<dyn Leaf<Ctx>>>, board: Board) -> Self {
        Machine {
            status: vec![NodeStatus::Idle; nodes],
            state: vec![NodeState::default(); nodes],
            leaves,
            board,
            changes: None,
            failures: Failures::default(),
            errors: NodeErrors::default(),
        }
    }
}
