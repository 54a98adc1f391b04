//! The end: on the ground, disarmed, with a report, which says so if the vehicle cannot be disarmed. An end in the air is a flag with a row of its own.

use behavior_tree::{Leaf, LeafResult, Ports, Status};
use domain::decision::DecisionKind;
use domain::mission::MissionOutcome;
use domain::skill::Goal;

use super::skill_run::SkillRun;
use crate::journal::{Cause, Said};
use crate::world::World;

#[derive(Default)]
pub(super) struct EndMission {
    has_said: bool,
    /// The vehicle stands armed on the ground: a landing there disarms it.
    disarming: Option<SkillRun>,
}

impl Leaf<World> for EndMission {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        // The vehicle may have flown again since.
        self.disarming = None;
        self.tick(world, ports)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        if world.responder().is_some() {
            // The response to an end in the air begins again at the next tick.
            ports.tick_again();
            return Ok(Status::Running);
        }
        // The tree comes here only at an end; if it does otherwise, it must not continue.
        world.end_mission(MissionOutcome::Failure, "the nominal behavior failed without a reason");
        if let Some(reason) = world.over().filter(|_| !std::mem::replace(&mut self.has_said, true)).map(str::to_owned) {
            let said = Said::new("mission", DecisionKind::MissionOver, format!("over: {reason}"));
            world.record(said.led_to_by(Cause::End));
        }
        let Some(vehicle) = world.vehicle().copied() else {
            ports.explain("it is not known whether the vehicle is on the ground");
            return Ok(Status::Running);
        };
        if vehicle.flying {
            world.raise_ended_in_air();
            ports.tick_again();
            return Ok(Status::Running);
        }
        if !world.has_settled() {
            return Ok(Status::Running);
        }
        // Somebody else who has armed it disarms it.
        if vehicle.armed && !world.is_other_reported() {
            let run = *self.disarming.get_or_insert_with(|| SkillRun::start(world, Goal::Land));
            if !run.is_over(world) {
                return Ok(Status::Running);
            }
            let told = match world.is_status_silent(&vehicle) {
                true => {
                    "the vehicle is on the ground; its status is silent, and whether it is still armed is not known"
                }
                false => "the vehicle is on the ground and still armed",
            };
            world.say("mission", told);
        }
        world.make_report();
        Ok(Status::Failure)
    }
}
