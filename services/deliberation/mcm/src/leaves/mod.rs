//! The tree's actions and conditions. A new one is a file here and a line in [`registry`].

use std::sync::Arc;

use behavior_tree::{LeafClass, Port, Registry};
use domain::contingency::{Contingencies, Row};

use crate::world::World;

mod act;
mod check;
mod contingency;
mod end_mission;
mod executor;
mod fly_to;
mod monitor;
mod next_step;
mod permission;
pub(crate) mod ports;
mod replan;
mod transition;

use fly_to::{Destination, FlyTo};
use ports::{Condition, Goal};

/// Every kind of leaf that the tree files may use. Without a table the trees can be read, and not flown.
pub(crate) fn registry(table: Option<&Contingencies>) -> Registry<World> {
    let mut it = Registry::new();
    it.action("Monitor", [], |_| Ok(monitor::Monitor));
    it.condition("MissionNotOver", [], check::mission_not_over);
    it.condition("NoErrors", [], check::no_errors);
    it.condition("PrecondCheck", [Port::input::<Condition>("condition")], check::precondition);
    it.condition("InvCheck", [Port::input::<Condition>("condition")], check::invariant);
    it.action("NominalExecutor", [], |_| Ok(executor::NominalExecutor::default()));
    it.action("NextStep", [], |_| Ok(next_step::NextStep::default()));
    it.action("Replan", [], |_| Ok(replan::Replan));
    it.action("TransitionExecutor", [], |_| Ok(transition::TransitionExecutor::default()));
    it.sync_action("RaiseTransitionFailed", [], transition::raise_transition_failed);
    it.action("EndMission", [], |_| Ok(end_mission::EndMission::default()));
    it.action("Act", [Port::input::<Goal>("goal").describe("what to fly")], act::Act::with_port);
    it.action("Land", [], |_| Ok(act::Act::fixed(domain::skill::Goal::Land)));
    it.action("Stop", [], |_| Ok(act::Act::fixed(domain::skill::Goal::Stop)));
    it.action("FlyHome", [], |_| Ok(FlyTo::new(Destination::Home)));
    it.action("FlyToLandingSite", [], |_| Ok(FlyTo::new(Destination::LandingSite)));
    it.action("RequestPermission", [Port::input::<String>("area")], permission::RequestPermission::new);
    it.action("WayIsClear", [], |_| Ok(permission::WayIsClear));
    let flag = || [Port::input::<String>("flag").describe("the flag of the row")];
    let (rows, condition) = (table.map(|it| Arc::<[Row]>::from(it.rows())), LeafClass::Condition);
    let of = rows.clone();
    it.leaf(condition, "FlagRaised", flag(), move |spec| contingency::FlagRaised::new(spec, of.as_deref()));
    let (of, group) = (rows.clone(), [Port::input::<String>("group")]);
    it.leaf(condition, "GroupRaised", group, move |spec| contingency::GroupRaised::new(spec, of.as_deref()));
    let act = LeafClass::SyncAction;
    it.leaf(act, "BeginResponse", flag(), move |spec| contingency::BeginResponse::new(spec, rows.as_deref()));
    it.action("ResetFlag", flag(), contingency::ResetFlag::new);
    it.sync_action("MissionOver", flag(), contingency::mission_over);
    it
}
