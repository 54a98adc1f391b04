//! Flies a skill: starts it when ticked first, gives it up when halted, and ends with its outcome.

use behavior_tree::{BuildError, In, Leaf, LeafResult, NodeSpec, Ports, Status};

use super::ports::Goal;
use super::skill_run::SkillRun;
use crate::world::World;

pub(super) struct Act {
    what: What,
    run: Option<SkillRun>,
}

enum What {
    Port(In<Goal>),
    Fixed(domain::skill::Goal),
    HoldPosition,
}

impl Act {
    /// The goal of its port.
    pub(super) fn with_port(spec: &NodeSpec<'_>) -> Result<Act, BuildError> {
        Ok(Act { what: What::Port(spec.input("goal")?), run: None })
    }

    /// To stay where the vehicle is, by setpoints.
    pub(super) fn hold_position() -> Act {
        Act { what: What::HoldPosition, run: None }
    }

    /// A fixed goal.
    pub(super) fn fixed(goal: domain::skill::Goal) -> Act {
        Act { what: What::Fixed(goal), run: None }
    }
}

impl Leaf<World> for Act {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let goal = match &self.what {
            What::Port(port) => ports.read(*port)?.0,
            What::Fixed(goal) => *goal,
            What::HoldPosition => match world.vehicle() {
                Some(vehicle) => domain::skill::Goal::Position {
                    target: vehicle.position,
                    speed_limit_m_s: world.limits().flight.speeds.cruise_m_s,
                    yaw_rad: None,
                    hold_at_target: false,
                },
                None => {
                    ports.explain("the vehicle's position is not known");
                    return Ok(Status::Failure);
                }
            },
        };
        self.run = Some(SkillRun::start(world, goal));
        Ok(Status::Running)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        match self.run {
            Some(run) => {
                if run.did_not_come_down(world) {
                    world.landing_failed_here();
                }
                run.poll(world, ports)
            }
            None => Err("ticked without having been started".into()),
        }
    }

    fn halt(&mut self, world: &mut World, _: &mut Ports<'_>) {
        if let Some(run) = self.run.take() {
            run.halt(world);
        }
    }
}
