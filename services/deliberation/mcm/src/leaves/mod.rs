//! The tree's actions and conditions. A new one is a file here and a line in [`registry`].

use std::sync::Arc;

use behavior_tree::{Cause, LeafClass, LeafError, NodeSpec, Port, Ports, Registry};
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
mod permission;
pub(crate) mod ports;
mod replan;
mod skill_run;
mod take_in_news;
mod transition;

use act::{Act, What};
use ask_ahead::AskAhead;
use contingency::{AwaitTry, BeginResponse, GroupResponds, ResetFlag, Responds};
use fly_to::{Destination, FlyTo};
use permission::{RequestPermissions, WayIsClear};
use ports::{Ahead, Condition, Goal, Needs};

/// Every kind of leaf that the tree files may use. Without a table the trees can be read but not flown.
pub(crate) fn registry(table: Option<&Contingencies>) -> Registry<World> {
    let mut registry = Registry::new();
    // These tags are in the trees of recorded flights, which are replayed: the types say what they do.
    registry.action("Monitor", [], |_| Ok(take_in_news::TakeInNews));
    registry.condition("NoErrors", [], check::no_flag_answered);
    registry.condition("MissionNotOver", [], check::mission_not_over);
    registry.condition("PrecondCheck", [Port::input::<Condition>("condition")], check::precondition);
    registry.condition("InvCheck", [Port::input::<Condition>("condition")], check::invariant);
    registry.action("NominalExecutor", [], |_| Ok(executor::NominalExecutor::default()));
    registry.sync_action("NextStep", [], executor::next_step);
    registry.action("Replan", [], |_| Ok(replan::Replan));
    registry.action("TransitionExecutor", [], |_| Ok(transition::TransitionExecutor::default()));
    registry.sync_action("RaiseTransitionFailed", [], transition::raise_transition_failed);
    registry.action("EndMission", [], |_| Ok(end_mission::EndMission::default()));
    registry.action("Act", [Port::input::<Goal>("goal").describe("what to fly")], |spec| {
        Ok(Act::new(What::Port(spec.input("goal")?)))
    });
    registry.action("Land", [], |_| Ok(Act::new(What::Fixed(domain::skill::Goal::Land))));
    registry.action("Stop", [], |_| Ok(Act::new(What::Fixed(domain::skill::Goal::Stop))));
    registry.action("HoldPosition", [], |_| Ok(Act::new(What::HoldPosition)));
    registry.action("Avoid", [], |_| Ok(avoid::Avoid::default()));
    registry.action("Climb", [], |_| Ok(Act::new(What::Climb)));
    registry.action("FlyHome", [], |_| Ok(FlyTo::new(Destination::Home)));
    registry.action("FlyToLandingSite", [], |_| Ok(FlyTo::new(Destination::LandingSite)));
    registry.action("FlyToAlternateSite", [], |_| Ok(FlyTo::new(Destination::AlternateSite)));
    registry.action("FlyToBestSite", [], |_| Ok(FlyTo::new(Destination::BestSite)));
    registry.action("FlyToDitch", [], |_| Ok(FlyTo::new(Destination::Ditch)));
    registry.action("FlyToFreeGround", [], |_| Ok(FlyTo::new(Destination::FreeGround)));
    registry.condition("MayLandHere", [], check::may_land_here);
    registry.condition("LandingIsAtStake", [], check::landing_is_at_stake);
    registry.action("LeaveArea", [], |_| Ok(FlyTo::new(Destination::OutOfArea)));
    let needs = Port::input::<Needs>("permissions").describe("what to ask for");
    registry.action("RequestPermissions", [needs], |spec| Ok(RequestPermissions { needs: spec.input("permissions")? }));
    let ahead = Port::input::<Ahead>("permissions").describe("what to ask for because later steps need it, and when");
    registry
        .action("AskAhead", [ahead], |spec| Ok(AskAhead { permissions: spec.input("permissions")?, open: Vec::new() }));
    registry.action("WayIsClear", [], |_| Ok(WayIsClear));
    let flag = || [Port::input::<String>("flag").describe("the flag of the row")];
    let rows = table.map(|it| Arc::<[Row]>::from(it.rows()));
    let of = rows.clone();
    let row = move |spec: &NodeSpec<'_>| contingency::row(spec, of.as_deref());
    let (responds, begins) = (row.clone(), row.clone());
    registry.condition_with("Responds", flag(), move |spec| Ok(Responds { row: responds(spec)?, has_begun: false }));
    let group = [Port::input::<String>("group")];
    registry.condition_with("GroupResponds", group, move |spec| GroupResponds::new(spec, rows.as_deref()));
    registry.leaf(LeafClass::SyncAction, "BeginResponse", flag(), move |spec| Ok(BeginResponse(begins(spec)?)));
    let action = || [Port::input::<i64>("action").describe("its place in the row, from 0")];
    registry.action("AwaitTry", action(), |_| Ok(AwaitTry));
    registry.condition("IsPossible", action(), contingency::is_possible);
    registry.sync_action("TryFailed", [], contingency::try_failed);
    registry.action("ResetFlag", flag(), move |spec| Ok(ResetFlag(row(spec)?)));
    registry
}

/// Whether nothing speaks against it; else says what does.
fn unless(why: Option<String>, ports: &mut Ports<'_>) -> Result<bool, LeafError> {
    let holds = why.is_none();
    why.into_iter().for_each(|it| ports.explain(it));
    Ok(holds)
}

/// The reason that the engine recorded for the last failure.
fn why(ports: &Ports<'_>) -> String {
    ports.last_failure().map_or_else(|| "no leaf said why".to_owned(), Cause::to_string)
}
