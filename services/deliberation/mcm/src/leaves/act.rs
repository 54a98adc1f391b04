//! Flies a skill: starts it when ticked first, gives it up when halted, and ends with its outcome. A step of the plan is flown as the
//! flags that are up allow: slower, or no farther than what they forbid, until they have fallen.

use behavior_tree::{In, Leaf, LeafResult, Ports, Status};
use domain::contingency::narrowing::Narrowing;
use domain::time::Time;

use super::ports::Goal;
use super::skill_run::SkillRun;
use crate::world::{Barrier, NarrowedGoal, World};

pub(super) struct Act {
    what: What,
    flown: Option<Flown>,
}

pub(super) enum What {
    /// The goal of this port, which is that of a step.
    Port(In<Goal>),
    Fixed(domain::skill::Goal),
    /// To stay where the vehicle is, by setpoints.
    HoldPosition,
    /// To climb by the configured height.
    Climb,
}

struct Flown {
    run: SkillRun,
    /// For a step of the plan.
    step: Option<StepGoal>,
}

struct StepGoal {
    wanted: domain::skill::Goal,
    flown: NarrowedGoal,
    chosen_by: Narrowing,
    look_again: Time,
    /// When it has held before what a flag forbids for long enough, if it does.
    gives_up: Option<Time>,
}

impl Act {
    pub(super) fn new(what: What) -> Act {
        Act { what, flown: None }
    }
}

impl StepGoal {
    fn new(wanted: domain::skill::Goal, world: &mut World) -> StepGoal {
        let flown = world.narrowed(wanted.clone(), None);
        if flown.barrier.is_some() {
            world.say_held(flown.barrier.as_ref());
        }
        let gives_up = flown.barrier.as_ref().map(|_| world.barrier_ends());
        StepGoal { wanted, flown, chosen_by: world.narrowing(), look_again: world.next_look(), gives_up }
    }

    /// Whether the part that may be flown must be looked at again.
    fn is_doubtful(&self, world: &World) -> bool {
        let narrowing = world.narrowing();
        self.chosen_by != narrowing || (narrowing.no_new_area.is_some() && self.look_again <= world.now())
    }

    /// What it has held before for as long as it may.
    fn overdue(&self, now: Time) -> Option<&Barrier> {
        self.flown.barrier.as_ref().filter(|_| self.gives_up.is_some_and(|at| at <= now))
    }

    /// Looks again; returns whether something else is to be flown.
    fn has_changed(&mut self, world: &mut World) -> bool {
        let narrowed = world.narrowed(self.wanted.clone(), self.flown.barrier.as_ref());
        (self.chosen_by, self.look_again) = (world.narrowing(), world.next_look());
        let is_same_hold = narrowed.barrier.is_some() && narrowed.barrier == self.flown.barrier;
        if is_same_hold || narrowed == self.flown {
            return false;
        }
        if narrowed.barrier != self.flown.barrier {
            world.say_held(narrowed.barrier.as_ref());
            self.gives_up = narrowed.barrier.as_ref().map(|_| world.barrier_ends());
        }
        self.flown = narrowed;
        true
    }
}

impl Leaf<World> for Act {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        self.flown = None;
        let goal = match &self.what {
            What::Port(port) => {
                let step = StepGoal::new(ports.read(*port)?.0, world);
                let along = world.begin_along();
                let run = SkillRun::start_with(world, step.flown.goal.clone(), along);
                self.flown = Some(Flown { run, step: Some(step) });
                return Ok(Status::Running);
            }
            // What touches the ground is not stopped in the last hand's breadth.
            What::Fixed(domain::skill::Goal::Stop) if world.touches_in_landing() => domain::skill::Goal::Land,
            What::Fixed(goal) => goal.clone(),
            What::HoldPosition => match world.vehicle() {
                Some(vehicle) => domain::skill::Goal::fly_to(vehicle.position, world.flight_limits().speeds.cruise_m_s),
                None => {
                    ports.explain("the vehicle's position is not known");
                    return Ok(Status::Failure);
                }
            },
            What::Climb => match world.climb() {
                Ok(Some(goal)) => goal,
                Ok(None) => return Ok(Status::Success),
                Err(why) => {
                    ports.explain(why);
                    return Ok(Status::Failure);
                }
            },
        };
        self.flown = Some(Flown { run: SkillRun::start(world, goal), step: None });
        Ok(Status::Running)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let Some(Flown { run, step }) = &mut self.flown else {
            return Err("ticked without having been started".into());
        };
        if let Some(step) = step
            && !run.is_over(world)
        {
            let broken = run.broken_along(world);
            if (step.is_doubtful(world) && step.has_changed(world)) || broken.is_some() {
                let along = broken.unwrap_or_else(|| run.along(world));
                run.halt(world);
                *run = SkillRun::start_with(world, step.flown.goal.clone(), along);
                return Ok(Status::Running);
            }
        }
        if let Some(step) = step {
            if let Some(barrier) = step.overdue(world.now()) {
                ports.explain(world.give_up_before(barrier));
                run.halt(world);
                return Ok(Status::Failure);
            }
            if let Some(at) = step.gives_up {
                ports.tick_at(at.since_start());
            }
        }
        if run.did_not_come_down(world) {
            world.landing_failed_here();
        }
        let status = run.poll(world, ports)?;
        let goal = step.as_ref().map(|it| &it.wanted).filter(|_| status == Status::Success);
        match goal.and_then(|it| world.unmet_postcondition(it)) {
            Some(unmet) => {
                ports.explain(format!("postcondition not met: {unmet}"));
                Ok(Status::Failure)
            }
            None => Ok(status),
        }
    }

    fn halt(&mut self, world: &mut World, _: &mut Ports<'_>) {
        if let Some(Flown { run, .. }) = self.flown.take() {
            run.halt(world);
        }
    }
}
