//! Keeps out of the way of other traffic for as long as it comes near: stays where that is well clear, else flies aside or lower, and lands
//! only where nothing else is far enough. On the ground it succeeds at once.

use std::time::Duration;

use behavior_tree::{Leaf, LeafResult, Ports, Status};
use domain::skill::Goal;
use domain::time::Time;
use domain::traffic::Evasion;

use super::skill_run::SkillRun;
use crate::world::{ResponseWay, World};

/// The way is chosen again this often. (ENG: a receiver reports once a second.)
const LOOK_AGAIN: Duration = Duration::from_secs(1);

#[derive(Default)]
pub(super) struct Avoid {
    flown: Option<Flown>,
}

struct Flown {
    run: SkillRun,
    chosen: Evasion,
    look_again: Time,
}

impl Avoid {
    fn fly(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        if world.is_on_ground() {
            return Ok(Status::Success);
        }
        if world.is_left_to_autopilot() {
            self.halt(world, ports);
            return Ok(Status::Running);
        }
        if let Some(place) = world.landing_about_to_be_lost() {
            self.halt(world, ports);
            let why = format!("no longer out of the way: {place} would be out of reach");
            world.say("contingency", why.clone());
            ports.explain(why);
            return Ok(Status::Failure);
        }
        let before = self.flown.as_ref().map(|it| it.chosen);
        let chosen = match world.lands_where_it_is() {
            true => Some(Evasion::Land),
            false => world.evasion(before),
        };
        let Some(chosen) = chosen else {
            ports.explain("the vehicle's position is not known");
            return Ok(Status::Failure);
        };
        let look_again = world.now() + LOOK_AGAIN;
        let run = match &self.flown {
            Some(flown) if flown.chosen == chosen => flown.run,
            _ => {
                self.halt(world, ports);
                let (goal, way) = goal(chosen, world);
                let run = SkillRun::start(world, goal);
                world.set_response_way(way);
                run
            }
        };
        ports.tick_at(look_again.since_start());
        self.flown = Some(Flown { run, chosen, look_again });
        Ok(Status::Running)
    }
}

/// What is flown, and its way for operators.
fn goal(chosen: Evasion, world: &mut World) -> (Goal, Option<ResponseWay>) {
    let speed_limit_m_s = world.flight_limits().speeds.cruise_m_s;
    let (goal, text, way) = match chosen {
        Evasion::Stay => (Goal::Stop, format!("stays: {}", world.why_it_stays()), None),
        Evasion::To(target) => {
            let way = ResponseWay { points: vec![target], destination: "out of the way".to_owned(), lands: false };
            (Goal::hold_at(target, speed_limit_m_s), format!("out of the way, to {target}"), Some(way))
        }
        Evasion::Land => (Goal::Land, "lands: nothing else is far enough from it".to_owned(), None),
    };
    world.say("contingency", text);
    (goal, way)
}

impl Leaf<World> for Avoid {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        self.flown = None;
        self.fly(world, ports)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        if let Some(why) = world.why_no_longer_possible() {
            ports.explain(why);
            self.halt(world, ports);
            return Ok(Status::Failure);
        }
        let Some(Flown { run, chosen, look_again }) = &self.flown else { return self.fly(world, ports) };
        if !world.has_cause() {
            self.halt(world, ports);
            return Ok(Status::Success);
        }
        match run.poll(world, ports)? {
            Status::Failure if world.is_left_to_autopilot() => self.fly(world, ports),
            Status::Failure => Ok(Status::Failure),
            Status::Success if *chosen == Evasion::Land => Ok(Status::Success),
            _ if *look_again <= world.now() => self.fly(world, ports),
            _ => {
                ports.tick_at(look_again.since_start());
                Ok(Status::Running)
            }
        }
    }

    fn halt(&mut self, world: &mut World, _: &mut Ports<'_>) {
        world.set_response_way(None);
        if let Some(flown) = self.flown.take() {
            flown.run.halt(world);
        }
    }
}
