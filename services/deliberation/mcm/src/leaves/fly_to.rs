//! Flies without a plan: to over a landing site, or out of an area, round, over or under areas that may not be entered.
//! On the ground it succeeds at once, so that a response never lifts off.

use std::borrow::Cow;
use std::time::Duration;

use behavior_tree::{Leaf, LeafResult, Ports, Status};
use domain::geometry::Ned;
use domain::harm::Harm;
use domain::site::SiteKind;
use domain::skill::Goal;
use domain::time::Time;
use domain::way::{Found, MOST_LEGS};

use super::skill_run::SkillRun;
use crate::world::{Choice, Down, OF_ITS_OWN, ResponseWay, Stay, WayOut, WhatMayBeEntered, World};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Destination {
    Home,
    /// Over the operator's landing site; over free ground, if there is none.
    LandingSite,
    /// Over the best place to land at that is not here: one at which no landing has failed, as
    /// near as can be. Over any other, if there is none.
    AlternateSite,
    /// Over the best place that can be reached, home among them.
    BestSite,
    /// Over the best ditch that can be reached, if no landing can be.
    Ditch,
    /// Out of every area in which the vehicle must not be.
    OutOfArea,
    /// Over the place where coming straight down harms least: here, aside, or a place to land at.
    FreeGround,
}

/// Flies leg by leg; each is chosen when it begins, and again when the airspace rule forbids the remaining way.
pub(super) struct FlyTo {
    destination: Destination,
    leg: Option<Leg>,
}

struct Leg {
    run: SkillRun,
    /// Not a leg: there is no way, and the vehicle holds, or leaves an area, by this goal.
    waits: Option<Goal>,
    /// The end of the leg, how fast it is flown, and the end of the way.
    target: Ned,
    speed_limit_m_s: f64,
    site: Option<Ned>,
    is_last: bool,
    chosen_by: WhatMayBeEntered,
    look_again: Time,
}

impl Leg {
    /// Not a leg, but a landing where the vehicle is.
    fn lands(&self) -> bool {
        self.waits == Some(Goal::Land)
    }
}

/// Where to fly, and how.
struct Chosen {
    /// The end, where that is a place to land at.
    site: Option<Ned>,
    way: Vec<Ned>,
    place: Option<String>,
}

enum NoWay {
    To(Ned),
    Out(Stay),
    /// To any place that would do.
    Anywhere(Cow<'static, str>),
}

const NO_WAY: &str = "no way there that may be flown";
/// While there is no way it is looked for again this often, and whenever the airspace changes. (ENG: windows and
/// permissions are seconds to minutes long.)
const LOOK_AGAIN: Duration = Duration::from_secs(2);
/// While it waits for the autopilot it looks again this often, and whenever something changes. (ENG: no flight is late by more.)
const LOOK_AT_AUTOPILOT: Duration = Duration::from_millis(500);
/// Two legs whose ends are nearer to each other than this are the same.
const SAME_LEG_M: f64 = 1.0;

impl FlyTo {
    pub(super) fn new(destination: Destination) -> FlyTo {
        FlyTo { destination, leg: None }
    }

    /// Without an operator's landing site the vehicle lands where it is, by the rule for such landings.
    fn destination(&self, world: &World) -> Destination {
        match self.destination {
            Destination::LandingSite if world.landing_site().is_none() => Destination::FreeGround,
            destination => destination,
        }
    }

    /// The destination and the points on the way there, or why there is none. A destination that was chosen is kept.
    fn choose(&self, world: &World) -> Result<Chosen, NoWay> {
        let way_to = |site| -> Result<Chosen, NoWay> {
            if let Some(flag) = world.landing_forbidden_by(site) {
                return Err(NoWay::Anywhere(format!("no landing there while `{flag}` is up").into()));
            }
            let way = world.way_to(site).ok_or(NoWay::To(site))?;
            Ok(Chosen { site: Some(site), way, place: None })
        };
        let along = |way| Chosen { site: None, way, place: None };
        match self.destination(world) {
            Destination::Home => way_to(Ned::default()),
            Destination::LandingSite => {
                let site = world.landing_site().ok_or(NoWay::Anywhere("there is no landing site".into()))?;
                way_to(site)
            }
            Destination::AlternateSite => {
                let chosen = self.first_with_way(world.places_elsewhere(), world);
                chosen.ok_or(NoWay::Anywhere("no other place to land at can be reached".into()))
            }
            Destination::BestSite => {
                let places = world.places_to_divert_to();
                // What has to be asked for comes before a ditch, and is asked for.
                let free = places.iter().take_while(|it| !it.asks).cloned().collect();
                let asks = places.into_iter().find(|it| it.asks).map(|it| it.position);
                let chosen = self.first_with_way(free, world);
                chosen.ok_or_else(|| match asks.or_else(|| world.nearest_closed_landing()) {
                    Some(site) => NoWay::To(site),
                    None => NoWay::Anywhere(world.why_no_place().into()),
                })
            }
            Destination::Ditch => {
                // What was chosen when no landing could be reached is kept: to turn round for each that may be would reach none.
                if self.leg.is_none()
                    && let Some(landing) = world.landing_in_reach()
                {
                    return Err(NoWay::Anywhere(format!("a landing can be reached: {landing}").into()));
                }
                let chosen = self.first_with_way(world.places_to_ditch(), world);
                chosen.ok_or(NoWay::Anywhere("no ditch can be reached".into()))
            }
            Destination::OutOfArea => match world.way_out() {
                Some(WayOut::Flies(way)) => Ok(along(way)),
                Some(WayOut::Stays(stay)) => Err(NoWay::Out(stay)),
                None => Err(NoWay::Anywhere("the vehicle's position is not known".into())),
            },
            Destination::FreeGround => {
                let none = NoWay::Anywhere("nowhere in reach would a landing harm less".into());
                match world.least_harm() {
                    (Harm::NONE, Down::Here) => Ok(along(Vec::new())),
                    (_, Down::Here) => Err(none),
                    (_, Down::Aside(way)) => Ok(along(way)),
                    (_, Down::At(place)) => self.first_with_way(vec![place], world).ok_or(none),
                }
            }
        }
    }

    /// Where it leads, in words, with the name of the place that was chosen.
    fn words(&self, world: &World, place: Option<&str>) -> String {
        let words = match self.destination(world) {
            Destination::Home => "home",
            Destination::LandingSite => "the ordered place",
            Destination::AlternateSite | Destination::BestSite | Destination::Ditch => {
                place.unwrap_or("a place to land at")
            }
            Destination::OutOfArea => "out of the area",
            Destination::FreeGround => place.unwrap_or("free ground"),
        };
        words.to_owned()
    }

    /// The first of `places` to which there is a way, the one that is flown to before all others.
    fn first_with_way(&self, mut places: Vec<Choice>, world: &World) -> Option<Chosen> {
        if let Some(kept) = self.leg.as_ref().and_then(|leg| leg.site) {
            // A place beside a blocked one is in no list once the vehicle is on its way there.
            if self.destination == Destination::AlternateSite && places.iter().all(|it| it.position != kept) {
                let (kind, words) = (SiteKind::Landing, "the place that was chosen".into());
                places.push(Choice { position: kept, kind, words, asks: false });
            }
            // The sort keeps the order of the others.
            places.sort_by_key(|it| it.position != kept);
        }
        let mut legs_left = MOST_LEGS;
        places.into_iter().find_map(|it| {
            let Found { way, legs } = world.way_within((it.position, it.kind), legs_left);
            legs_left = legs_left.saturating_sub(legs);
            Some(Chosen { site: Some(it.position), way: way?, place: Some(it.words) })
        })
    }

    /// The first point of the way that is not reached yet, and whether it is the last one. A way that is chosen where a leg has
    /// ended may begin with the point of that leg, since a leg ends near its point; to fly there again would never end.
    fn next_point(way: &[Ned], here: Ned, world: &World) -> Option<(Ned, bool)> {
        let (last, turns) = way.split_last()?;
        let is_ahead = |turn: &&Ned| world.limits().config.arrival_radius_m.get() < turn.distance_m(here);
        Some(turns.iter().find(is_ahead).map_or((*last, true), |turn| (*turn, false)))
    }

    /// Chooses the way and flies its first leg, unless that is the one that is flown.
    fn fly(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let Some(vehicle) = world.vehicle().copied() else {
            // The manager was started again during a response and does not know yet where the vehicle is.
            ports.explain("the vehicle's position is not known");
            // A landing does not wait for it.
            let is_needed = self.destination(world) != Destination::FreeGround;
            return Ok(if is_needed { Status::Running } else { Status::Failure });
        };
        if !vehicle.flying {
            return Ok(Status::Success);
        }
        if let (Destination::FreeGround, Some(flag)) = (self.destination(world), world.position_is_missing()) {
            ports.explain(format!("lands where it is: it is not known where that is, `{flag}` is up"));
            return Ok(Status::Failure);
        }
        if self.leg.as_ref().map_or_else(|| world.lands_where_it_is(), Leg::lands) {
            return Ok(self.land_at_once(vehicle.position, world, ports));
        }
        match self.destination(world) {
            Destination::Home => world.enter_as_ordered(Ned::default()),
            Destination::LandingSite => {
                if let Some(site) = world.landing_site() {
                    world.enter_as_ordered(site);
                }
            }
            Destination::FreeGround => world.enter_rather_than_harm(),
            Destination::AlternateSite | Destination::BestSite | Destination::Ditch | Destination::OutOfArea => {}
        }
        if self.destination(world) == Destination::FreeGround && world.may_wait_for_traffic() {
            self.wait(vehicle.position, None, world, ports);
            return Ok(Status::Running);
        }
        let Chosen { site, way, place } = match self.choose(world) {
            Ok(chosen) => chosen,
            Err(NoWay::To(site)) if world.may_wait_for_way(site, NO_WAY) => {
                self.wait(vehicle.position, Some(site), world, ports);
                return Ok(Status::Running);
            }
            Err(NoWay::Out(stay)) if world.may_stay_inside(&stay) => {
                self.wait(vehicle.position, None, world, ports);
                return Ok(Status::Running);
            }
            Err(no_way) => {
                match no_way {
                    NoWay::To(site) => ports.explain(world.why_no_way(NO_WAY, site)),
                    NoWay::Out(Stay { why, .. }) => ports.explain(why),
                    NoWay::Anywhere(why) => ports.explain(why.into_owned()),
                }
                return Ok(Status::Failure);
            }
        };
        if world.is_left_to_autopilot() && FlyTo::next_point(&way, vehicle.position, world).is_some() {
            if world.may_wait_for_autopilot() {
                self.wait_for_autopilot(world, ports);
                return Ok(Status::Running);
            }
            ports.explain(OF_ITS_OWN);
            return Ok(Status::Failure);
        }
        world.has_waited_for_autopilot();
        world.has_found_way();
        let destination = self.words(world, place.as_deref());
        let is_another = self.leg.as_ref().is_none_or(|leg| leg.waits.is_some() || leg.site != site);
        if let (Some(place), Some(site), true) = (place, site, is_another) {
            world.record_place(site, place);
        }
        let Some((target, is_last)) = FlyTo::next_point(&way, vehicle.position, world) else {
            return Ok(Status::Success);
        };
        let speed_limit_m_s = world.flight_limits().speeds.cruise_m_s;
        let is_flown = |leg: &Leg| {
            let is_same = leg.target.distance_m(target) < SAME_LEG_M && leg.speed_limit_m_s == speed_limit_m_s;
            is_same && leg.waits.is_none() && !leg.run.is_over(world)
        };
        let run = match &self.leg {
            Some(leg) if is_flown(leg) => leg.run,
            _ => {
                self.halt(world, ports);
                SkillRun::start(world, Goal::fly_to(target, speed_limit_m_s))
            }
        };
        let points = way.into_iter().skip_while(|it| *it != target).collect();
        let lands = self.destination != Destination::OutOfArea;
        world.set_response_way(Some(ResponseWay { points, destination, lands }));
        let (chosen_by, look_again) = (world.what_may_be_entered(), world.next_look());
        self.leg = Some(Leg { run, waits: None, target, speed_limit_m_s, site, is_last, chosen_by, look_again });
        Ok(Status::Running)
    }

    /// So near the ground nothing is flown to but the ground: the vehicle may rest on it already, and a response lifts nothing off.
    fn land_at_once(&mut self, here: Ned, world: &mut World, ports: &mut Ports<'_>) -> Status {
        if world.is_left_to_autopilot() && world.may_wait_for_autopilot() {
            self.wait_for_autopilot(world, ports);
            return Status::Running;
        }
        if self.leg.is_none() {
            world.say_it_lands_at_once();
            let (run, waits) = (SkillRun::start(world, Goal::Land), Some(Goal::Land));
            // Once it stands that is the end.
            let (chosen_by, look_again) = (world.what_may_be_entered(), world.now());
            let (target, speed_limit_m_s) = (here, world.flight_limits().speeds.cruise_m_s);
            let (site, is_last) = (None, false);
            self.leg = Some(Leg { run, waits, target, speed_limit_m_s, site, is_last, chosen_by, look_again });
        }
        Status::Running
    }

    /// Holds until there may be a way; out of an area in which the vehicle must not be, or of the way of other traffic.
    fn wait(&mut self, here: Ned, site: Option<Ned>, world: &mut World, ports: &mut Ports<'_>) {
        let speed_limit_m_s = world.flight_limits().speeds.cruise_m_s;
        let out = match world.way_out() {
            Some(WayOut::Flies(way)) => FlyTo::next_point(&way, here, world),
            Some(WayOut::Stays(_)) | None => None,
        };
        let before = self.leg.as_ref().and_then(|leg| match leg.waits {
            Some(Goal::Position { target, .. }) => Some(target),
            _ => None,
        });
        let target = out.map(|(target, _)| target).or_else(|| world.place_out_of_traffic(before));
        let goal = target.map_or(Goal::Stop, |it| Goal::fly_to(it, speed_limit_m_s));
        let run = match &self.leg {
            Some(leg) if leg.waits.as_ref() == Some(&goal) => leg.run,
            _ => {
                self.halt(world, ports);
                SkillRun::start(world, goal.clone())
            }
        };
        let (chosen_by, look_again) = (world.what_may_be_entered(), world.now() + LOOK_AGAIN);
        let target = site.unwrap_or(here);
        self.leg =
            Some(Leg { run, waits: Some(goal), target, speed_limit_m_s, site, is_last: false, chosen_by, look_again });
    }

    /// Flies nothing until a failsafe of the autopilot's own is over.
    fn wait_for_autopilot(&mut self, world: &mut World, ports: &mut Ports<'_>) {
        self.halt(world, ports);
        ports.tick_at((world.now() + LOOK_AT_AUTOPILOT).since_start());
    }

    /// Begins to fly, or to fly on; says of a landing that is not to be here whether it flies aside.
    fn begin(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        let status = self.fly(world, ports)?;
        let waits = status == Status::Running && self.leg.is_none();
        if self.destination(world) == Destination::FreeGround
            && status != Status::Success
            && !waits
            && !self.leg.as_ref().is_some_and(Leg::lands)
            && world.position_is_missing().is_none()
            && (status == Status::Running || world.why_land_elsewhere().is_none())
        {
            world.say_what_forbids_landing(status == Status::Running);
        }
        Ok(status)
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
        if leg.waits.is_some() {
            return true;
        }
        leg.look_again = world.next_look();
        let may_change = matches!(self.destination, Destination::BestSite | Destination::FreeGround);
        if may_change && leg.site.is_some_and(|it| world.is_out_of_reach(it)) {
            return true;
        }
        world.breach_towards(leg.target, leg.speed_limit_m_s).is_some()
    }
}

impl Leaf<World> for FlyTo {
    fn start(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        self.leg = None;
        world.set_response_way(None);
        self.begin(world, ports)
    }

    fn tick(&mut self, world: &mut World, ports: &mut Ports<'_>) -> LeafResult {
        if let Some(why) = world.why_no_longer_possible() {
            ports.explain(why);
            self.halt(world, ports);
            return Ok(Status::Failure);
        }
        let Some(leg) = &self.leg else { return self.begin(world, ports) };
        let (status, waits, is_at_end) = (leg.run.poll(world, ports)?, leg.waits.is_some(), leg.is_last);
        let may_go_on = status == Status::Running || (status == Status::Success && waits);
        let is_doubtful = may_go_on && self.is_doubtful(world);
        match status {
            // What holds the vehicle has come to rest.
            Status::Success if waits && !is_doubtful => Ok(Status::Running),
            Status::Success | Status::Running if is_doubtful || (!may_go_on && !is_at_end) => {
                let status = self.fly(world, ports)?;
                if status != Status::Running {
                    self.halt(world, ports);
                }
                Ok(status)
            }
            // That it was interrupted says nothing of the way.
            Status::Failure if world.is_left_to_autopilot() && world.may_wait_for_autopilot() => {
                self.wait_for_autopilot(world, ports);
                Ok(Status::Running)
            }
            Status::Failure => {
                world.set_response_way(None);
                Ok(Status::Failure)
            }
            // Over its end the vehicle comes down there.
            status => Ok(status),
        }
    }

    fn halt(&mut self, world: &mut World, _: &mut Ports<'_>) {
        world.set_response_way(None);
        if let Some(leg) = self.leg.take() {
            leg.run.halt(world);
        }
    }
}
