//! Where the vehicle may be, and when: the one rule for plans, invariants, responses, waiting and takeoffs.
//!
//! A keep-out area is not entered while it applies, a permission area only with a grant that outlasts the stay. Leaving is
//! not entering: a vehicle in the air that is inside an area without permission does not break the rule by flying out.
//! Taking off inside an area is entering it.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::area::{Area, AreaKind};
use crate::geometry::Ned;
use crate::harm::Harm;
use crate::known_ground::KnownGround;
use crate::outline::Outline;
use crate::speeds::Speeds;
use crate::time::Pace;

/// The permissions that are held, each with the mission time for which it holds from now on.
pub type Grants = BTreeMap<String, Duration>;

/// What decides where the vehicle may be.
#[derive(Debug, Clone, Copy)]
pub struct Airspace<'a> {
    /// Every area of the mission.
    pub areas: &'a [Area],
    /// The permissions that are held.
    pub grants: &'a Grants,
    /// The moment from which all times here count.
    pub clock: Clock,
    /// A grant must outlast a stay by this time, and an area that opens within this time applies already, so that the
    /// vehicle can leave.
    pub lead: Duration,
    /// Heights this close to a floor or a ceiling count as inside, in metres.
    pub vertical_margin_m: f64,
    /// How high the ground is.
    pub ground: &'a KnownGround,
}

/// A moment, and how fast mission time runs against UTC.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    /// Milliseconds since the Unix epoch.
    pub utc_ms: i64,
    /// Mission time against UTC.
    pub pace: Pace,
}

/// How a way is flown.
#[derive(Debug, Clone, Copy)]
pub struct Motion {
    /// When it begins, from now on. All times from now on are taken as 20 % sooner or 25 % and ten seconds later.
    pub begins: Duration,
    /// How fast.
    pub speeds: Speeds,
    /// Whether the vehicle is in the air when it begins.
    pub airborne: bool,
    /// Whether it is a load that falls, and not the vehicle: it may end in water, and not near people.
    pub is_load: bool,
}

impl Motion {
    /// Of a vehicle in the air that flies on from now and does not come down.
    pub fn in_air(speeds: Speeds) -> Motion {
        Motion { begins: Duration::ZERO, speeds, airborne: true, is_load: false }
    }

    /// How far beside the straight way from `from` to `to` it may end, in metres: a load as far aside as it falls. (The 1-to-1 rule for a
    /// ground risk buffer, JARUS SORA 2.0, Annex B.)
    pub fn scatter_m(&self, from: Ned, to: Ned) -> f64 {
        if self.is_load { from.distance_m(to) } else { drift_m(from, to) }
    }
}

/// What is planned to happen after this time happens no sooner than this: 20 % sooner.
pub fn soonest(planned: Duration) -> Duration {
    planned - planned / 5
}

/// What is planned to happen after this time happens no later than this: 25 % and ten seconds later.
pub fn latest(planned: Duration) -> Duration {
    planned.saturating_add(planned / 4).saturating_add(Duration::from_secs(10))
}

/// A place and time at which the rule is broken.
#[derive(Debug, Clone, PartialEq)]
pub struct Breach {
    /// The area.
    pub area: String,
    /// What is wrong.
    pub why: Why,
    /// Where on the way it is entered, or where the vehicle is when it begins to apply.
    pub at: Ned,
    /// When, from now on.
    pub after: Duration,
}

/// What is wrong with being in an area.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Why {
    /// It is a keep-out area.
    KeepOut,
    /// Its permission is not held.
    NotGranted,
    /// Its permission expires before the end of the stay.
    TooShort {
        /// How long it is held from now on.
        held: Duration,
        /// How long it would have to be held.
        needed: Duration,
    },
}

impl std::fmt::Display for Breach {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Breach { area, why, at, after } = self;
        match why {
            Why::KeepOut => write!(f, "keep-out area {area} would be entered at {at}")?,
            Why::NotGranted => write!(f, "area {area} would be entered at {at} without permission")?,
            Why::TooShort { held, needed } => {
                let (held_s, needed_s) = (held.as_secs(), needed.as_secs());
                return write!(f, "the permission for area {area} holds for {held_s} s, {needed_s} s are needed");
            }
        }
        match after.as_secs() {
            0 => Ok(()),
            seconds => write!(f, " in {seconds} s"),
        }
    }
}

/// A part of a straight way that lies inside an area, as fractions of the way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stay {
    /// Where it begins; 0 if the way begins inside.
    pub enters: f64,
    /// Where it ends; 1 if the way ends inside.
    pub leaves: f64,
}

/// A way that leads no farther over ground is straight up or down, in metres: a vehicle holds its place as well.
pub(crate) const STRAIGHT_UP_M: f64 = 1.0;
/// A vehicle that climbs or descends straight is carried aside no farther than this, in metres. (ENG: the position skill's tolerance plus a
/// landing's drift in wind.)
const DRIFT_M: f64 = 3.0;

/// The parts of the straight way from `from` to `to` that lie inside `area`, heights within `vertical_margin_m` of its
/// floor and ceiling included. Along the border is not inside, but straight up or down within 3 m is. A way that leads over ground and
/// up or down counts at all heights between its ends: an autopilot need not climb evenly. (PX4 limits the speeds over ground and upwards
/// each by itself.)
pub fn stays(area: &Area, from: Ned, to: Ned, vertical_margin_m: f64) -> Vec<Stay> {
    match area.is_beyond(drift_m(from, to), from, to) {
        true => Vec::new(),
        false => stays_within(area, &Outline::new(area), from, to, vertical_margin_m),
    }
}

/// How far beside the way the vehicle may be carried.
pub(crate) fn drift_m(from: Ned, to: Ned) -> f64 {
    let over_ground_m = from.horizontal_distance_m(to);
    let is_straight_up = over_ground_m <= STRAIGHT_UP_M && over_ground_m < from.distance_m(to);
    if is_straight_up { DRIFT_M } else { 0.0 }
}

/// The same for an area whose outline is known.
pub fn stays_within(area: &Area, outline: &Outline, from: Ned, to: Ned, vertical_margin_m: f64) -> Vec<Stay> {
    let (lowest, highest) = heights_within(area, from, to, vertical_margin_m);
    let drift_m = drift_m(from, to);
    if highest < lowest || outline.is_beyond(drift_m, from, to) {
        return Vec::new();
    }
    let mut found: Vec<Stay> = Vec::new();
    for stretch in outline.crossings(from, to).windows(2) {
        let middle = from.towards(to, (stretch[0] + stretch[1]) / 2.0);
        if !(outline.covers(middle) || 0.0 < drift_m && outline.distance_to_border_m(middle) < drift_m) {
            continue;
        }
        let stay = Stay { enters: stretch[0].max(lowest), leaves: stretch[1].min(highest) };
        match found.last_mut() {
            _ if stay.leaves < stay.enters => {}
            Some(last) if last.leaves == stay.enters => last.leaves = stay.leaves,
            _ => found.push(stay),
        }
    }
    found
}

/// The end of the fall to `to` of a load, if what is below `area` may be harmed by it: it comes down at most `scatter_m` beside.
fn hits(area: &Area, to: Ned, scatter_m: f64) -> Vec<Stay> {
    let outline = Outline::new(area);
    let is_hit = !area.takes(Harm::AIRCRAFT) && (outline.covers(to) || outline.distance_to_border_m(to) < scatter_m);
    if is_hit { vec![Stay { enters: 1.0, leaves: 1.0 }] } else { Vec::new() }
}

/// Whether the straight way from `from` to `to` may be at the heights of `area`, by the same rule.
pub fn is_at_heights(area: &Area, from: Ned, to: Ned, vertical_margin_m: f64) -> bool {
    let (lowest, highest) = heights_within(area, from, to, vertical_margin_m);
    lowest <= highest
}

/// The fractions of a way between which its height may lie in the area's band; an empty interval if it never does.
fn heights_within(area: &Area, from: Ned, to: Ned, margin_m: f64) -> (f64, f64) {
    let floor_m = area.floor_m.map_or(f64::NEG_INFINITY, |it| it - margin_m);
    let ceiling_m = area.ceiling_m.map_or(f64::INFINITY, |it| it + margin_m);
    let (from_m, to_m) = (from.height_m(), to.height_m());
    let climb_m = to_m - from_m;
    if climb_m == 0.0 || STRAIGHT_UP_M < from.horizontal_distance_m(to) {
        let touches = floor_m <= from_m.max(to_m) && from_m.min(to_m) <= ceiling_m;
        return if touches { (0.0, 1.0) } else { (1.0, 0.0) };
    }
    let (at_floor, at_ceiling) = ((floor_m - from_m) / climb_m, (ceiling_m - from_m) / climb_m);
    (at_floor.min(at_ceiling).max(0.0), at_floor.max(at_ceiling).min(1.0))
}

impl<'a> Airspace<'a> {
    /// The areas that a vehicle in the air at `position` is in without being allowed to.
    pub fn trespassed(&self, position: Ned) -> impl Iterator<Item = &'a Area> {
        let this = *self;
        this.areas.iter().filter(move |area| {
            this.bars(area, Duration::ZERO, Duration::ZERO).is_some() && this.is_inside(area, position)
        })
    }

    /// When the last of the areas that a vehicle in the air at `position` is in without being allowed to is over; `None` if
    /// there is none, or one that has no end.
    pub fn trespass_ends(&self, position: Ned) -> Option<Duration> {
        let ends = self.trespassed(position).map(|area| self.applies(area)?.1);
        ends.collect::<Option<Vec<Duration>>>()?.into_iter().max()
    }

    /// The areas in which the vehicle must not stay for this long from now on.
    pub fn barred(&self, stay: Duration) -> Vec<&'a Area> {
        self.areas.iter().filter(|area| self.bars(area, Duration::ZERO, stay).is_some()).collect()
    }

    /// The first breach on the straight way from `from` to `to`; `None`: it may be flown.
    pub fn first_breach(&self, from: Ned, to: Ned, motion: Motion) -> Option<Breach> {
        let breaches = self.areas.iter().filter_map(|area| self.breach_of(area, from, to, motion));
        breaches.min_by_key(|breach| breach.after)
    }

    /// What is wrong with staying at `position` for this long from now on; `None`: nothing.
    pub fn breach_at(&self, position: Ned, stay: Duration) -> Option<Breach> {
        let inside = self.areas.iter().filter(|area| self.is_inside(area, position));
        let breach = |area: &Area| {
            let (why, after) = self.bars(area, Duration::ZERO, stay)?;
            Some(Breach { area: area.name.clone(), why, at: position, after })
        };
        inside.filter_map(breach).min_by_key(|breach| breach.after)
    }

    fn breach_of(&self, area: &Area, from: Ned, to: Ned, motion: Motion) -> Option<Breach> {
        let stays = match motion.is_load && area.only_bars_landings() {
            true => hits(area, to, motion.scatter_m(from, to)),
            false => stays(area, from, to, self.vertical_margin_m),
        };
        stays.into_iter().find_map(|stay| {
            let leaving = stay.enters == 0.0
                && motion.airborne
                && !motion.is_load
                && motion.begins.is_zero()
                && self.is_inside(area, from)
                && self.bars(area, Duration::ZERO, Duration::ZERO).is_some();
            if leaving {
                return None;
            }
            let planned = |fraction: f64| motion.begins.saturating_add(motion.speeds.time_to(fraction, from, to));
            let (why, after) = self.bars(area, soonest(planned(stay.enters)), latest(planned(stay.leaves)))?;
            Some(Breach { area: area.name.clone(), why, at: from.towards(to, stay.enters), after })
        })
    }

    /// Why the vehicle must not stay in `area` between two moments, and from when on; `None`: it may.
    pub fn bars(&self, area: &Area, from: Duration, until: Duration) -> Option<(Why, Duration)> {
        let latest_of_all = until.saturating_add(self.lead);
        let windows = self.windows(area).take_while(|(opens, _)| *opens <= latest_of_all);
        windows.filter(|(_, closes)| closes.is_none_or(|closes| from < closes)).find_map(|(opens, closes)| {
            let stay = closes.map_or(until, |closes| until.min(closes));
            let needed = stay.saturating_add(self.lead);
            if needed < opens {
                return None;
            }
            let why = match area.kind {
                AreaKind::KeepOut => Why::KeepOut,
                AreaKind::Permission => match self.grants.get(&area.name) {
                    None => Why::NotGranted,
                    Some(&held) if needed <= held => return None,
                    Some(&held) => Why::TooShort { held, needed },
                },
            };
            Some((why, from.max(opens)))
        })
    }

    /// Whether the vehicle must not be in `area` at any moment between these two.
    pub(crate) fn bars_throughout(&self, area: &Area, from: Duration, until: Duration) -> bool {
        let mut windows = self.windows(area).take_while(|(opens, _)| *opens <= from.saturating_add(self.lead));
        self.bars(area, from, from).is_some() && windows.any(|(_, closes)| closes.is_none_or(|closes| until <= closes))
    }

    /// From when to when an area applies now or next, in mission time from now on; `None`: it no longer applies.
    pub fn applies(&self, area: &Area) -> Option<(Duration, Option<Duration>)> {
        self.windows(area).next()
    }

    /// The windows in which an area applies, in mission time from now on.
    fn windows(&self, area: &Area) -> impl Iterator<Item = (Duration, Option<Duration>)> {
        let clock = self.clock;
        let after = move |utc_ms: i64| {
            let wall = Duration::from_millis(u64::try_from(utc_ms.saturating_sub(clock.utc_ms)).unwrap_or(0));
            clock.pace.wall(wall)
        };
        area.windows_after(clock.utc_ms).map(move |(from, until)| (after(from), until.map(after)))
    }

    fn is_inside(&self, area: &Area, position: Ned) -> bool {
        let (lowest, highest) = heights_within(area, position, position, self.vertical_margin_m);
        lowest < highest && area.covers(position)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::known_ground::LEVEL;

    pub(crate) fn area(name: &str, kind: AreaKind, corners: &[(f64, f64)]) -> Area {
        let corners = corners.iter().map(|&(north, east)| Ned::new(north, east, 0.0)).collect();
        Area { ceiling_m: Some(100.0), ..Area::new(name, kind, corners) }
    }

    /// From 100 m to 300 m east.
    pub(crate) fn square(kind: AreaKind) -> Area {
        area("A", kind, &[(-90.0, 100.0), (90.0, 100.0), (90.0, 300.0), (-90.0, 300.0)])
    }

    pub(crate) fn airspace<'a>(areas: &'a [Area], grants: &'a Grants) -> Airspace<'a> {
        let clock = Clock { utc_ms: 1_000_000, pace: Pace::REAL_TIME };
        Airspace { areas, grants, clock, lead: Duration::from_secs(30), vertical_margin_m: 2.0, ground: &LEVEL }
    }

    fn at(east: f64, height: f64) -> Ned {
        Ned::new(0.0, east, -height)
    }

    const SPEEDS: Speeds = Speeds::calm(10.0, 3.0, 1.5);
    const AIRBORNE: Motion = Motion { begins: Duration::ZERO, speeds: SPEEDS, airborne: true, is_load: false };

    #[test]
    fn a_stay_is_where_the_way_is_inside_in_all_three_dimensions() {
        #[track_caller]
        fn check(area: &Area, from: Ned, to: Ned, expected: &[(f64, f64)]) {
            let found: Vec<_> = stays(area, from, to, 0.0).iter().map(|it| (it.enters, it.leaves)).collect();
            assert_eq!(found, expected, "{from:?} to {to:?}");
        }
        let square = square(AreaKind::Permission);
        check(&square, at(0.0, 10.0), at(400.0, 10.0), &[(0.25, 0.75)]);
        check(&square, at(200.0, 10.0), at(400.0, 10.0), &[(0.0, 0.5)]);
        check(&square, at(0.0, 10.0), at(100.0, 10.0), &[]);
        check(&square, at(0.0, 110.0), at(400.0, 110.0), &[]);
        // Down through the ceiling.
        check(&square, at(200.0, 150.0), at(200.0, 50.0), &[(0.5, 1.0)]);
        // On a slant at any height between.
        check(&square, at(0.0, 150.0), at(400.0, 50.0), &[(0.25, 0.75)]);
        check(&square, at(0.0, 150.0), at(400.0, 101.0), &[]);
        // Along the border is not inside; straight up so near to it is.
        check(&square, Ned::new(90.0, 0.0, -10.0), Ned::new(90.0, 400.0, -10.0), &[]);
        check(&square, at(100.0, 0.0), at(100.0, 20.0), &[(0.0, 1.0)]);
        check(&square, at(97.5, 20.0), at(97.5, 0.0), &[(0.0, 1.0)]);
        check(&square, at(96.5, 20.0), at(96.5, 0.0), &[]);
        check(&square, at(99.0, 20.0), at(99.0, 20.0), &[]);
        // A horseshoe is entered twice.
        let horseshoe = area(
            "U",
            AreaKind::Permission,
            &[
                (50.0, 0.0),
                (50.0, 400.0),
                (-50.0, 400.0),
                (-50.0, 300.0),
                (20.0, 300.0),
                (20.0, 100.0),
                (-50.0, 100.0),
                (-50.0, 0.0),
            ],
        );
        check(
            &horseshoe,
            at(-100.0, 10.0),
            at(500.0, 10.0),
            &[(100.0 / 600.0, 200.0 / 600.0), (400.0 / 600.0, 500.0 / 600.0)],
        );
    }

    /// The breach on the way from 0 m to 400 m east, which enters after 10 s and leaves after 30 s.
    #[track_caller]
    fn check(area: Area, held_s: Option<u64>, expected: Option<&str>) {
        let areas = [area];
        let grants = held_s.map(|it| ("A".to_owned(), Duration::from_secs(it))).into_iter().collect();
        let breach = airspace(&areas, &grants).first_breach(at(0.0, 10.0), at(400.0, 10.0), AIRBORNE);
        assert_eq!(breach.map(|it| it.to_string()).as_deref(), expected);
    }

    #[test]
    fn a_grant_must_outlast_the_stay_and_the_way_out() {
        let permission = || square(AreaKind::Permission);
        check(permission(), None, Some("area A would be entered at (0, 100, 10) without permission in 8 s"));
        check(permission(), Some(78), None);
        check(permission(), Some(60), Some("the permission for area A holds for 60 s, 77 s are needed"));
        check(square(AreaKind::KeepOut), Some(900), Some("keep-out area A would be entered at (0, 100, 10) in 8 s"));
    }

    #[test]
    fn only_the_time_of_the_stay_counts() {
        let window = |from_s: Option<i64>, until_s: Option<i64>| Area {
            from_utc_ms: from_s.map(|it| 1_000_000 + it * 1000),
            until_utc_ms: until_s.map(|it| 1_000_000 + it * 1000),
            ..square(AreaKind::KeepOut)
        };
        let entered = Some("keep-out area A would be entered at (0, 100, 10) in 8 s");
        check(window(None, Some(0)), None, None);
        check(window(None, Some(5)), None, None);
        check(window(None, Some(9)), None, entered);
        check(window(Some(20), None), None, Some("keep-out area A would be entered at (0, 100, 10) in 20 s"));
        check(window(Some(60), None), None, Some("keep-out area A would be entered at (0, 100, 10) in 60 s"));
        check(window(Some(80), None), None, None);
        check(window(Some(-60), Some(60)), None, entered);
        // A permission need not outlast the window.
        let closes = Area { kind: AreaKind::Permission, ..window(None, Some(20)) };
        check(closes, Some(50), None);
    }

    #[test]
    fn hours_count_if_any_moment_of_the_stay_lies_in_them() {
        // The clock stands at 00:16:40 of Thursday, 1970-01-01. The stay counts from 8 s to 47 s, and the way out takes 30 s.
        let during = |kind: AreaKind, texts: &[&str]| Area {
            hours: Some(crate::hours::WeeklyHours::parse(texts).unwrap()),
            ..square(kind)
        };
        let closed = |texts: &[&str]| during(AreaKind::KeepOut, texts);
        check(closed(&["Thu 00:10-00:20"]), None, Some("keep-out area A would be entered at (0, 100, 10) in 8 s"));
        // It begins after 20 s, after 80 s, is over and comes again in a week.
        check(closed(&["Thu 00:17-00:20"]), None, Some("keep-out area A would be entered at (0, 100, 10) in 20 s"));
        check(closed(&["Thu 00:18-00:20"]), None, None);
        check(closed(&["Thu 00:10-00:16"]), None, None);
        // The first window is over before the area is entered, the second one is not.
        let areas = [closed(&["Thu 00:00-00:17", "Thu 00:18-00:20"])];
        let grants = Grants::new();
        let airspace = airspace(&areas, &grants);
        let bars = |from_s, until_s| {
            let bars = airspace.bars(&areas[0], Duration::from_secs(from_s), Duration::from_secs(until_s));
            bars.map(|(_, after)| after.as_secs())
        };
        assert_eq!((bars(0, 5), bars(20, 40), bars(20, 50), bars(90, 95)), (Some(0), None, Some(80), Some(90)));
        assert_eq!(bars(200, 300), None);
        // A week later it closes again, and in a year nobody tells hours apart.
        assert_eq!(bars(7 * 86_400, 7 * 86_400 + 10), Some(7 * 86_400));
        assert_eq!(bars(365 * 86_400, 365 * 86_400 + 1), Some(365 * 86_400));
        // With a permission for as long as both windows last it is entered, whatever comes later.
        let held = |held_s| [("A".to_owned(), Duration::from_secs(held_s))].into_iter().collect::<Grants>();
        let areas = [during(AreaKind::Permission, &["Thu 00:00-00:17", "Thu 00:18-00:20"])];
        for (held_s, expected) in [(49, true), (50, true), (100, false)] {
            let grants = held(held_s);
            let airspace = Airspace { areas: &areas, grants: &grants, ..airspace };
            let is_barred = airspace.bars(&areas[0], Duration::ZERO, Duration::from_secs(60)).is_some();
            assert_eq!(is_barred, expected, "{held_s} s");
        }
        assert_eq!(airspace.applies(&areas[0]), Some((Duration::ZERO, Some(Duration::from_secs(20)))));
    }

    #[test]
    fn leaving_is_not_entering_but_lifting_off_is() {
        #[track_caller]
        fn check(from: Ned, to: Ned, airborne: bool, is_free: bool) {
            let (areas, grants) = ([square(AreaKind::Permission)], Grants::new());
            let breach = airspace(&areas, &grants).first_breach(from, to, Motion { airborne, ..AIRBORNE });
            assert_eq!(breach.is_none(), is_free, "{from:?} to {to:?}: {breach:?}");
        }
        check(at(200.0, 10.0), at(400.0, 10.0), true, true);
        check(at(200.0, 10.0), at(200.0, 150.0), true, true);
        check(at(200.0, 0.0), at(200.0, 10.0), false, false);
        check(at(50.0, 0.0), at(50.0, 10.0), false, true);
        check(at(400.0, 10.0), at(200.0, 10.0), true, false);
    }

    #[test]
    fn an_area_that_begins_to_apply_over_the_vehicle_is_a_breach_then() {
        let areas = [Area { from_utc_ms: Some(1_020_000), ..square(AreaKind::KeepOut) }];
        let grants = Grants::new();
        let airspace = airspace(&areas, &grants);
        let earlier = Airspace { clock: Clock { utc_ms: 980_000, ..airspace.clock }, ..airspace };
        assert_eq!(earlier.trespassed(at(200.0, 10.0)).count(), 0);
        assert_eq!(earlier.breach_at(at(200.0, 10.0), Duration::from_secs(5)), None);
        let breach = earlier.breach_at(at(200.0, 10.0), Duration::from_secs(60)).unwrap();
        assert_eq!((breach.why, breach.after), (Why::KeepOut, Duration::from_secs(40)));
        let later = airspace;
        assert_eq!(later.trespassed(at(200.0, 10.0)).count(), 1);
        // The vertical margin counts as inside, a little more does not.
        assert_eq!(later.trespassed(at(200.0, 101.9)).count(), 1);
        assert_eq!(later.trespassed(at(200.0, 102.1)).count(), 0);
    }

    #[test]
    fn windows_are_wall_time_and_grants_are_mission_time() {
        let areas = [Area { from_utc_ms: Some(1_010_000), ..square(AreaKind::KeepOut) }];
        let grants = Grants::new();
        let clock = Clock { utc_ms: 1_000_000, pace: Pace::new(20.0).unwrap() };
        let fast = Airspace { clock, ..airspace(&areas, &grants) };
        // Ten seconds of wall time are 200 s of mission time: the way is flown by then.
        assert_eq!(fast.first_breach(at(0.0, 10.0), at(400.0, 10.0), AIRBORNE), None);
    }
}
