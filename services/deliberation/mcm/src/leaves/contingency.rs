//! The leaves of the contingency rows.

use behavior_tree::{BuildError, Condition, Leaf, LeafError, LeafResult, NodeSpec, Ports, Status};
use domain::contingency::Row;
use domain::contingency::group::Group;

use super::{unless, why};
use crate::world::{Reset, World};

pub(super) struct Responds {
    pub(super) row: usize,
    pub(super) has_begun: bool,
}

impl Condition<World> for Responds {
    fn holds(&mut self, world: &World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
        if world.responder() != Some(self.row) {
            self.has_begun = false;
            return Ok(false);
        }
        if self.has_begun && !world.is_under_way(self.row) && !world.has_rested() {
            // The flag fell and has risen again since the last tick: its response starts again.
            self.has_begun = false;
            ports.tick_again();
            return Ok(false);
        }
        self.has_begun = true;
        Ok(true)
    }
}

/// Whether one of a group's rows is the one that responds, so that a group without a flag costs one check.
pub(super) struct GroupResponds(Vec<usize>);

impl GroupResponds {
    pub(super) fn new(spec: &NodeSpec<'_>, table: Option<&[Row]>) -> Result<GroupResponds, BuildError> {
        let group = spec.constant::<String>("group")?.as_deref().and_then(Group::named);
        let members = table.into_iter().flatten().enumerate().filter(|(_, it)| it.group == group);
        Ok(GroupResponds(members.map(|(row, _)| row).collect()))
    }
}

impl Condition<World> for GroupResponds {
    fn holds(&mut self, world: &World, _: &mut Ports<'_>) -> Result<bool, LeafError> {
        Ok(world.responder().is_some_and(|row| self.0.contains(&row)))
    }
}

/// Records that its row responds from here on.
pub(super) struct BeginResponse(pub(super) usize);

impl Leaf<World> for BeginResponse {
    fn tick(&mut self, world: &mut World, _: &mut Ports<'_>) -> LeafResult {
        world.begin_response(self.0);
        Ok(Status::Success)
    }
}

/// The place in its row of the action that a node is about.
fn action(ports: &Ports<'_>) -> Result<usize, LeafError> {
    Ok(ports.get::<i64>("action")? as usize)
}

/// Waits until the next try of an action may begin: the first one at once, further ones after growing pauses.
pub(super) struct AwaitTry;

impl Leaf<World> for AwaitTry {
    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let not_before = world.await_try(action(ports)?);
        if world.now() < not_before {
            ports.tick_at(not_before.since_start());
            return Ok(Status::Running);
        }
        Ok(Status::Success)
    }
}

/// Whether an action of the response can be flown now; if not, says what it lacks.
pub(super) fn is_possible(world: &World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    unless(world.why_impossible(action(ports)?), ports)
}

/// Records that the try of an action failed, and fails.
pub(super) fn try_failed(world: &mut World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    world.try_failed(&why(ports));
    ports.tick_again();
    Ok(false)
}

/// Takes the flag down as its row says, and holds until then.
pub(super) struct ResetFlag(pub(super) usize);

impl Leaf<World> for ResetFlag {
    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        match world.reset_flag(self.0) {
            Reset::Awaited => Ok(Status::Running),
            Reset::Down => {
                ports.tick_again();
                Ok(Status::Success)
            }
            Reset::StillInAir => {
                ports.explain("the vehicle was to come down and is in the air");
                world.try_failed(&why(ports));
                Ok(Status::Failure)
            }
        }
    }
}

/// The number of the row in the node's port, looked up once. Without a table the trees are only read for their ids.
pub(super) fn row(spec: &NodeSpec<'_>, table: Option<&[Row]>) -> Result<usize, BuildError> {
    let flag = spec.constant::<String>("flag")?.unwrap_or_default();
    let Some(table) = table else { return Ok(0) };
    let row = table.iter().position(|it| it.flag == flag);
    row.ok_or_else(|| BuildError::new(format!("`{flag}` has no row in the contingency table")))
}
