//! The whole of what is known, as one message.

use domain::contingency::rule::DataSource;
use domain::time::Time;
use kittiwake_proto::v1;

use crate::derived::derived;
use crate::flag::Flag;
use crate::sources::Sources;

/// The introspection at `now`.
pub fn introspection(now: Time, sources: &Sources, flags: &[Flag]) -> v1::Introspection {
    v1::Introspection {
        status: sources.status.latest().cloned(),
        attitude: sources.attitude.latest().copied(),
        local_position: sources.local_position.latest().copied(),
        global_position: sources.global_position.latest().copied(),
        land_detected: sources.land_detected.latest().copied(),
        battery: sources.battery.latest().copied(),
        ages: Some(ages(now, sources)),
        derived: derived(sources),
        flags: flags.iter().filter_map(|it| it.raised(now)).collect(),
    }
}

fn ages(now: Time, sources: &Sources) -> v1::SourceAges {
    let age_s = |source| sources.heard(source).map(|it| (now - it.at).as_secs_f64());
    v1::SourceAges {
        status_s: age_s(DataSource::Status),
        attitude_s: age_s(DataSource::Attitude),
        local_position_s: age_s(DataSource::LocalPosition),
        global_position_s: age_s(DataSource::GlobalPosition),
        land_detected_s: age_s(DataSource::LandDetected),
        battery_s: age_s(DataSource::Battery),
        ground_link_s: age_s(DataSource::GroundLink),
    }
}
