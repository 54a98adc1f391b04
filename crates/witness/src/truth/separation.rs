//! Keeping away from other traffic.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::fmu::{TrafficKind, TransponderReport};
use domain::geometry::Ned;
use domain::time::Time;
use vehicle_sim::truth::Truth;

use super::View;
use super::landing::AT_ONCE;

pub(super) const IN_WORDS: &str = "comes no nearer than 152 m over ground and 30 m in height to a crewed aircraft that was reported 40 s before \
     (ASTM F3442: 500 ft and 100 ft are a near mid-air collision), does not take off into its way, and does not land within 30 m of traffic, or \
     within 10 m of an aircraft without people, unless it cannot fly on. What is parked is in nobody's way. Nearer than 610 m and 76 m (2000 ft and 250 ft, well clear) is counted";

/// A near mid-air collision, and well clear: over ground, in height.
const COLLISION_M: (f64, f64) = (152.0, 30.0);
const WELL_CLEAR_M: (f64, f64) = (610.0, 76.0);
/// Who is warned for that long can be elsewhere: 10 m/s sideways make 400 m, 1.5 m/s downwards 60 m.
const WARNED: Duration = Duration::from_secs(40);
/// A takeoff that has begun lifts off within this. (ENG: two reports, the second for which the row waits, and the motors.)
const NOTICED: Duration = Duration::from_secs(4);
/// How far ahead a takeoff must be clear. (The monitor's `AHEAD_S`.)
const AHEAD_S: f64 = 60.0;
/// A ship's length, or a rotor's wash; what a landing is off by.
const BESIDE_M: f64 = 30.0;
const BESIDE_UNCREWED_M: f64 = 10.0;
/// What is slower than this no higher above the ground than that is parked.
const PARKED: (f64, f64) = (0.5, 5.0);

#[derive(Debug, Default)]
pub(super) struct Separation {
    others: BTreeMap<String, Other>,
    /// Since when a crewed aircraft has been on its way to where the vehicle stands.
    coming: BTreeMap<String, Time>,
    well_clear_lost: u32,
}

#[derive(Debug)]
struct Other {
    /// When it was reported first while the vehicle flew.
    since: Time,
    lost_well_clear: bool,
    told: bool,
}

impl Separation {
    pub(super) fn well_clear_lost(&self) -> u32 {
        self.well_clear_lost
    }

    pub(super) fn see(&mut self, view: &View<'_>) -> Option<String> {
        let (now, truth) = (view.heard.now.time, view.truth);
        if view.touched_down() {
            let beside = truth.traffic.iter().find(|it| {
                let known_since = self.others.get(&it.id).map(|it| it.since);
                let beside_m = if it.kind == TrafficKind::Uncrewed { BESIDE_UNCREWED_M } else { BESIDE_M };
                it.position.horizontal_distance_m(truth.position) < beside_m
                    && known_since.is_some_and(|it| it + WARNED < now)
            });
            if let Some(it) = beside.filter(|_| !AT_ONCE.contains(&view.heard.manager.acting.as_str())) {
                return Some(format!(
                    "it landed {:.0} m from `{}`",
                    it.position.horizontal_distance_m(truth.position),
                    it.id
                ));
            }
        }
        if truth.standing {
            self.others.clear();
            let before = std::mem::take(&mut self.coming);
            let since = |it: &TransponderReport| before.get(&it.id).copied().unwrap_or(now);
            let coming = crewed(truth).filter(|it| comes_near(it, truth));
            self.coming = coming.map(|it| (it.id.clone(), since(it))).collect();
            return None;
        }
        if view.lifted_off()
            && let Some(it) = crewed(truth).find(|it| self.is_noticed(it, now) && comes_near(it, truth))
        {
            return Some(format!(
                "it took off while `{}` was on its way here, {:.0} m away",
                it.id,
                away_m(it, truth).0
            ));
        }
        truth.traffic.iter().filter_map(|it| self.meets(now, it, truth)).next().filter(|_| view.heard.flies_itself)
    }

    fn is_noticed(&self, it: &TransponderReport, now: Time) -> bool {
        self.coming.get(&it.id).is_some_and(|since| *since + NOTICED < now)
    }

    fn meets(&mut self, now: Time, it: &TransponderReport, truth: &Truth) -> Option<String> {
        let new = Other { since: now, lost_well_clear: false, told: false };
        let known = self.others.entry(it.id.clone()).or_insert(new);
        let (over_ground_m, height_m) = away_m(it, truth);
        let within = |(over_ground, height): (f64, f64)| over_ground_m < over_ground && height_m < height;
        if it.kind != TrafficKind::Crewed || is_parked(it, truth) {
            return None;
        }
        if within(WELL_CLEAR_M) && !std::mem::replace(&mut known.lost_well_clear, true) {
            self.well_clear_lost += 1;
        }
        let collides = within(COLLISION_M) && known.since + WARNED < now && !std::mem::replace(&mut known.told, true);
        collides.then(|| {
            let warned_s = (now - known.since).as_secs_f64();
            format!(
                "`{}` passed within {over_ground_m:.0} m and {height_m:.0} m of height, reported for {warned_s:.0} s",
                it.id
            )
        })
    }
}

fn crewed(truth: &Truth) -> impl Iterator<Item = &TransponderReport> {
    truth.traffic.iter().filter(|it| it.kind == TrafficKind::Crewed && !is_parked(it, truth))
}

/// Whether it stands on the ground of the take-off point, or on that below the vehicle.
fn is_parked(it: &TransponderReport, truth: &Truth) -> bool {
    let (speed_m_s, height_m) = PARKED;
    it.velocity.speed_m_s() < speed_m_s && it.position.height_m() < truth.ground_m.max(0.0) + height_m
}

/// Over ground, and in height.
fn away_m(it: &TransponderReport, truth: &Truth) -> (f64, f64) {
    let height_m = it.position.height_m() - truth.position.height_m();
    (it.position.horizontal_distance_m(truth.position), height_m.abs())
}

/// Whether it is well clear neither now nor soon, if it flies on straight.
fn comes_near(it: &TransponderReport, truth: &Truth) -> bool {
    let (over_ground_m, height_m) = WELL_CLEAR_M;
    let soon = (0..=AHEAD_S as u32).map(|second| {
        let flown = |from: f64, speed: f64| from + speed * f64::from(second);
        let (north, east) = (it.velocity.north_m_s, it.velocity.east_m_s);
        Ned { north_m: flown(it.position.north_m, north), east_m: flown(it.position.east_m, east), ..it.position }
    });
    let nearest_m = soon.map(|at| at.horizontal_distance_m(truth.position)).fold(f64::INFINITY, f64::min);
    nearest_m < COLLISION_M.0.min(over_ground_m) && away_m(it, truth).1 < height_m
}
