//! How long a source may bring nothing new before it is stale.

use std::time::Duration;

use domain::contingency::rule::DataSource;
use domain::quantity::Positive;
use domain::time::Pace;

/// Samples that may be missing before a source can be stale, however short its limit is in wall time.
const MISSING_SAMPLES: f64 = 2.0;

/// The configured `limit` for `source` in mission time.
///
/// It is a limit of the machine and keeps the wall-clock floor of [`Pace::limit`]. The slow sources
/// keep to the wall clock at any speed factor: at twenty times real time the land detector speaks
/// every twenty mission seconds, and a limit of three seconds must not find it stale.
pub(crate) fn staleness_limit(pace: Pace, source: DataSource, limit: Positive) -> Duration {
    let limit = limit.seconds();
    if matches!(source, DataSource::GroundLink | DataSource::ControlTower) || source.is_process() {
        return pace.wall(limit);
    }
    let missing = Duration::from_secs_f64(MISSING_SAMPLES / rate_hz(source));
    pace.limit(limit).max(pace.wall(limit.min(missing)))
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
    fn a_limit_never_shrinks_below_what_the_wall_clock_needs() {
        #[track_caller]
        fn check(speed: f64, source: DataSource, limit_s: f64, expected_s: f64) {
            let limit = Positive::try_from(limit_s).unwrap();
            assert_eq!(staleness_limit(Pace::new(speed).unwrap(), source, limit).as_secs_f64(), expected_s);
        }
        check(1.0, DataSource::Battery, 2.0, 2.0);
        check(1.0, DataSource::LandDetected, 0.5, 0.5);
        check(0.1, DataSource::Battery, 2.0, 2.0);
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
