//! How close other traffic comes: aircraft with and without people in them, ships and boats.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::contingency::snapshot::NO_TRAFFIC_M;
use domain::fmu::{LocalPosition, TrafficKind, TransponderReport};
use domain::geometry::Ned;
use domain::time::{Pace, Time};

/// An aircraft that is not reported for this wall time is not there any more. (ENG: ten reports at 1 Hz; ASTM F3442 has those of a
/// receiver at 1 Hz.)
const GONE: Duration = Duration::from_secs(10);
/// How far ahead both are thought to fly on. (ENG: ArduPilot warns 30 s ahead; twice that for a vehicle that is slow.)
const AHEAD_S: f64 = 60.0;
/// Aircraft with people in them that are farther above or below are not near. (ASTM F3442: well clear is 250 ft.)
const CREWED_HEIGHT_M: f64 = 76.0;
/// The same for others. (ArduPilot: UAV_Z 25 m.)
const UNCREWED_HEIGHT_M: f64 = 25.0;
/// No receiver reports more aircraft than this; a flood of reports takes no more memory.
const MOST: usize = 256;

/// The aircraft that were reported last.
#[derive(Debug, Clone, Default)]
pub(crate) struct Traffic {
    aircraft: BTreeMap<String, Heard>,
}

/// What was reported of an aircraft.
#[derive(Debug, Clone)]
struct Heard {
    report: TransponderReport,
    /// When it said something new.
    at: Time,
    /// When it was reported last, with something new or without.
    reported_at: Time,
}

impl Traffic {
    /// An aircraft was reported.
    pub(crate) fn hear(&mut self, now: Time, pace: Pace, report: TransponderReport) {
        self.aircraft.retain(|_, it| now - it.reported_at < pace.wall(GONE));
        // An aircraft that has speed but repeats its position is frozen: it has flown on, and counts as silent since its last new report.
        let moves = 0.0 < report.velocity.north_m_s.hypot(report.velocity.east_m_s);
        let has_room = self.aircraft.len() < MOST;
        match self.aircraft.get_mut(&report.id) {
            Some(known) if moves && known.report == report => known.reported_at = now,
            None if !has_room => {}
            _ => {
                self.aircraft.insert(report.id.clone(), Heard { report, at: now, reported_at: now });
            }
        }
    }

    /// The least distance over ground to traffic of this kind near the height of `own`, in metres, now or soon if both go on as they do.
    pub(crate) fn closest_approach_m(&self, now: Time, pace: Pace, own: &LocalPosition, kind: TrafficKind) -> f64 {
        let heard = self.aircraft.values().filter(|it| it.report.kind == kind && now - it.at < pace.wall(GONE));
        let distances = heard.filter_map(|it| approach_m(now, it.at, &it.report, own));
        distances.fold(NO_TRAFFIC_M, f64::min)
    }
}

/// The least distance to the aircraft reported at `at`; `None` if it is far above or below.
fn approach_m(now: Time, at: Time, report: &TransponderReport, own: &LocalPosition) -> Option<f64> {
    let (theirs, ours) = (report.velocity, own.velocity);
    let age_s = (now - at).as_secs_f64();
    let from = Ned::new(
        report.position.north_m + theirs.north_m_s * age_s - own.position.north_m,
        report.position.east_m + theirs.east_m_s * age_s - own.position.east_m,
        report.position.down_m + theirs.down_m_s * age_s - own.position.down_m,
    );
    let (north_m_s, east_m_s) = (theirs.north_m_s - ours.north_m_s, theirs.east_m_s - ours.east_m_s);
    let square = north_m_s * north_m_s + east_m_s * east_m_s;
    let nearest_s = if square > 0.0 { -(from.north_m * north_m_s + from.east_m * east_m_s) / square } else { 0.0 };
    let nearest_s = nearest_s.clamp(0.0, AHEAD_S);
    let then_down_m = from.down_m + (theirs.down_m_s - ours.down_m_s) * nearest_s;
    let near_m = match report.kind {
        TrafficKind::Crewed => CREWED_HEIGHT_M,
        TrafficKind::Uncrewed => UNCREWED_HEIGHT_M,
        // Who is below may be hit by what falls, from whatever height.
        TrafficKind::Vessel => f64::INFINITY,
    };
    let is_near = from.down_m.abs().min(then_down_m.abs()) <= near_m;
    is_near.then(|| (from.north_m + north_m_s * nearest_s).hypot(from.east_m + east_m_s * nearest_s))
}

#[cfg(test)]
mod tests {
    use domain::geometry::NedVelocity;

    use super::*;

    fn own() -> LocalPosition {
        LocalPosition {
            position: Ned::new(0.0, 0.0, -50.0),
            velocity: NedVelocity::new(10.0, 0.0, 0.0),
            heading_rad: 0.0,
            horizontal_valid: true,
            vertical_valid: true,
            eph_m: 0.4,
            epv_m: 0.6,
            timestamp_us: 0,
        }
    }

    fn crewed(id: &str, position: Ned, velocity: NedVelocity) -> TransponderReport {
        TransponderReport { id: id.into(), position, velocity, kind: TrafficKind::Crewed }
    }

    #[test]
    fn each_kind_counts_for_itself_and_within_its_heights() {
        let (mut traffic, pace) = (Traffic::default(), Pace::REAL_TIME);
        let other = |id: &str, north_m: f64, height_m: f64, kind| TransponderReport {
            kind,
            ..crewed(id, Ned::new(north_m, 0.0, -height_m), NedVelocity::new(10.0, 0.0, 0.0))
        };
        // The vehicle is at 50 m.
        traffic.hear(Time::ZERO, pace, other("helicopter", 300.0, 120.0, TrafficKind::Crewed));
        traffic.hear(Time::ZERO, pace, other("drone", 200.0, 76.0, TrafficKind::Uncrewed));
        traffic.hear(Time::ZERO, pace, other("nearer drone", 250.0, 70.0, TrafficKind::Uncrewed));
        traffic.hear(Time::ZERO, pace, other("ship", 100.0, -20.0, TrafficKind::Vessel));
        let nearest_m = |kind| traffic.closest_approach_m(Time::ZERO, pace, &own(), kind);
        let kinds = [TrafficKind::Crewed, TrafficKind::Uncrewed, TrafficKind::Vessel];
        assert_eq!(kinds.map(nearest_m), [300.0, 250.0, 100.0]);
    }

    #[test]
    fn the_closest_approach_is_that_of_straight_flight() {
        /// An aircraft so reported two seconds ago.
        #[track_caller]
        fn check(position: Ned, velocity: NedVelocity, expected_m: f64) {
            let (mut traffic, pace) = (Traffic::default(), Pace::REAL_TIME);
            traffic.hear(Time::ZERO, pace, crewed("a", position, velocity));
            let two_s = Time::after(Duration::from_secs(2));
            let found_m = traffic.closest_approach_m(two_s, pace, &own(), TrafficKind::Crewed);
            assert!((found_m - expected_m).abs() < 1e-6, "{found_m}");
        }
        let at = |north_m, east_m| Ned::new(north_m, east_m, -60.0);
        // Head on, 300 m aside.
        check(at(2000.0, 300.0), NedVelocity::new(-50.0, 0.0, 0.0), 300.0);
        // It flies away: 100 m now, after two seconds at 40 m/s.
        check(at(-20.0, 0.0), NedVelocity::new(-40.0, 0.0, 0.0), 100.0);
        // The same speed and course: the distance stays.
        check(at(480.0, 0.0), NedVelocity::new(10.0, 0.0, 0.0), 500.0);
        // So far that a minute does not bring it near: 10 km less 62 s of 50 m/s and 60 s of ours.
        check(at(10_000.0, 0.0), NedVelocity::new(-50.0, 0.0, 0.0), 10_000.0 - 3100.0 - 600.0);
        // Far above, and far above but coming down.
        check(Ned::new(100.0, 0.0, -500.0), NedVelocity::default(), NO_TRAFFIC_M);
        check(Ned::new(100.0, 0.0, -300.0), NedVelocity::new(0.0, 0.0, 20.0), 0.0);
    }

    #[test]
    fn an_aircraft_that_moves_and_is_reported_where_it_was_has_flown_on_and_is_gone_in_the_end() {
        let (mut traffic, pace) = (Traffic::default(), Pace::REAL_TIME);
        // Straight at the vehicle, which flies away from it slower.
        let report = crewed("a", Ned::new(-2000.0, 0.0, -50.0), NedVelocity::new(110.0, 0.0, 0.0));
        let still = crewed("b", Ned::new(0.0, 700.0, -50.0), NedVelocity::default());
        for s in 0..20 {
            traffic.hear(Time::after(Duration::from_secs(s)), pace, report.clone());
        }
        let at = |s| Time::after(Duration::from_secs(s));
        assert!(traffic.closest_approach_m(at(9), pace, &own(), TrafficKind::Crewed) < 1.0);
        assert_eq!(traffic.closest_approach_m(at(19), pace, &own(), TrafficKind::Crewed), NO_TRAFFIC_M);
        // What stands may say the same for ever.
        for s in 20..60 {
            traffic.hear(at(s), pace, still.clone());
        }
        assert!(traffic.closest_approach_m(at(59), pace, &own(), TrafficKind::Crewed) < NO_TRAFFIC_M);
    }

    #[test]
    fn an_aircraft_that_is_not_reported_any_more_is_gone_and_a_flood_has_an_end() {
        let (mut traffic, pace) = (Traffic::default(), Pace::REAL_TIME);
        let report = |id: usize| crewed(&id.to_string(), Ned::new(100.0, 0.0, -50.0), NedVelocity::new(10.0, 0.0, 0.0));
        for id in 0..2 * MOST {
            traffic.hear(Time::ZERO, pace, report(id));
        }
        assert_eq!(traffic.aircraft.len(), MOST);
        let at = |ms| Time::after(Duration::from_millis(ms));
        assert!(traffic.closest_approach_m(at(9_900), pace, &own(), TrafficKind::Crewed) < 200.0);
        assert_eq!(traffic.closest_approach_m(at(10_000), pace, &own(), TrafficKind::Crewed), NO_TRAFFIC_M);
        traffic.hear(at(10_000), pace, report(9999));
        assert_eq!(traffic.aircraft.len(), 1);
    }
}
