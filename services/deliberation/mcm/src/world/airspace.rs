//! Where the vehicle may fly now: the airspace rule, asked in every mode.

use std::sync::Arc;
use std::time::Duration;

use domain::airspace::{Airspace, Breach, Clock, Grants, Motion};
use domain::area::{Area, AreaKind};
use domain::contingency::narrowing::Narrowing;
use domain::geometry::Ned;
use domain::plan::Step;
use domain::skill::Goal;
use domain::speeds::Speeds;
use domain::time::Time;
use domain::trust::Source;
use domain::way::FlightLimits;

use super::World;
use super::places::SAME_SITE_M;
use crate::clients::planner::FlownMission;
use crate::permits::{Beyond, Permits, held_for};

/// Time to brake and to turn before the way out is flown.
const TURN: Duration = Duration::from_secs(5);
/// A way out takes longer than it is reckoned by up to this factor, as in the airspace rule.
const SLOWER: f64 = 1.25;
/// The time to turn, and for a flight of this many seconds out of an area.
pub(super) fn with_turn(flight_s: f64) -> Duration {
    TURN.saturating_add(Duration::try_from_secs_f64(SLOWER * flight_s).unwrap_or(Duration::MAX))
}

/// All areas, those that may be entered, and what flags forbid; a way is chosen again when they change.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct WhatMayBeEntered {
    held: Vec<String>,
    areas: Arc<[Area]>,
    narrowing: Narrowing,
    comes_down: bool,
    beyond: Beyond,
    /// A landing is ordered where the vehicle is, whatever is below.
    insists: bool,
}

impl World {
    pub(super) fn permits(&self) -> &Permits {
        self.answer.permits.get_or_init(|| {
            let (now, grants) = (self.now.time, self.permissions.grants(self.now.time));
            let around = || self.seen.vehicle.into_iter().flat_map(|it| self.areas_around(it.position));
            let awaits = |area: &str| self.permissions.awaits_first_line(area, now);
            let not_heard_yet = around().filter(|it| it.kind == AreaKind::Permission && awaits(&it.name));
            let sources = grants.keys().map(|it| (it, self.permissions.source(it, now)));
            let sources = sources.filter(|(_, source)| *source != Source::Live);
            Permits {
                sources: sources.map(|(area, source)| (area.clone(), source)).collect(),
                around: around().map(|it| it.name.clone()).collect(),
                not_heard_yet: not_heard_yet.map(|it| it.name.clone()).collect(),
                flying: self.is_flying(),
                no_new_area: self.narrowing().no_new_area.is_some(),
                beyond: self.answer.beyond.clone(),
                grants,
            }
        })
    }

    /// The areas that a way may begin to enter, with a margin before the expiry: what the planner may count on.
    pub(super) fn enterable(&self) -> Vec<String> {
        held_for(&self.permits().to_enter(), self.setup.limits.permission_margin)
    }

    /// All areas, those that may be entered now, and what flags forbid.
    pub(crate) fn what_may_be_entered(&self) -> WhatMayBeEntered {
        WhatMayBeEntered {
            held: self.enterable(),
            areas: self.planner.areas().clone(),
            narrowing: self.narrowing(),
            comes_down: self.comes_down(),
            beyond: self.answer.beyond.clone(),
            insists: self.is_ordered_here(),
        }
    }

    pub(crate) fn begin_mission(&mut self, mission: &domain::mission::Mission) {
        self.planner.mission = FlownMission::beginning(mission);
    }

    pub(super) fn airspace<'a>(&'a self, grants: &'a Grants, lead: Duration) -> Airspace<'a> {
        Airspace {
            areas: self.planner.areas(),
            grants,
            clock: Clock { utc_ms: self.now.utc_ms, pace: self.setup.limits.pace },
            lead,
            vertical_margin_m: self.setup.limits.aircraft.flight.vertical_margin_m.get(),
            ground: &self.planner.mission.ground,
        }
    }

    /// What is wrong with flying straight from `from`, in the air, to `to` now.
    pub(super) fn breach_on_way(&self, from: Ned, to: Ned, speed_m_s: f64) -> Option<Breach> {
        let speeds = Speeds { cruise_m_s: speed_m_s, ..self.setup.limits.flight.speeds };
        let motion = Motion::in_air(speeds);
        self.airspace(&self.permits().to_enter(), self.setup.limits.leave_lead).first_breach(from, to, motion)
    }

    /// What is wrong with flying straight to `to` from where the vehicle is.
    pub(crate) fn breach_towards(&self, to: Ned, speed_m_s: f64) -> Option<Breach> {
        self.breach_on_way(self.seen.vehicle?.position, to, speed_m_s)
    }

    pub(super) fn breach_of_step(&self, step: &Step) -> Option<Breach> {
        let vehicle = self.seen.vehicle?;
        let here = vehicle.position;
        let speeds = self.flight_limits().speeds;
        let (to, speeds) = match &step.nominal.goal {
            // The height of the plan is where the climb ends, also of one that has begun.
            Goal::Takeoff { climb_m } if !vehicle.flying => (here.at_height(here.height_m() + *climb_m), speeds),
            Goal::Takeoff { .. } | Goal::Land | Goal::LandOnTarget => {
                (here.at_height(step.reaches.position.height_m()), speeds)
            }
            Goal::Position { target, speed_limit_m_s, .. } => {
                (*target, Speeds { cruise_m_s: self.slowed(*speed_limit_m_s), ..speeds })
            }
            // Not the vehicle but the load comes down from here.
            Goal::Release { .. } => {
                (here.at_height(here.height_m().min(self.planner.mission.ground.height_m(here))), Speeds::OF_A_LOAD)
            }
            Goal::Stop | Goal::Velocity { .. } | Goal::Task(_) => return None,
        };
        let motion = Motion { begins: Duration::ZERO, speeds, airborne: vehicle.flying, is_load: step.releases() };
        let permits = self.permits();
        // In the air the vehicle stops before an area: see `breach_at_rest`.
        let grants = if vehicle.flying { permits.to_stay() } else { permits.to_enter() };
        self.airspace(&grants, self.setup.limits.leave_lead).first_breach(here, to, motion)
    }

    /// What is wrong with beginning the present step where the vehicle is.
    pub(crate) fn breach_of_present_step(&self) -> Option<Breach> {
        let (step, ..) = self.planner.flight.step()?;
        self.breach_of_step(step)
    }

    /// Why the present step is too high or too low: above what the vehicle flies and the mission names, or below the ground there.
    pub(crate) fn bad_height_of_present_step(&self) -> Option<String> {
        /// An estimate of the height varies by as much. (ENG)
        const TOLERANCE_M: f64 = 1.0;
        let (step, here) = (self.planner.flight.step()?.0, self.seen.vehicle?.position);
        let height_m = match step.nominal.goal {
            Goal::Position { target, .. } => target.height_m(),
            Goal::Takeoff { climb_m } => here.height_m() + climb_m,
            Goal::Land
            | Goal::LandOnTarget
            | Goal::Stop
            | Goal::Velocity { .. }
            | Goal::Release { .. }
            | Goal::Task(_) => return None,
        };
        // It took off at 0, and one that is higher or lower already may go on at its height.
        let (mut least_m, mut most_m) =
            (here.height_m().min(0.0), here.height_m().max(self.setup.limits.flight.highest_m));
        for named_m in self.planner.named_heights_m() {
            (least_m, most_m) = (least_m.min(named_m), most_m.max(named_m));
        }
        if let Goal::Position { target, .. } = step.nominal.goal {
            let level_m = here.height_m().max(target.height_m());
            let level = (here.at_height(level_m), target.at_height(level_m));
            let into_ground = FlightLimits { least_height_m: 0.0, ..self.flight_limits() };
            if let Some(why) = self.planner.mission.ground.why_too_low(level, &into_ground) {
                return Some(why);
            }
        }
        let is_sound = (least_m - TOLERANCE_M..=most_m + TOLERANCE_M).contains(&height_m);
        (!is_sound).then(|| format!("its height would be {height_m:.0} m, expected {least_m:.0} to {most_m:.0} m"))
    }

    /// What the last check found to be wrong with the rest of the present step.
    pub(crate) fn breach_ahead(&self) -> Option<&Breach> {
        let (step, ..) = self.planner.flight.step()?;
        self.watch.airspace.step.as_ref().filter(|(id, _)| *id == step.id).map(|(_, breach)| breach)
    }

    /// When the airspace is checked next, after this moment.
    pub(crate) fn next_look(&self) -> Time {
        self.now.time + self.setup.limits.airspace_period
    }

    /// The time that the vehicle needs to leave what is around it, no matter which of that must be left: to the nearest borders, and as
    /// long as the way takes out of an area whose permission ends by then.
    pub(super) fn time_to_leave_all(&self, here: Ned) -> Duration {
        let nearest = self.areas_around(here).map(|area| self.time_to_border(area, here)).max().unwrap_or_default();
        let ends_by = |(area, way): &(&Area, Duration)| {
            !self.permissions.holds(&area.name, self.now.time, self.setup.limits.leave_lead.saturating_add(*way))
        };
        let times = &self.watch.airspace.ways_out.times;
        let ways = self.areas_around(here).filter_map(|area| Some((area, *times.get(&area.name)?)));
        let ways = ways.filter(ends_by).map(|(_, way)| way).max();
        let begun = if self.watch.airspace.breached { self.watch.airspace.leaving } else { Duration::ZERO };
        nearest.max(ways.unwrap_or_default()).max(begun)
    }

    /// The areas around the vehicle, whether or not it may be there.
    pub(super) fn areas_around(&self, here: Ned) -> impl Iterator<Item = &Area> {
        self.planner.areas().iter().filter(move |it| it.is_active(self.now.utc_ms) && it.contains(here))
    }

    /// The time to leave `area` by the nearest border, in the usual wind: less is reckoned for no way out.
    pub(super) fn time_to_border(&self, area: &Area, here: Ned) -> Duration {
        // The usual wind blows against every direction.
        let out = Ned { north_m: here.north_m + area.distance_to_border_m(here), ..here };
        with_turn(self.flight_limits().speeds.time_s(here, out))
    }

    /// The flag because of which no landing may begin at `place`, if there is one.
    pub(crate) fn landing_forbidden_by(&self, place: Ned) -> Option<&Arc<str>> {
        let (row, at) = (self.narrowing().no_landing_here?, self.landings.no_landing_at?);
        (place.horizontal_distance_m(at) < SAME_SITE_M).then(|| self.flags.name(row))
    }

    pub(super) fn why_no_landing_at(&self, place: Ned) -> Option<String> {
        Some(format!("no landing there while `{}` is up", self.landing_forbidden_by(place)?))
    }

    /// The permissions that a response could use from here on, also one that is not under way: it may enter everything that is held if it
    /// reaches no landing otherwise.
    pub(super) fn permits_of_responses(&self) -> Grants {
        if self.comes_down() { self.permits().to_enter() } else { self.permits().grants.clone() }
    }
}
