//! The leaves of the contingency rows.

use behavior_tree::{BuildError, In, Leaf, LeafError, LeafResult, NodeSpec, Ports, Status};
use domain::contingency::{Clears, Row, Then};
use kittiwake_proto::v1::MissionOutcome;

use crate::world::{Decision, World};

/// Whether a row's flag is up.
pub(super) struct FlagRaised(usize);

impl FlagRaised {
    pub(super) fn new(spec: &NodeSpec<'_>, table: Option<&[Row]>) -> Result<FlagRaised, BuildError> {
        Ok(FlagRaised(row(spec, table)?))
    }
}

impl Leaf<World> for FlagRaised {
    fn tick(&mut self, world: &mut World, _: &mut Ports<'_>) -> LeafResult {
        Ok(if world.flags.row_is_up(self.0) { Status::Success } else { Status::Failure })
    }
}

/// A group is up while one of its flags is, so a quiet group costs one look.
pub(super) struct GroupRaised(Vec<usize>);

impl GroupRaised {
    pub(super) fn new(spec: &NodeSpec<'_>, table: Option<&[Row]>) -> Result<GroupRaised, BuildError> {
        let group = spec.constant::<String>("group")?;
        let members = table.into_iter().flatten().enumerate().filter(|(_, it)| it.group == group);
        Ok(GroupRaised(members.map(|(row, _)| row).collect()))
    }
}

impl Leaf<World> for GroupRaised {
    fn tick(&mut self, world: &mut World, _: &mut Ports<'_>) -> LeafResult {
        let raised = self.0.iter().any(|row| world.flags.row_is_up(*row));
        Ok(if raised { Status::Success } else { Status::Failure })
    }
}

/// Says which row responds from here on.
pub(super) struct BeginResponse(usize);

impl BeginResponse {
    pub(super) fn new(spec: &NodeSpec<'_>, table: Option<&[Row]>) -> Result<BeginResponse, BuildError> {
        Ok(BeginResponse(row(spec, table)?))
    }
}

impl Leaf<World> for BeginResponse {
    fn tick(&mut self, world: &mut World, _: &mut Ports<'_>) -> LeafResult {
        world.acting = Some(world.flags.name(self.0).clone());
        world.decided(Decision::Responding(self.0));
        Ok(Status::Success)
    }
}

/// The number of the row that the node is about, found once and not at every tick. Without a table only the
/// ids of the trees are asked for.
fn row(spec: &NodeSpec<'_>, table: Option<&[Row]>) -> Result<usize, BuildError> {
    let flag = spec.constant::<String>("flag")?.unwrap_or_default();
    let Some(table) = table else { return Ok(0) };
    let row = table.iter().position(|it| it.flag == flag);
    row.ok_or_else(|| BuildError::new(format!("`{flag}` has no row in the contingency table")))
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
            Clears::Never => (!flag.holds() && row.raise.is_none()) || world.is_on_ground(),
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
