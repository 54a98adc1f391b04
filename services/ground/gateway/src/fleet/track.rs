//! Where a vehicle has flown its present mission, and how: what a page shows that is opened late.

use std::sync::Arc;

use kittiwake_proto::v1;

/// The most points that are kept: an hour with one a second. Beyond that every other one goes, as often as needed.
const MOST: usize = 3600;
/// Mission seconds from one point to the next, to begin with.
const FIRST_STEP_S: f64 = 0.5;

/// The points of one mission, oldest first. Cheap to clone: snapshots share them.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Track {
    /// When the mission was begun, as the mission manager says.
    began_utc_ms: i64,
    points: Arc<Vec<v1::TrackPoint>>,
    /// Mission seconds from one point to the next at least, since some had to go.
    step_s: f64,
}

impl Track {
    /// The mission manager says when the mission was begun: the points of another one are forgotten.
    pub(crate) fn of_mission(&mut self, began_utc_ms: i64) {
        if self.began_utc_ms != began_utc_ms {
            *self = Track { began_utc_ms, ..Track::default() };
        }
    }

    /// The vehicle is here; a repeated point, or one too soon after the last, is left out.
    pub(crate) fn add(&mut self, point: v1::TrackPoint) {
        let step_s = self.step_s.max(FIRST_STEP_S);
        if self.points.last().is_some_and(|last| point.mission_time_s < last.mission_time_s + step_s) {
            return;
        }
        let points = Arc::make_mut(&mut self.points);
        points.push(point);
        if MOST < points.len() {
            let mut number = 0;
            points.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            if let (Some(first), Some(last)) = (points.first(), points.last()) {
                self.step_s = (last.mission_time_s - first.mission_time_s) / (points.len() - 1) as f64;
            }
        }
    }

    /// Puts the earlier track in front, if it is of the same mission.
    pub(crate) fn go_on_from(&mut self, before: Track) {
        if before.began_utc_ms != self.began_utc_ms {
            return;
        }
        let since = std::mem::replace(self, before);
        since.points.iter().for_each(|point| self.add(*point));
    }

    /// The points.
    pub(crate) fn points(&self) -> &[v1::TrackPoint] {
        &self.points
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A track of a mission with points at these seconds.
    fn track(began: i64, seconds: impl IntoIterator<Item = f64>) -> Track {
        let mut track = Track::default();
        track.of_mission(began);
        seconds.into_iter().for_each(|it| track.add(v1::TrackPoint { mission_time_s: it, ..Default::default() }));
        track
    }

    fn seconds(track: &Track) -> Vec<f64> {
        track.points().iter().map(|it| it.mission_time_s).collect()
    }

    #[test]
    fn points_are_half_a_second_apart_and_of_one_mission() {
        let mut flown = track(1, [0.0, 0.2, 0.5, 0.9, 1.0, 0.4, 3.0]);
        assert_eq!(seconds(&flown), [0.0, 0.5, 1.0, 3.0]);
        flown.of_mission(1);
        assert_eq!(flown.points().len(), 4);
        flown.of_mission(2);
        assert_eq!(seconds(&flown), [0.0; 0]);
    }

    #[test]
    fn a_long_flight_is_kept_from_its_start_with_points_farther_apart() {
        let flown = track(1, (0..20_000).map(f64::from));
        let seconds = seconds(&flown);
        assert!((MOST / 2..=MOST).contains(&seconds.len()), "{}", seconds.len());
        assert_eq!(seconds[0], 0.0);
        let widest = seconds.windows(2).map(|it| it[1] - it[0]).fold(0.0, f64::max);
        assert!(widest <= 8.0 && seconds.last() > Some(&19_980.0), "{widest} s, until {:?}", seconds.last());
    }

    #[test]
    fn what_was_flown_before_a_restart_comes_first() {
        let mut since = track(7, [10.0, 11.0]);
        since.go_on_from(track(7, [0.0, 5.0, 10.0]));
        assert_eq!(seconds(&since), [0.0, 5.0, 10.0, 11.0]);
        since.go_on_from(track(8, [1.0]));
        assert_eq!(seconds(&since), [0.0, 5.0, 10.0, 11.0], "another mission's");
    }
}
