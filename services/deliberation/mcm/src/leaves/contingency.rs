//! The leaves of the contingency rows.

use std::sync::Arc;

use behavior_tree::{BuildError, In, Leaf, LeafError, LeafResult, NodeSpec, Ports, Status};
use domain::contingency::{Clears, Then};
use kittiwake_proto::v1::MissionOutcome;

use crate::world::World;

pub(super) fn flag_raised(world: &mut World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    // Shared, not copied: every row asks at every tick while a flag is up.
    let flag: Arc<str> = ports.get("flag")?;
    Ok(world.flags.is_up(&flag))
}

/// A group is up while one of its flags is, so a quiet group costs one look.
pub(super) fn group_raised(world: &mut World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    let group: Arc<str> = ports.get("group")?;
    let mut groups = world.flags.iter().filter_map(|(flag, _)| world.table.row(flag)?.group.as_deref());
    Ok(groups.any(|it| it == &*group))
}

/// Says which row responds from here on.
pub(super) fn begin_response(world: &mut World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    let flag: String = ports.get("flag")?;
    let actions = world.table.row(&flag).map(|it| it.actions.join(", else ")).unwrap_or_default();
    world.say("contingency", format!("`{flag}`: {actions}"));
    world.acting = Some(flag);
    Ok(true)
}

/// The emergency action failed: nothing starts again after this.
pub(super) fn mission_over(world: &mut World, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    let flag: String = ports.get("flag")?;
    let reason = format!("`{flag}`: the emergency action failed: {}", world.failure.reason);
    world.say("contingency", reason.clone());
    world.end_mission(MissionOutcome::Emergency, reason);
    world.flags.lower(&flag);
    ports.tick_again();
    Ok(false)
}

/// Takes the flag down as its row says, holding until then.
pub(super) struct ResetFlag {
    flag: In<String>,
}

impl ResetFlag {
    pub(super) fn new(spec: &NodeSpec<'_>) -> Result<ResetFlag, BuildError> {
        Ok(ResetFlag { flag: spec.input("flag")? })
    }
}

impl Leaf<World> for ResetFlag {
    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let name = ports.read(self.flag)?;
        let (Some(row), Some(flag)) = (world.table.row(&name), world.flags.get(&name)) else {
            return Ok(Status::Success);
        };
        let may_fall = match row.clears {
            Clears::AfterAction => true,
            Clears::WithCondition => !flag.holds(),
            Clears::Never => (!flag.holds() && row.raise.is_none()) || !world.is_flying(),
        };
        if !may_fall {
            return Ok(Status::Running);
        }
        let ends = row.then == Then::EndMission;
        let reason = format!("`{name}`: {}", flag.reason);
        world.flags.lower(&name);
        if ends {
            world.end_mission(MissionOutcome::Emergency, reason);
        }
        world.say("contingency", format!("`{name}` is over"));
        ports.tick_again();
        Ok(Status::Success)
    }
}
