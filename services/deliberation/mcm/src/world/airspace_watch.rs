//! Looks at the airspace around and ahead of the vehicle.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use domain::airspace::{Breach, Grants, Motion, Why, stays};
use domain::area::{Area, AreaKind};
use domain::contingency::{AREA_AHEAD, AREA_BREACHED, Phase};
use domain::decision::DecisionKind;
use domain::geometry::Ned;
use domain::plan::StepId;
use domain::speeds::Speeds;
use domain::time::Time;
use domain::way::{FlightLimits, way_out};

use super::airspace::with_turn;
use super::narrowing::MOVES_M_S;
use super::{SELF, WayOut, World};
use crate::journal::Said;
use crate::vehicle::Vehicle;

/// A permission is asked for again this long before the vehicle would have to leave. (ENG: the tower's answer is awaited
/// for up to 30 s.)
const RENEWAL_LEAD: Duration = Duration::from_secs(60);
/// Ways out are looked for again after this. (ENG: by then a vehicle at cruise speed is ten metres farther, a fifth of what [`TURN`] allows
/// for; a search among hundreds of areas takes milliseconds.)
const WAYS_OUT_PERIOD: Duration = Duration::from_secs(1);

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

/// The result of the last check of the airspace.
#[derive(Debug, Default)]
pub(super) struct AirspaceWatch {
    next: Time,
    pub(super) step: Option<(StepId, Breach)>,
    pub(super) inside: bool,
    /// The time that it needs to leave what is around it. While a breach lasts it does not become less: a way out that has begun is
    /// flown to its end.
    pub(super) leaving: Duration,
    /// What is around it breaches the rule.
    pub(super) breached: bool,
    pub(super) ways_out: WaysOut,
}

/// How long the ways take out of the areas around the vehicle whose permissions end before long.
#[derive(Debug, Default)]
pub(super) struct WaysOut {
    again: Time,
    /// By the names of the areas; those without a way are not in here.
    pub(super) times: BTreeMap<String, Duration>,
}

impl AirspaceWatch {
    /// The next check is due at once.
    pub(super) fn invalidate(&mut self) {
        (self.next, self.ways_out.again) = (Time::ZERO, Time::ZERO);
    }
}

impl World {
    /// Checks the airspace around and ahead of the vehicle: raises the flag of a breach, asks in time for
    /// permissions that will expire, and finds what is wrong with the rest of the step.
    pub(super) fn watch_airspace(&mut self) {
        let Some(vehicle) = self.seen.vehicle.filter(|it| it.flying) else {
            self.watch.airspace = AirspaceWatch::default();
            self.flags.condition_gone(AREA_BREACHED, SELF);
            self.flags.condition_gone(AREA_AHEAD, SELF);
            return;
        };
        if self.now.time < self.watch.airspace.next {
            return;
        }
        self.watch.airspace.next = self.next_look();
        let breach = self.breach_here(vehicle.position);
        match breach.is_none().then(|| self.breach_at_rest(vehicle)).flatten() {
            Some(why) => self.raise(AREA_AHEAD, SELF, why),
            None => self.flags.condition_gone(AREA_AHEAD, SELF),
        }
        match breach {
            // Down where it is comes before a hold in there.
            Some(_) if self.flight_phase() == Phase::Landing && matches!(self.way_out(), Some(WayOut::Stays(_))) => {}
            Some(breach) => self.raise(AREA_BREACHED, SELF, in_words(&breach)),
            // One that was up before a restart is not known to be over yet.
            None if self.permissions.awaits_first_ledger(self.now.time) => {}
            None => self.flags.condition_gone(AREA_BREACHED, SELF),
        }
        let step = self.planner.flight.step();
        self.watch.airspace.step = step.and_then(|(step, ..)| Some((step.id, self.breach_of_step(step)?)));
        self.renew_permissions(vehicle.position);
    }

    /// What is wrong with being at `here` for as long as it takes to leave.
    fn breach_here(&mut self, here: Ned) -> Option<Breach> {
        self.look_for_ways_out(here);
        let leaving = self.time_to_leave_all(here);
        let grants = self.permits().to_stay();
        let breach = self.airspace(&grants, self.setup.limits.leave_lead).breach_at(here, leaving);
        let is_inside = self.areas_around(here).next().is_some();
        let watch = &mut self.watch.airspace;
        (watch.inside, watch.leaving, watch.breached) = (is_inside, leaving, breach.is_some());
        breach
    }

    /// Looks for the ways out of the areas around the vehicle whose permissions end before the longest way out could be flown: the nearest
    /// border may be closed, and wind is stronger on some ways than on others.
    fn look_for_ways_out(&mut self, here: Ned) {
        if self.now.time < self.watch.airspace.ways_out.again {
            return;
        }
        let grants = &self.permits().grants;
        let matters_for = self.longest_way_out().saturating_add(self.setup.limits.leave_lead + RENEWAL_LEAD);
        let ending = self.areas_around(here).filter_map(|area| Some((area, *grants.get(&area.name)?)));
        let ending = ending.filter(|(_, left)| *left < matters_for);
        let times =
            ending.filter_map(|(area, left)| Some((area.name.clone(), self.way_out_after(left, here, grants)?)));
        let times = times.collect();
        self.watch.airspace.ways_out = WaysOut { again: self.now.time + WAYS_OUT_PERIOD, times };
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
        with_turn(self.setup.limits.config.farthest_out_m.get() / against_wind_m_s + highest_m / vertical_m_s)
    }

    /// The area that may not be entered in which `vehicle` would come to rest if it braked now, in words.
    pub(super) fn breach_at_rest(&self, vehicle: Vehicle) -> Option<String> {
        let speed_m_s = vehicle.speed_m_s();
        if speed_m_s < MOVES_M_S {
            return None;
        }
        let way_m = speed_m_s * speed_m_s / (2.0 * self.setup.limits.config.braking_m_s2.get());
        let (here, velocity, share) = (vehicle.position, vehicle.velocity, way_m / speed_m_s);
        let at_rest = Ned::new(
            here.north_m + velocity.north_m_s * share,
            here.east_m + velocity.east_m_s * share,
            here.down_m + velocity.down_m_s * share,
        );
        let speeds = Speeds::calm(speed_m_s, speed_m_s, speed_m_s);
        let motion = Motion::in_air(speeds);
        let grants = self.permits().to_continue();
        let breach = self.airspace(&grants, Duration::ZERO).first_breach(here, at_rest, motion)?;
        // One that is held and ends soon is left by its own rule.
        let is_barred = matches!(breach.why, Why::KeepOut | Why::NotGranted);
        is_barred
            .then(|| format!("at {speed_m_s:.1} m/s it comes to rest {way_m:.0} m on, inside area {}", breach.area))
    }

    /// The areas over home whose permission is held, and would expire before the vehicle is back.
    fn due_to_come_back(&self, here: Ned) -> impl Iterator<Item = &Area> {
        let home = Ned::default();
        let speeds = self.limits_in_wind().speeds;
        let back_s = speeds.time_along_s(here, &[home.at_height(here.height_m()), home]);
        let back_by = with_turn(back_s).saturating_add(self.setup.limits.leave_lead + RENEWAL_LEAD);
        self.areas_around(home).filter(move |area| {
            area.kind == AreaKind::Permission
                && self.permissions.holds(&area.name, self.now.time, Duration::ZERO)
                && !self.permissions.holds(&area.name, self.now.time, back_by)
        })
    }

    /// Asks for the permissions of areas around the vehicle that would expire before it has left them, and around home before it is back, and
    /// for those that were given before the tower or this process was started.
    fn renew_permissions(&mut self, here: Ned) {
        let inside = self.areas_around(here).filter(|it| it.kind == AreaKind::Permission);
        let due = |area: &&Area| {
            if self.permissions.why_to_confirm(&area.name, self.now.time).is_some() {
                return true;
            }
            let way = self.watch.airspace.ways_out.times.get(&area.name).copied().unwrap_or_default();
            let leaving = self.time_to_border(area, here).max(way);
            let leave_by = leaving.saturating_add(self.setup.limits.leave_lead + RENEWAL_LEAD);
            self.permissions.holds(&area.name, self.now.time, Duration::ZERO)
                && !self.permissions.holds(&area.name, self.now.time, leave_by)
        };
        let due = inside.filter(due).chain(self.due_to_come_back(here));
        let names: BTreeSet<String> = due.map(|it| it.name.clone()).collect();
        let by = self.needed_by();
        for area in names {
            let why = self.permissions.why_to_confirm(&area, self.now.time).unwrap_or("before its permission expires");
            if self.permissions.renew(self.now.time, &area, by, &mut self.out.outbox) {
                let text = format!("asking for area {area} again {why}");
                self.record(Said::new("permission", DecisionKind::PermissionAsked, text).about_area(area));
            }
        }
    }
}

/// What is wrong where the vehicle is.
fn in_words(Breach { area, why, after, .. }: &Breach) -> String {
    match why {
        Why::KeepOut if after.is_zero() => format!("inside keep-out area {area}"),
        Why::KeepOut => format!("keep-out area {area} applies here in {} s", after.as_secs()),
        Why::NotGranted => format!("inside area {area} without permission"),
        Why::TooShort { held, .. } => format!("the permission for area {area} expires in {} s", held.as_secs()),
    }
}
