//! Other traffic: aircraft with and without people in them, ships and boats; how near it comes, and which places it takes.
//!
//! How near something comes does not depend on how the vehicle answers: the least that was found counts until it has passed and flies away
//! straight, or is gone. The echo of the vehicle's own transponder does not count. What stands takes a place or a piece of air, which
//! is an area that nothing enters; it comes no nearer.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::area::Area;
use domain::contingency::snapshot::NO_TRAFFIC_M;
use domain::fmu::{LocalPosition, TrafficKind, TransponderReport};
use domain::geometry::{Ned, NedVelocity};
use domain::time::{Pace, Time};
use domain::traffic::{AHEAD_S, Mover, WellClear};

mod place;
mod track;

use track::Track;

/// Traffic that is not reported for this wall time is not there any more. (ENG: ten reports at 1 Hz; ASTM F3442 has those of a
/// receiver at 1 Hz.)
const GONE: Duration = Duration::from_secs(10);
/// No receiver reports more aircraft than this; a flood of reports takes no more memory.
const MOST: usize = 256;
/// The introspection has at most this many that come near, and this many that stand. (ENG)
const MOST_TOLD: usize = 16;
/// What comes no nearer than this many times well clear is not told. (ENG)
const TOLD_WITHIN: f64 = 4.0;

/// Where the vehicle is, and how it may move.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Own<'a> {
    pub(crate) local: &'a LocalPosition,
    /// Where its mission leads next, and how fast, in metres per second: the same while a response flies.
    pub(crate) intends: Option<(Ned, f64)>,
}

/// The traffic that was reported last.
#[derive(Debug, Clone, Default)]
pub(crate) struct Traffic {
    tracks: BTreeMap<String, Track>,
    /// The ids of the vehicle's own transponders.
    own_ids: Vec<String>,
}

impl Traffic {
    /// Without any yet. Reports of these ids are the vehicle's own.
    pub(crate) fn except(own_ids: &[String]) -> Traffic {
        Traffic { tracks: BTreeMap::new(), own_ids: own_ids.to_vec() }
    }

    /// Something was reported.
    pub(crate) fn hear(&mut self, now: Time, pace: Pace, own: Option<Own<'_>>, report: TransponderReport) {
        self.tracks.retain(|_, it| now - it.reported_at < pace.wall(GONE));
        if self.own_ids.contains(&report.id) {
            return;
        }
        let has_room = self.tracks.len() < MOST;
        match self.tracks.get_mut(&report.id) {
            Some(known) => known.hear(now, own, report),
            None if !has_room => {}
            None => {
                self.tracks.insert(report.id.clone(), Track::new(now, own, report));
            }
        }
    }

    /// The least distance over ground to traffic of this kind near the height of `own`, in metres, now or soon.
    pub(crate) fn closest_approach_m(&self, now: Time, pace: Pace, own: Own<'_>, kind: TrafficKind) -> f64 {
        let moving = self.moving(now, pace).filter(|it| it.report.kind == kind);
        moving.map(|it| it.approach_m(now, own)).fold(NO_TRAFFIC_M, f64::min)
    }

    /// What comes near, as it is now, the nearest first.
    pub(crate) fn near(&self, now: Time, pace: Pace, own: Own<'_>) -> Vec<Mover> {
        let share = |it: &Track| {
            let own_height_m = own.local.position.height_m();
            it.approach_m(now, own) / WellClear::of(it.report.kind, own_height_m).over_ground_m
        };
        let moving = self.moving(now, pace).map(|it| (share(it), it));
        let mut near: Vec<(f64, &Track)> = moving.filter(|(share, _)| *share < TOLD_WITHIN).collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let told = near.into_iter().take(MOST_TOLD);
        told.map(|(_, it)| Mover { id: it.report.id.clone(), ..it.mover(now) }).collect()
    }

    /// The areas that are taken by what stands.
    pub(crate) fn occupied(&self, now: Time, pace: Pace) -> Vec<Area> {
        self.heard(now, pace).filter_map(|it| it.takes(now, pace)).take(MOST_TOLD).collect()
    }

    fn moving(&self, now: Time, pace: Pace) -> impl Iterator<Item = &Track> {
        self.heard(now, pace).filter(move |it| !it.stands(now, pace))
    }

    fn heard(&self, now: Time, pace: Pace) -> impl Iterator<Item = &Track> {
        self.tracks.values().filter(move |it| !it.is_own() && now - it.at < pace.wall(GONE))
    }
}

/// The least distance over ground from `own`, which moves so for this many seconds and then stays, within the next [`AHEAD_S`]; far,
/// where `other` is well clear by its height.
fn least_m(other: &Mover, own: Ned, velocity: NedVelocity, for_s: f64) -> f64 {
    let height_m = WellClear::of(other.kind, own.height_m()).height_m;
    let own_at = |seconds: f64| {
        let flown_s = seconds.min(for_s);
        Ned::new(
            own.north_m + velocity.north_m_s * flown_s,
            own.east_m + velocity.east_m_s * flown_s,
            own.down_m + velocity.down_m_s * flown_s,
        )
    };
    let above_m = |seconds: f64| (own_at(seconds).down_m - other.after(seconds).down_m).abs();
    let nearest = |times_s: &mut dyn Iterator<Item = f64>| {
        let away = |seconds: f64| (own_at(seconds).horizontal_distance_m(other.after(seconds)), seconds);
        let (away_m, then_s) = times_s.map(away).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((NO_TRAFFIC_M, 0.0));
        if above_m(0.0).min(above_m(then_s)) <= height_m { away_m } else { NO_TRAFFIC_M }
    };
    if other.turn_rad_s != 0.0 {
        return nearest(&mut (0..=AHEAD_S as u32).step_by(2).map(f64::from));
    }
    // Both fly straight, until the vehicle stays.
    let closest_s = |from_s: f64, until_s: f64, ours: NedVelocity| {
        let (here, there) = (own_at(from_s), other.after(from_s));
        let (north_m, east_m) = (there.north_m - here.north_m, there.east_m - here.east_m);
        let north_m_s = other.velocity.north_m_s - ours.north_m_s;
        let east_m_s = other.velocity.east_m_s - ours.east_m_s;
        let square = north_m_s * north_m_s + east_m_s * east_m_s;
        let after_s = if square > 0.0 { -(north_m * north_m_s + east_m * east_m_s) / square } else { 0.0 };
        from_s + after_s.clamp(0.0, until_s - from_s)
    };
    let turn_s = for_s.min(AHEAD_S);
    let times_s = [closest_s(0.0, turn_s, velocity), closest_s(turn_s, AHEAD_S, NedVelocity::default())];
    nearest(&mut times_s.into_iter())
}

#[cfg(test)]
mod tests;
