//! How rules count the silence of a source: in mission time, and never faster than a machine can be expected to speak.
//!
//! The slow sources keep to the wall clock at any speed factor: at twenty times real time the land detector speaks every twenty mission
//! seconds, and a rule about three seconds must not find it silent. So what a rule reads counts in wall time up to a floor: a second, or
//! two samples where that is more. Links, the tower and processes always count in wall time.

use std::time::Duration;

use domain::contingency::source::DataSource;
use domain::time::Pace;

/// Samples that may be missing, in wall time.
const MISSING_SAMPLES: f64 = 2.0;
/// The floor of fast sources, in wall seconds.
const FLOOR_S: f64 = 1.0;

/// What a rule reads after this much mission time without anything new, in seconds.
pub(crate) fn counted_s(pace: Pace, source: DataSource, silent: Duration) -> f64 {
    let wall = pace.to_wall(silent);
    if source.keeps_wall_time() {
        wall.as_secs_f64()
    } else if wall.as_secs_f64() < floor_s(source) {
        wall.min(silent).as_secs_f64()
    } else {
        silent.as_secs_f64()
    }
}

/// After how much mission time without anything new a rule reads this many seconds, or more: the inverse.
pub(crate) fn reached_after(pace: Pace, source: DataSource, seconds: f64) -> Duration {
    let of = |seconds: f64| Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX);
    if source.keeps_wall_time() {
        return pace.wall(of(seconds));
    }
    of(seconds).max(pace.wall(of(seconds.min(floor_s(source)))))
}

fn floor_s(source: DataSource) -> f64 {
    (MISSING_SAMPLES / rate_hz(source)).max(FLOOR_S)
}

/// Samples per second of wall time; table 4.1 of the reference design.
fn rate_hz(source: DataSource) -> f64 {
    match source {
        DataSource::Status => 2.0,
        DataSource::Attitude => 240.0,
        DataSource::LocalPosition | DataSource::GlobalPosition => 123.0,
        DataSource::LandDetected => 1.0,
        DataSource::Battery => 99.0,
        DataSource::GroundLink => 2.0,
        DataSource::ControlTower => 1.0,
        DataSource::Planner | DataSource::SkillManager | DataSource::MissionManager => 4.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_silence_never_grows_faster_than_the_wall_clock_allows() {
        /// At this speed a rule reads `seconds` after `expected_s` of mission time, and less a moment before.
        #[track_caller]
        fn check(speed: f64, source: DataSource, seconds: f64, expected_s: f64) {
            let pace = Pace::new(speed).unwrap();
            let reached = reached_after(pace, source, seconds);
            assert_eq!(reached.as_secs_f64(), expected_s);
            assert!(seconds <= counted_s(pace, source, reached));
            let before = reached.saturating_sub(Duration::from_millis(1));
            assert!(counted_s(pace, source, before) < seconds);
        }
        check(1.0, DataSource::Battery, 2.0, 2.0);
        check(1.0, DataSource::LandDetected, 0.5, 0.5);
        check(0.1, DataSource::Battery, 2.0, 2.0);
        check(20.0, DataSource::Battery, 0.5, 10.0);
        check(20.0, DataSource::Battery, 2.0, 20.0);
        check(20.0, DataSource::Battery, 30.0, 30.0);
        check(20.0, DataSource::LandDetected, 3.0, 40.0);
        check(20.0, DataSource::Status, 3.0, 20.0);
        check(20.0, DataSource::GroundLink, 10.0, 200.0);
        check(0.5, DataSource::GroundLink, 10.0, 5.0);
        check(20.0, DataSource::Planner, 1.0, 20.0);
        check(20.0, DataSource::SkillManager, 60.0, 1200.0);
    }
}
