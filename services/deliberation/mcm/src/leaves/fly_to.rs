//! Flies without a plan: to over a landing site, or out of an area, round, over or under areas that may not be entered.
//! On the ground it succeeds at once, so that a response never lifts off.

use behavior_tree::{Leaf, LeafResult, Ports, Status};
use domain::geometry::Ned;
use domain::skill::Goal;
use domain::time::Time;

use super::skill_run::SkillRun;
use crate::world::{WhatMayBeEntered, World};

/// The destination.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Destination {
    /// Over the take-off point, at the height of returns or higher.
    Home,
    /// Over the operator's landing site; where the vehicle is, if there is none.
    LandingSite,
    /// Over the nearest landing site at which no landing has failed.
    AlternateSite,
    /// Out of every area in which the vehicle must not be.
    OutOfArea,
}

/// Flies leg by leg; each is chosen when it begins, and again when the airspace rule forbids the rest of it.
pub(super) struct FlyTo {
    destination: Destination,
    leg: Option<Leg>,
}

struct Leg {
    run: SkillRun,
    /// The end of the leg, and the end of the way.
    target: Ned,
    site: Option<Ned>,
    is_last: bool,
    chosen_by: WhatMayBeEntered,
    look_again: Time,
}

/// Two legs whose ends are nearer to each other than this are the same.
const SAME_LEG_M: f64 = 1.0;

impl FlyTo {
    /// Not started yet.
    pub(super) fn new(destination: Destination) -> FlyTo {
        FlyTo { destination, leg: None }
    }

    /// The destination and the points on the way there, or why there is none. A destination that was chosen is kept.
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

    /// The first point of the way that is not reached yet, and whether it is the last one. A way that is chosen where a leg has
    /// ended may begin with the point of that leg, since a leg ends near its point; to fly there again would never end.
    fn next_point(way: &[Ned], here: Ned, world: &World) -> Option<(Ned, bool)> {
        let (last, turns) = way.split_last()?;
        let is_ahead = |turn: &&Ned| world.limits().arrival_radius_m < turn.distance_m(here);
        Some(turns.iter().find(is_ahead).map_or((*last, true), |turn| (*turn, false)))
    }

    /// Chooses the way and flies its first leg, unless that is the one that is flown.
    fn fly(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let Some(vehicle) = world.vehicle().copied() else {
            // The manager was started again during a response and does not know yet where the vehicle is.
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
        let Some((target, is_last)) = FlyTo::next_point(&way, vehicle.position, world) else {
            return Ok(Status::Success);
        };
        let run = match &self.leg {
            Some(leg) if leg.target.distance_m(target) < SAME_LEG_M && !leg.run.is_over(world) => leg.run,
            _ => {
                self.halt(world, ports);
                let speed_limit_m_s = world.limits().flight.speed_m_s;
                SkillRun::start(world, Goal::Position { target, speed_limit_m_s, yaw_rad: None, hold_at_target: false })
            }
        };
        let (chosen_by, look_again) = (world.what_may_be_entered(), world.next_look());
        self.leg = Some(Leg { run, target, site, is_last, chosen_by, look_again });
        Ok(Status::Running)
    }

    /// Whether the way must be chosen again.
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
