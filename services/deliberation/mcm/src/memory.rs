//! What outlives the manager's process: what was ordered, which flags are up, and whether the mission is over, so that
//! nothing that was ended begins again because a process did.
//!
//! The step and the skill are not kept: the manager asks for a plan from where the vehicle is by then. Who keeps the memory,
//! and where, is none of the manager's business.

use domain::geometry::Ned;
use domain::wire::Senseless;
use kittiwake_proto::v1;

use crate::operator;
use crate::world::{MONITOR, Over, SELF, World};

/// Why a memory is of no use.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Useless {
    /// The manager was started with another mission since: that one is meant.
    #[error("it is of another mission file, and that is what counts")]
    OfAnotherMission,
    /// Something in it is none of ours.
    #[error(transparent)]
    Senseless(#[from] Senseless),
}

/// What the manager of `world`, which was started with `configured`, remembers.
pub(crate) fn memory(world: &World, configured: &str) -> v1::McmMemory {
    let flag = |(name, it): (&str, &crate::flags::Flag)| v1::RememberedFlag {
        name: name.to_owned(),
        reason: it.reason.clone(),
        sources: it.sources().map(str::to_owned).collect(),
        acknowledged_by: it.acknowledged_by.clone().unwrap_or_default(),
    };
    let over = world.mission.over.clone();
    v1::McmMemory {
        configured: configured.to_owned(),
        started: world.operator.has_started,
        flags: world.flags.iter().map(flag).collect(),
        landing_site: world.operator.landing_site.map(Into::into),
        outcome: over.as_ref().map_or(v1::MissionOutcome::Unspecified, |it| it.outcome).into(),
        reason: over.map(|it| it.reason).unwrap_or_default(),
        report: world.mission.report.clone(),
    }
}

/// Has the manager of `world`, which was started with `configured` and has done nothing, go on where `memory` ends.
///
/// # Errors
/// Why the memory is of no use; nothing is changed then.
pub(crate) fn resume(world: &mut World, configured: &str, memory: v1::McmMemory) -> Result<(), Useless> {
    if memory.configured != configured {
        return Err(Useless::OfAnotherMission);
    }
    let landing_site = memory.landing_site.map(Ned::try_from).transpose()?;
    let outcome = memory.outcome();
    (world.operator.has_started, world.operator.landing_site) = (memory.started, landing_site);
    if outcome != v1::MissionOutcome::Unspecified {
        world.mission.over = Some(Over { outcome, reason: memory.reason });
        world.mission.report = memory.report;
    }
    for flag in memory.flags {
        restore(world, flag);
    }
    Ok(())
}

/// What the monitor said of it, and what was injected, shows in the next introspection, or its being gone does.
fn restore(world: &mut World, mut flag: v1::RememberedFlag) {
    let Some(row) = world.flags.number(&flag.name) else {
        return world
            .say("contingency", format!("flag `{}` has no row in the table any more: not acted on", flag.name));
    };
    let own = |it: &String| [operator::SOURCE, SELF].contains(&it.as_str());
    if flag.sources.iter().any(|it| !own(it)) {
        flag.sources.retain(own);
        flag.sources.push(MONITOR.to_owned());
        world.inbox.expect(&flag.name);
    }
    world.say("contingency", format!("flag `{}` is up since before the mission manager was started again", flag.name));
    world.flags.restore(world.now.time, row, flag);
}
