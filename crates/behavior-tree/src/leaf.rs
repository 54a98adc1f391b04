//! Actions and conditions: the nodes the user writes.

use crate::ports::Ports;
use crate::status::Status;
use crate::tree::Tree;

/// What goes wrong in a leaf. Anything that is an error converts, text included.
pub type LeafError = Box<dyn std::error::Error + Send + Sync>;

/// A leaf's answer. An error fails the node and is reported, see [`Tree::faults`].
pub type LeafResult = Result<Status, LeafError>;

/// An action or condition written by the user.
///
/// `Ctx` is the user's world: inputs, and the effects to be sent after the tick. A leaf never waits: what takes time
/// answers [`Status::Running`] and is ticked again.
pub trait Leaf<Ctx>: Send {
    /// The first tick after the node was idle. Does the same as [`Leaf::tick`] unless the two are told apart.
    fn start(&mut self, ctx: &mut Ctx, ports: &mut Ports<'_>) -> LeafResult {
        self.tick(ctx, ports)
    }

    /// A tick while the node is running (and the first one, unless [`Leaf::start`] is written).
    fn tick(&mut self, ctx: &mut Ctx, ports: &mut Ports<'_>) -> LeafResult;

    /// The tree abandons this node while it is running: give up what was started. Also called after the leaf itself
    /// returned an error or panicked.
    fn halt(&mut self, ctx: &mut Ctx, ports: &mut Ports<'_>) {
        let (_, _) = (ctx, ports);
    }

    /// The tree this leaf holds and passes its ticks to, if it does: dumps then show it under the leaf.
    fn subtree(&self) -> Option<&Tree<Ctx>> {
        None
    }
}

impl<Ctx, L: Leaf<Ctx> + ?Sized> Leaf<Ctx> for Box<L> {
    fn start(&mut self, ctx: &mut Ctx, ports: &mut Ports<'_>) -> LeafResult {
        (**self).start(ctx, ports)
    }

    fn tick(&mut self, ctx: &mut Ctx, ports: &mut Ports<'_>) -> LeafResult {
        (**self).tick(ctx, ports)
    }

    fn halt(&mut self, ctx: &mut Ctx, ports: &mut Ports<'_>) {
        (**self).halt(ctx, ports);
    }

    fn subtree(&self) -> Option<&Tree<Ctx>> {
        (**self).subtree()
    }
}

/// A closure that answers at once.
pub(crate) struct Answer<F>(pub(crate) std::sync::Arc<F>);

impl<Ctx, F> Leaf<Ctx> for Answer<F>
where
    F: Fn(&mut Ctx, &mut Ports<'_>) -> Result<bool, LeafError> + Send + Sync,
{
    fn tick(&mut self, ctx: &mut Ctx, ports: &mut Ports<'_>) -> LeafResult {
        (self.0)(ctx, ports).map(Status::from_bool)
    }
}
