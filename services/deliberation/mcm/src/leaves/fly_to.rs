//! Flies without a plan: over a place to land at, or out of an area, round, over or under what may not be entered. On the
//! ground it is over at once: what answers a flag never lifts off.

use behavior_tree::{Leaf, LeafResult, Ports, Status};
use domain::geometry::Ned;
use domain::skill::Goal;
use domain::time::Time;

use super::skill_run::SkillRun;
use crate::world::{WhatMayBeEntered, World};

/// Where to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Destination {
    /// Over the take-off point, at the height of returns or higher.
    Home,
    /// Over the place that the operator named; where the vehicle is, if none was named.
    LandingSite,
    /// Over the nearest place to land at where no landing has failed.
    AlternateSite,
    /// Out of every area that it must not be in.
    OutOfArea,
}

/// Flies leg by leg; each is chosen when it begins, and again when something is found to be wrong with it.
pub(super) struct FlyTo {
    destination: Destination,
    leg: Option<Leg>,
}

struct Leg {
    run: SkillRun,
    /// Where the leg ends, and where the way does.
    target: Ned,
    site: Option<Ned>,
    is_last: bool,
    chosen_by: WhatMayBeEntered,
    look_again: Time,
}

/// Nearer to each other than this two legs are the same.
const SAME_LEG_M: f64 = 1.0;

impl FlyTo {
    /// Not under way yet.
    pub(super) fn new(destination: Destination) -> FlyTo {
        FlyTo { destination, leg: None }
    }

    /// The place to fly to, and the points on the way there; why there is none. A place that was chosen before is kept.
    fn choose(&self, from: Ned, world: &World) -> Result<(Option<Ned>, Vec<Ned>), &'static str> {
        const NO_WAY: &str = "no way there that may be flown";
        let clear_m = world.clear_height_m(from);
        let (site, way) = match self.destination {
            Destination::Home => {
                let height_m = clear_m.max(world.limits().return_height_m);
                (Some(Ned::default()), world.way_to(Ned::default(), height_m).ok_or(NO_WAY)?)
            }
            Destination::LandingSite => {
                let site = world.landing_site().unwrap_or(from);
                (Some(site), world.way_to(site, clear_m).ok_or(NO_WAY)?)
            }
            Destination::AlternateSite => {
                let kept = self.leg.as_ref().and_then(|leg| leg.site);
                let sites = kept.into_iter().chain(world.alternate_sites());
                let mut reachable = sites.filter_map(|site| Some((Some(site), world.way_to(site, clear_m)?)));
                reachable.next().ok_or("no other place to land at can be reached")?
            }
            Destination::OutOfArea => (None, world.way_out().ok_or("no way out that may be flown")?),
        };
        Ok((site, way))
    }

    /// Chooses the way and flies its first leg, unless that is the one that is flown.
    fn fly(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let Some(vehicle) = world.vehicle().copied() else {
            // The manager was started again in the middle of a response: no way leads from nowhere.
            ports.explain("the vehicle's position is not known");
            return Ok(Status::Running);
        };
        if !vehicle.flying {
            return Ok(Status::Success);
        }
        let (site, way) = match self.choose(vehicle.position, world) {
            Ok(chosen) => chosen,
            Err(why) => {
                ports.explain(why);
                return Ok(Status::Failure);
            }
        };
        let Some(&target) = way.first() else { return Ok(Status::Success) };
        let run = match &self.leg {
            Some(leg) if leg.target.distance_m(target) < SAME_LEG_M && !leg.run.is_over(world) => leg.run,
            _ => {
                self.halt(world, ports);
                let speed_limit_m_s = world.limits().flight.speed_m_s;
                SkillRun::start(world, Goal::Position { target, speed_limit_m_s, yaw_rad: None, hold_at_target: false })
            }
        };
        let (chosen_by, look_again) = (world.what_may_be_entered(), world.next_look());
        self.leg = Some(Leg { run, target, site, is_last: way.len() == 1, chosen_by, look_again });
        Ok(Status::Running)
    }

    /// Whether the way has to be chosen again.
    fn is_doubtful(&mut self, world: &World) -> bool {
        let Some(leg) = &mut self.leg else { return true };
        let has_moved = self.destination == Destination::LandingSite && leg.site != world.landing_site();
        if has_moved || leg.chosen_by != world.what_may_be_entered() {
            return true;
        }
        if world.now() < leg.look_again {
            return false;
        }
        leg.look_again = world.next_look();
        world.breach_towards(leg.target, world.limits().flight.speed_m_s).is_some()
    }
}

impl Leaf<World> for FlyTo {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        self.leg = None;
        self.fly(world, ports)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let Some(leg) = &self.leg else { return self.fly(world, ports) };
        match leg.run.poll(world, ports)? {
            Status::Success if !leg.is_last => self.fly(world, ports),
            Status::Running if self.is_doubtful(world) => match self.fly(world, ports)? {
                Status::Running => Ok(Status::Running),
                status => {
                    self.halt(world, ports);
                    Ok(status)
                }
            },
            status => Ok(status),
        }
    }

    fn halt(&mut self, world: &mut World, _: &mut Ports<'_>) {
        if let Some(leg) = self.leg.take() {
            leg.run.halt(world);
        }
    }
}
