//! The tree's actions and conditions. A new one is a file here and a line in [`registry`].

use std::sync::Arc;

use behavior_tree::{Cause, LeafClass, Port, Ports, Registry};
use domain::contingency::{Contingencies, Row};

use crate::world::World;

mod act;
mod ask_ahead;
mod avoid;
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
mod skill_run;
mod transition;

use fly_to::{Destination, FlyTo};
use ports::{Ahead, Condition, Goal, Needs};

/// Every kind of leaf that the tree files may use. Without a table the trees can be read but not flown.
pub(crate) fn registry(table: Option<&Contingencies>) -> Registry<World> {
    let mut registry = Registry::new();
    registry.action("Monitor", [], |_| Ok(monitor::Monitor));
    registry.condition("MissionNotOver", [], check::mission_not_over);
    registry.condition("NoErrors", [], check::no_errors);
    registry.condition("PrecondCheck", [Port::input::<Condition>("condition")], check::precondition);
    registry.condition("InvCheck", [Port::input::<Condition>("condition")], check::invariant);
    registry.action("NominalExecutor", [], |_| Ok(executor::NominalExecutor::default()));
    registry.action("NextStep", [], |_| Ok(next_step::NextStep));
    registry.action("Replan", [], |_| Ok(replan::Replan));
    registry.action("TransitionExecutor", [], |_| Ok(transition::TransitionExecutor::default()));
    registry.sync_action("RaiseTransitionFailed", [], transition::raise_transition_failed);
    registry.action("EndMission", [], |_| Ok(end_mission::EndMission::default()));
    registry.action("Act", [Port::input::<Goal>("goal").describe("what to fly")], act::Act::with_port);
    registry.action("Land", [], |_| Ok(act::Act::fixed(domain::skill::Goal::Land)));
    registry.action("Stop", [], |_| Ok(act::Act::fixed(domain::skill::Goal::Stop)));
    registry.action("HoldPosition", [], |_| Ok(act::Act::hold_position()));
    registry.action("Avoid", [], |_| Ok(avoid::Avoid::default()));
    registry.action("Climb", [], |_| Ok(act::Act::climb()));
    registry.action("FlyHome", [], |_| Ok(FlyTo::new(Destination::Home)));
    registry.action("FlyToLandingSite", [], |_| Ok(FlyTo::new(Destination::LandingSite)));
    registry.action("FlyToAlternateSite", [], |_| Ok(FlyTo::new(Destination::AlternateSite)));
    registry.action("FlyToBestSite", [], |_| Ok(FlyTo::new(Destination::BestSite)));
    registry.action("FlyToDitch", [], |_| Ok(FlyTo::new(Destination::Ditch)));
    registry.action("FlyToFreeGround", [], |_| Ok(FlyTo::new(Destination::FreeGround)));
    registry.condition("MayLandHere", [], check::may_land_here);
    registry.action("LeaveArea", [], |_| Ok(FlyTo::new(Destination::OutOfArea)));
    let needs = Port::input::<Needs>("permissions").describe("what to ask for");
    registry.action("RequestPermissions", [needs], permission::RequestPermissions::new);
    let ahead = Port::input::<Ahead>("permissions").describe("what to ask for because later steps need it, and when");
    registry.action("AskAhead", [ahead], ask_ahead::AskAhead::new);
    registry.action("WayIsClear", [], |_| Ok(permission::WayIsClear));
    let flag = || [Port::input::<String>("flag").describe("the flag of the row")];
    let rows = table.map(|it| Arc::<[Row]>::from(it.rows()));
    let of = rows.clone();
    registry.condition_with("Responds", flag(), move |spec| contingency::Responds::new(spec, of.as_deref()));
    let (of, group) = (rows.clone(), [Port::input::<String>("group")]);
    registry.condition_with("GroupResponds", group, move |spec| contingency::GroupResponds::new(spec, of.as_deref()));
    let (of, act) = (rows.clone(), LeafClass::SyncAction);
    registry.leaf(act, "BeginResponse", flag(), move |spec| contingency::BeginResponse::new(spec, of.as_deref()));
    let action = || [Port::input::<i64>("action").describe("its place in the row, from 0")];
    registry.action("AwaitTry", action(), contingency::AwaitTry::new);
    registry.condition_with("IsPossible", action(), contingency::IsPossible::new);
    registry.leaf(act, "TryFailed", [], |_| Ok(contingency::TryFailed));
    registry.action("ResetFlag", flag(), move |spec| contingency::ResetFlag::new(spec, rows.as_deref()));
    registry
}

/// The reason that the engine recorded for the last failure.
fn why(ports: &Ports<'_>) -> String {
    ports.last_failure().map_or_else(|| "no leaf said why".to_owned(), Cause::to_string)
}
