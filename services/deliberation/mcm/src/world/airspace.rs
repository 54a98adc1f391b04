//! Where the vehicle may fly now: the airspace rule, asked in every mode.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use domain::airspace::{Airspace, Breach, Clock, Grants, Motion, Why, stays};
use domain::area::{Area, AreaKind};
use domain::contingency::narrowing::Narrowing;
use domain::contingency::{AREA_AHEAD, AREA_BREACHED, Phase};
use domain::decision::DecisionKind;
use domain::geometry::Ned;
use domain::plan::{Step, StepId};
use domain::route::WORTH_FLYING_M;
use domain::skill::Goal;
use domain::speeds::Speeds;
use domain::time::Time;
use domain::way::{FlightLimits, way_out};

use super::{SELF, WayOut, World};
use crate::journal::Said;
use crate::vehicle::Vehicle;

/// A permission is asked for again this long before the vehicle would have to leave. (ENG: the tower's answer is awaited
/// for up to 30 s.)
const RENEWAL_LEAD: Duration = Duration::from_secs(60);
/// A vehicle that is slower than this holds. (ENG: what an estimate's noise and a gust do.)
const MOVES_M_S: f64 = 1.0;
/// Time to brake and to turn before the way out is flown.
const TURN: Duration = Duration::from_secs(5);
/// A way out takes longer than it is reckoned by up to this factor, as in the airspace rule.
const SLOWER: f64 = 1.25;
/// Ways out are looked for again after this. (ENG: by then a vehicle at cruise speed is ten metres farther, a fifth of what [`TURN`] allows
/// for; a search among hundreds of areas takes milliseconds.)
const WAYS_OUT_PERIOD: Duration = Duration::from_secs(1);

/// The time to turn, and for a flight of this many seconds out of an area.
fn with_turn(flight_s: f64) -> Duration {
    TURN.saturating_add(Duration::try_from_secs_f64(SLOWER * flight_s).unwrap_or(Duration::MAX))
}

/// The seconds after which the vehicle that flies `way` from `from` is in none of these areas any more.
fn time_inside_s(from: Ned, way: &[Ned], areas: &[&Area], margin_m: f64, speeds: &Speeds) -> f64 {
    let (mut begin, mut flown_s, mut inside_s) = (from, 0.0, 0.0);
    for end in way {
        let leg_s = speeds.time_s(begin, *end);
        let leaves = |area: &&Area| Some(stays(area, begin, *end, margin_m).last()?.leaves);
        if let Some(last) = areas.iter().filter_map(leaves).reduce(f64::max) {
            inside_s = flown_s + last * leg_s;
        }
        (begin, flown_s) = (*end, flown_s + leg_s);
    }
    inside_s
}

/// All areas, those that may be entered, and what flags forbid; a way is chosen again when they change.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct WhatMayBeEntered {
    held: Vec<String>,
    areas: Arc<[Area]>,
    narrowing: Narrowing,
    comes_down: bool,
    needs_held_areas: bool,
}

/// The result of the last check of the airspace.
#[derive(Debug, Default)]
pub(super) struct AirspaceWatch {
    next: Time,
    /// What is wrong with the rest of the present step.
    step: Option<(StepId, Breach)>,
    /// The vehicle is inside an area.
    inside: bool,
    /// The time that it needs to leave what is around it. While a breach lasts it does not become less: a way out that has begun is
    /// flown to its end.
    leaving: Duration,
    /// What is around it breaches the rule.
    breached: bool,
    ways_out: WaysOut,
}

/// How long the ways take out of the areas around the vehicle whose permissions end before long.
#[derive(Debug, Default)]
struct WaysOut {
    /// When they are looked for again.
    again: Time,
    /// By the names of the areas; those without a way are not in here.
    times: BTreeMap<String, Duration>,
}

impl AirspaceWatch {
    /// The next check is due at once.
    pub(super) fn invalidate(&mut self) {
        (self.next, self.ways_out.again) = (Time::ZERO, Time::ZERO);
    }

    /// Whether the vehicle was inside an area.
    pub(super) fn is_inside(&self) -> bool {
        self.inside
    }
}

impl World {
    /// The areas whose permission is held now.
    pub(super) fn held(&self) -> Vec<String> {
        self.permissions.held(self.now.time, self.limits.permission_margin)
    }

    /// Those of them that the planner may count on: while no new area may be entered, the areas around the vehicle.
    pub(super) fn held_and_usable(&self) -> Vec<String> {
        let usable = self.grants_in_use();
        self.held().into_iter().filter(|area| usable.contains_key(area)).collect()
    }

    /// All areas, those that may be entered now, and what flags forbid.
    pub(crate) fn what_may_be_entered(&self) -> WhatMayBeEntered {
        let around = self.names_around();
        WhatMayBeEntered {
            held: self.held().into_iter().filter(|it| !self.is_overdue_in(&around, it)).collect(),
            areas: self.planner.areas().clone(),
            narrowing: self.narrowing,
            comes_down: self.comes_down(),
            needs_held_areas: self.needs_held_areas,
        }
    }

    /// Flies this mission, nothing of which has been attempted.
    pub(crate) fn begin_mission(&mut self, mission: &domain::mission::Mission) {
        self.planner.begin_mission(mission);
    }

    pub(super) fn grants(&self) -> Grants {
        self.permissions.grants(self.now.time)
    }

    /// The airspace as it is now, with this lead.
    pub(super) fn airspace<'a>(&'a self, grants: &'a Grants, lead: Duration) -> Airspace<'a> {
        Airspace {
            areas: self.planner.areas(),
            grants,
            clock: Clock { utc_ms: self.now.utc_ms, pace: self.limits.pace },
            lead,
            vertical_margin_m: self.limits.vertical_margin_m,
        }
    }

    /// What is wrong with flying straight from `from`, in the air, to `to` now.
    pub(super) fn breach_on_way(&self, from: Ned, to: Ned, speed_m_s: f64) -> Option<Breach> {
        let speeds = Speeds { cruise_m_s: speed_m_s, ..self.limits.flight.speeds };
        let motion = Motion { begins: Duration::ZERO, speeds, airborne: true };
        self.airspace(&self.grants_in_use(), self.limits.leave_lead).first_breach(from, to, motion)
    }

    /// What is wrong with flying straight to `to` from where the vehicle is.
    pub(crate) fn breach_towards(&self, to: Ned, speed_m_s: f64) -> Option<Breach> {
        self.breach_on_way(self.vehicle?.position, to, speed_m_s)
    }

    /// What is wrong with beginning `step` where the vehicle is.
    fn breach_of_step(&self, step: &Step) -> Option<Breach> {
        let vehicle = self.vehicle?;
        let here = vehicle.position;
        let speeds = self.flight_limits().speeds;
        let (to, speeds) = match step.nominal.goal {
            // From the ground: where it is in the middle of the climb, the rest of it ends at the height of the plan.
            Goal::Takeoff { climb_m } if !vehicle.flying => (here.at_height(here.height_m() + climb_m), speeds),
            Goal::Takeoff { .. } | Goal::Land => (here.at_height(step.reaches.position.height_m()), speeds),
            Goal::Position { target, speed_limit_m_s, .. } => {
                (target, Speeds { cruise_m_s: self.slowed(speed_limit_m_s), ..speeds })
            }
            // Not the vehicle but the load comes down from here.
            Goal::Release { .. } => (here.at_height(here.height_m().min(0.0)), Speeds::OF_A_LOAD),
            Goal::Stop | Goal::Velocity { .. } => return None,
        };
        let motion = Motion { begins: Duration::ZERO, speeds, airborne: vehicle.flying };
        let (mut grants, around) = (self.grants(), self.names_around());
        // In the air the vehicle stops before an area: see `breach_at_rest`.
        grants.retain(|name, _| vehicle.flying || !self.is_overdue_in(&around, name));
        self.airspace(&grants, self.limits.leave_lead).first_breach(here, to, motion)
    }

    /// What is wrong with beginning the present step where the vehicle is.
    pub(crate) fn breach_of_present_step(&self) -> Option<Breach> {
        let (step, ..) = self.planner.step()?;
        self.breach_of_step(step)
    }

    /// Why the height of the present step is none to fly at: above what the vehicle flies and the mission names, or below the ground.
    pub(crate) fn bad_height_of_present_step(&self) -> Option<String> {
        /// An estimate of the height varies by as much. (ENG)
        const TOLERANCE_M: f64 = 1.0;
        let (step, here) = (self.planner.step()?.0, self.vehicle?.position);
        let height_m = match step.nominal.goal {
            Goal::Position { target, .. } => target.height_m(),
            Goal::Takeoff { climb_m } => here.height_m() + climb_m,
            Goal::Land | Goal::Stop | Goal::Velocity { .. } | Goal::Release { .. } => return None,
        };
        // It took off at 0, and one that is higher or lower already may go on at its height.
        let (mut least_m, mut most_m) = (here.height_m().min(0.0), here.height_m().max(self.limits.flight.highest_m));
        for named_m in self.planner.named_heights_m() {
            (least_m, most_m) = (least_m.min(named_m), most_m.max(named_m));
        }
        let is_sound = (least_m - TOLERANCE_M..=most_m + TOLERANCE_M).contains(&height_m);
        (!is_sound).then(|| format!("its height would be {height_m:.0} m, expected {least_m:.0} to {most_m:.0} m"))
    }

    /// What the last check found to be wrong with the rest of the present step.
    pub(crate) fn breach_ahead(&self) -> Option<&Breach> {
        let (step, ..) = self.planner.step()?;
        self.airspace_watch.step.as_ref().filter(|(id, _)| *id == step.id).map(|(_, breach)| breach)
    }

    /// When the airspace is checked next, after this moment.
    pub(crate) fn next_look(&self) -> Time {
        self.now.time + self.limits.airspace_period
    }

    /// Checks the airspace around the vehicle and ahead of it: raises the flag of a breach, asks in time for
    /// permissions that will expire, and finds what is wrong with the rest of the step.
    pub(super) fn watch_airspace(&mut self) {
        let Some(vehicle) = self.vehicle.filter(|it| it.flying) else {
            self.airspace_watch = AirspaceWatch::default();
            self.flags.condition_gone(AREA_BREACHED, SELF);
            self.flags.condition_gone(AREA_AHEAD, SELF);
            return;
        };
        if self.now.time < self.airspace_watch.next {
            return;
        }
        self.airspace_watch.next = self.next_look();
        let breach = self.breach_here(vehicle.position);
        match breach.is_none().then(|| self.breach_at_rest(vehicle)).flatten() {
            Some(why) => self.raise(AREA_AHEAD, SELF, why),
            None => self.flags.condition_gone(AREA_AHEAD, SELF),
        }
        match breach {
            // Down where it is comes before a hold in there.
            Some(_) if self.flight_phase() == Phase::Landing && matches!(self.way_out(), Some(WayOut::Stays(_))) => {}
            Some(breach) => self.raise(AREA_BREACHED, SELF, breach.in_words()),
            // One that was up before a restart is not known to be over yet.
            None if self.permissions.awaits_first_ledger(self.now.time) => {}
            None => self.flags.condition_gone(AREA_BREACHED, SELF),
        }
        let step = self.planner.step();
        self.airspace_watch.step = step.and_then(|(step, ..)| Some((step.id, self.breach_of_step(step)?)));
        self.renew_permissions(vehicle.position);
    }

    /// What is wrong with being at `here` for as long as it takes to leave.
    fn breach_here(&mut self, here: Ned) -> Option<BreachHere> {
        self.look_for_ways_out(here);
        let leaving = self.time_to_leave_all(here);
        let grants = self.grants_where_it_is(here);
        let breach = self.airspace(&grants, self.limits.leave_lead).breach_at(here, leaving);
        let is_inside = self.areas_around(here).next().is_some();
        let watch = &mut self.airspace_watch;
        (watch.inside, watch.leaving, watch.breached) = (is_inside, leaving, breach.is_some());
        breach.map(BreachHere)
    }

    /// The time that the vehicle needs to leave what is around it, no matter which of that must be left: to the nearest borders, and as
    /// long as the way takes out of an area whose permission ends by then.
    pub(super) fn time_to_leave_all(&self, here: Ned) -> Duration {
        let nearest = self.areas_around(here).map(|area| self.time_to_border(area, here)).max().unwrap_or_default();
        let ends_by = |(area, way): &(&Area, Duration)| {
            !self.permissions.holds(&area.name, self.now.time, self.limits.leave_lead.saturating_add(*way))
        };
        let times = &self.airspace_watch.ways_out.times;
        let ways = self.areas_around(here).filter_map(|area| Some((area, *times.get(&area.name)?)));
        let ways = ways.filter(ends_by).map(|(_, way)| way).max();
        let begun = if self.airspace_watch.breached { self.airspace_watch.leaving } else { Duration::ZERO };
        nearest.max(ways.unwrap_or_default()).max(begun)
    }

    /// Looks for the ways out of the areas around the vehicle whose permissions end before the longest way out could be flown: the nearest
    /// border may be closed, and wind is stronger on some ways than on others.
    fn look_for_ways_out(&mut self, here: Ned) {
        if self.now.time < self.airspace_watch.ways_out.again {
            return;
        }
        let grants = self.grants();
        let matters_for = self.longest_way_out().saturating_add(self.limits.leave_lead + RENEWAL_LEAD);
        let ending = self.areas_around(here).filter_map(|area| Some((area, *grants.get(&area.name)?)));
        let ending = ending.filter(|(_, left)| *left < matters_for);
        let times =
            ending.filter_map(|(area, left)| Some((area.name.clone(), self.way_out_after(left, here, &grants)?)));
        let times = times.collect();
        self.airspace_watch.ways_out = WaysOut { again: self.now.time + WAYS_OUT_PERIOD, times };
    }

    /// How long the way takes out of what must not be stayed in for longer than `left`; `None` without a way.
    fn way_out_after(&self, left: Duration, here: Ned, grants: &Grants) -> Option<Duration> {
        // A grant that holds for exactly the lead would still do.
        let airspace = self.airspace(grants, left.saturating_add(Duration::from_millis(1)));
        let limits = self.limits_in_wind();
        let way = way_out(here, &airspace, &limits)?;
        let ending: Vec<&Area> = airspace.trespassed(here).collect();
        Some(with_turn(time_inside_s(here, &way, &ending, airspace.vertical_margin_m, &limits.speeds)))
    }

    /// The longest way out that is flown, at the slowest speed over ground, and up to the greatest height or down from there.
    fn longest_way_out(&self) -> Duration {
        let FlightLimits { speeds, highest_m, .. } = self.limits_in_wind();
        let against_wind_m_s = (speeds.airspeed_m_s - speeds.wind.speed_m_s()).min(speeds.cruise_m_s);
        let vertical_m_s = speeds.climb_m_s.min(speeds.descent_m_s);
        with_turn(self.limits.farthest_out_m / against_wind_m_s + highest_m / vertical_m_s)
    }

    /// The permissions, and until the tower is heard after a start also those for the areas around `here`: nobody knows that they are
    /// missing, and a vehicle that was let in must not be turned out by a restart. They are for staying: no step begins by them.
    fn grants_where_it_is(&self, here: Ned) -> Grants {
        let mut grants = self.grants();
        if self.permissions.awaits_first_ledger(self.now.time) {
            let unknown = self.areas_around(here).filter(|it| it.kind == AreaKind::Permission);
            grants.extend(unknown.map(|it| (it.name.clone(), Duration::MAX)));
        }
        grants
    }

    /// The same without those for other areas that are only remembered.
    fn grants_to_go_on(&self, here: Ned) -> Grants {
        let mut grants = self.grants_where_it_is(here);
        let around: BTreeSet<&str> = self.areas_around(here).map(|it| &*it.name).collect();
        grants.retain(|name, _| !self.permissions.is_only_remembered(name) || around.contains(&**name));
        grants
    }

    /// The area that may not be entered in which `vehicle` would come to rest if it braked now, in words.
    fn breach_at_rest(&self, vehicle: Vehicle) -> Option<String> {
        let speed_m_s = vehicle.speed_m_s();
        if speed_m_s < MOVES_M_S {
            return None;
        }
        let way_m = speed_m_s * speed_m_s / (2.0 * self.limits.braking_m_s2);
        let (here, velocity, share) = (vehicle.position, vehicle.velocity, way_m / speed_m_s);
        let at_rest = Ned::new(
            here.north_m + velocity.north_m_s * share,
            here.east_m + velocity.east_m_s * share,
            here.down_m + velocity.down_m_s * share,
        );
        let speeds = Speeds::calm(speed_m_s, speed_m_s, speed_m_s);
        let motion = Motion { begins: Duration::ZERO, speeds, airborne: true };
        let grants = self.grants_to_go_on(here);
        let breach = self.airspace(&grants, Duration::ZERO).first_breach(here, at_rest, motion)?;
        // One that is held and ends soon is left by its own rule.
        let is_barred = matches!(breach.why, Why::KeepOut | Why::NotGranted);
        is_barred
            .then(|| format!("at {speed_m_s:.1} m/s it comes to rest {way_m:.0} m on, inside area {}", breach.area))
    }

    /// The areas around the vehicle, whether or not it may be there.
    pub(super) fn areas_around(&self, here: Ned) -> impl Iterator<Item = &Area> {
        self.planner.areas().iter().filter(move |it| it.is_active(self.now.utc_ms) && it.contains(here))
    }

    /// The time to leave `area` by the nearest border, in the usual wind: less is reckoned for no way out.
    fn time_to_border(&self, area: &Area, here: Ned) -> Duration {
        // The usual wind blows against every direction.
        let out = Ned { north_m: here.north_m + area.distance_to_border_m(here), ..here };
        with_turn(self.flight_limits().speeds.time_s(here, out))
    }

    /// Asks for the permissions of areas around the vehicle that would expire before it has left them, and for those that a
    /// tower has given that is gone.
    fn renew_permissions(&mut self, here: Ned) {
        let inside = self.areas_around(here).filter(|it| it.kind == AreaKind::Permission);
        let due = |area: &&Area| {
            if self.permissions.is_of_former_tower(&area.name) {
                return true;
            }
            let way = self.airspace_watch.ways_out.times.get(&area.name).copied().unwrap_or_default();
            let leaving = self.time_to_border(area, here).max(way);
            let leave_by = leaving.saturating_add(self.limits.leave_lead + RENEWAL_LEAD);
            self.permissions.holds(&area.name, self.now.time, Duration::ZERO)
                && !self.permissions.holds(&area.name, self.now.time, leave_by)
        };
        let names: BTreeSet<String> = inside.filter(due).map(|it| it.name.clone()).collect();
        let by = self.needed_by();
        for area in names {
            let why = match self.permissions.is_of_former_tower(&area) {
                true => "because the control tower was started again",
                false => "before its permission expires",
            };
            if self.permissions.renew(self.now.time, &area, by, &self.limits, &mut self.outbox) {
                let text = format!("asking for area {area} again {why}");
                self.record(Said::new("permission", DecisionKind::PermissionAsked, text).about_area(area));
            }
        }
    }

    /// The goal while there is no plan: in the direction of the step that failed, slower, and only as far as the next
    /// border that may not be crossed; otherwise stop. `None` on the ground, but for a takeoff that the autopilot has ended and would go on with.
    ///
    /// The position goal holds at its target, so that a transition never ends by itself.
    pub(crate) fn transition_goal(&self) -> Option<Goal> {
        let vehicle = self.vehicle?;
        if self.is_about_to_lift_off() || self.touches_in_landing() {
            return Some(Goal::Land);
        }
        let here = Some(vehicle).filter(|it| it.flying)?.position;
        let Some(Goal::Position { target, speed_limit_m_s, yaw_rad, .. }) = self.planner.interrupted_goal() else {
            return Some(Goal::Stop);
        };
        let speed_m_s = self.slowed(self.limits.transition.speed_m_s.min(speed_limit_m_s));
        let target = match self.breach_on_way(here, target, speed_m_s) {
            Some(breach) => self.before(here, target, &breach),
            None => Some(target).filter(|it| WORTH_FLYING_M <= here.distance_m(*it)),
        };
        let Some(target) = target else { return Some(Goal::Stop) };
        Some(Goal::Position { target, speed_limit_m_s: speed_m_s, yaw_rad, hold_at_target: true })
    }
}

/// A breach where the vehicle is.
struct BreachHere(Breach);

impl BreachHere {
    fn in_words(&self) -> String {
        let area = &self.0.area;
        match self.0.why {
            Why::KeepOut if self.0.after.is_zero() => format!("inside keep-out area {area}"),
            Why::KeepOut => format!("keep-out area {area} applies here in {} s", self.0.after.as_secs()),
            Why::NotGranted => format!("inside area {area} without permission"),
            Why::TooShort { held, .. } => format!("the permission for area {area} expires in {} s", held.as_secs()),
        }
    }
}
