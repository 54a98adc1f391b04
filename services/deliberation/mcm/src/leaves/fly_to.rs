//! Over a place to land at, round what may not be entered. On the ground it is over at once: what answers a flag
//! never lifts off, whatever else is still up once the vehicle has landed.

use behavior_tree::{Leaf, LeafResult, Ports, Status};
use domain::area::Area;
use domain::detour::way_round;
use domain::geometry::Ned;
use domain::skill::Goal;
use kittiwake_proto::v1::{SkillOutcome, TimingPoint};

use crate::clients::skills::{Handle, Progress, ending};
use crate::world::World;

/// Where to.
pub(super) enum Destination {
    /// Over the take-off point, at the height of returns or higher.
    Home,
    /// Over the place that the operator named, at the present height; where the vehicle is, if none was named.
    LandingSite,
}

/// Flies leg by leg; each is chosen by what may be entered when it begins.
pub(super) struct FlyTo {
    destination: Destination,
    leg: Option<Leg>,
}

impl FlyTo {
    /// Not under way yet.
    pub(super) fn new(destination: Destination) -> FlyTo {
        FlyTo { destination, leg: None }
    }

    fn target(&self, from: Ned, world: &World) -> Ned {
        match self.destination {
            Destination::Home => Ned::default().at_height(from.height_m().max(world.limits.return_height_m)),
            Destination::LandingSite => world.operator.landing_site.unwrap_or(from).at_height(from.height_m()),
        }
    }
}

struct Leg {
    skill: Handle,
    is_last: bool,
    /// The areas that could be entered when it was chosen.
    held: Vec<String>,
    /// And all that were known.
    areas: Vec<Area>,
}

impl Leaf<World> for FlyTo {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        self.leg = None;
        let Some(vehicle) = world.vehicle else {
            // The manager was started again in the middle of a response: no way leads from nowhere.
            ports.because_of("the vehicle's position is known");
            return Ok(Status::Running);
        };
        if !vehicle.flying {
            return Ok(Status::Success);
        }
        let limits = world.limits;
        let from = vehicle.position;
        let there = self.target(from, world);
        let held = world.held();
        let margin_m = limits.transition.stand_off_m / 2.0;
        let way = way_round(from, there, &world.planner.areas, &held, world.now.utc_ms, margin_m);
        let Some(&target) = way.first() else {
            world.failure.reason = "no way there that may be flown".to_owned();
            ports.because_of("there is a way that may be flown");
            return Ok(Status::Failure);
        };
        let goal =
            Goal::Position { target, speed_limit_m_s: limits.return_speed_m_s, yaw_rad: None, hold_at_target: false };
        let skill = world.skills.start(world.now.time, goal);
        if world.acting.is_some() {
            world.timing.mark_flag(TimingPoint::ActionTriggered, goal.kind(), world.acting.clone());
        }
        let areas = world.planner.areas.clone();
        self.leg = Some(Leg { skill, is_last: way.len() == 1, held, areas });
        Ok(Status::Running)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let Some(leg) = &self.leg else { return self.start(world, ports) };
        match world.skills.progress(leg.skill) {
            Some(Progress::Ended(SkillOutcome::Succeeded, _)) if leg.is_last => Ok(Status::Success),
            Some(Progress::Ended(SkillOutcome::Succeeded, _)) => self.start(world, ports),
            Some(Progress::Ended(outcome, reason)) => {
                let words = ending(*outcome, reason);
                world.failure.reason = words.clone();
                ports.because("the way was flown", words, "succeeded".to_owned());
                Ok(Status::Failure)
            }
            _ if leg.held != world.held() || leg.areas != world.planner.areas => {
                world.skills.halt(leg.skill);
                self.start(world, ports)
            }
            _ => Ok(Status::Running),
        }
    }

    fn halt(&mut self, world: &mut World, _: &mut Ports<'_>) {
        if let Some(leg) = self.leg.take() {
            world.skills.halt(leg.skill);
        }
    }
}
