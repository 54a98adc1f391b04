//! What the expressions of the table read, from what was heard.
//!
//! A sample counts until the next one arrives: the silence of a source is a field of its own. What was never heard,
//! and what the estimator does not vouch for, is not known.

use domain::contingency::snapshot::{Field, Snapshot};
use domain::fmu::{Attitude, Failure, FlightMode, LocalPosition, TrafficKind};
use domain::time::Time;

use crate::derived::distance_home_m;
use crate::sources::Sources;

/// The values of all fields at `now`.
pub(crate) fn snapshot(sources: &Sources, now: Time) -> Snapshot {
    let mut snapshot = Snapshot::UNKNOWN;
    let local = sources.local_position.latest();
    let (horizontal, vertical) = (local.filter(|it| it.horizontal_valid), local.filter(|it| it.vertical_valid));
    let (battery, status) = (sources.battery.latest(), sources.status.latest());
    let reported = |failure: Failure| status.map(|it| it.failures.contains(&failure));
    let outlook = sources.outlook(now);
    for field in Field::ALL.iter().copied() {
        match field {
            Field::BatteryCharge => snapshot.set(field, battery.map(|it| it.remaining * 100.0)),
            Field::BatteryVoltage => snapshot.set(field, battery.map(|it| it.voltage_v)),
            Field::BatteryCurrent => snapshot.set(field, battery.and_then(|it| it.current_a)),
            Field::BatteryTemperature => snapshot.set(field, battery.and_then(|it| it.temperature_c)),
            Field::HorizontalDeviation => snapshot.set(field, local.map(|it| it.eph_m)),
            Field::VerticalDeviation => snapshot.set(field, local.map(|it| it.epv_m)),
            Field::Height => snapshot.set(field, vertical.map(|it| it.position.height_m())),
            Field::DistanceHome => snapshot.set(field, horizontal.map(|it| distance_home_m(it.position))),
            Field::GroundSpeed => snapshot.set(field, horizontal.map(|it| it.velocity.ground_speed_m_s())),
            Field::Climb => snapshot.set(field, vertical.map(|it| it.velocity.climb_rate_m_s())),
            Field::Tilt => snapshot.set(field, sources.attitude.latest().map(|it| it.tilt_rad().to_degrees())),
            Field::HeightAtRest => snapshot.set(field, vertical.map(height_at_rest_m)),
            Field::PositionJump => snapshot.set(field, sources.position_jump_m(now)),
            Field::HeadingDifference => {
                let headings = sources.attitude.latest().zip(local);
                snapshot.set(field, headings.map(|(attitude, local)| heading_difference_deg(attitude, local)));
            }
            Field::Vibration => snapshot.set(field, status.and_then(|it| it.vibration_m_s2)),
            Field::FlightTime => snapshot.set(field, sources.flight_time(now).map(|it| it.as_secs_f64())),
            Field::WindSpeed => {
                snapshot.set(field, sources.wind(now).map(|it| it.north_m_s.hypot(it.east_m_s)));
            }
            Field::AirspeedLeft => snapshot.set(field, outlook.airspeed_left_m_s),
            Field::Gust => snapshot.set(field, sources.gust_m_s(now)),
            Field::ClosestApproach => snapshot.set(field, sources.closest_approach_m(now, TrafficKind::Crewed)),
            Field::UncrewedApproach => snapshot.set(field, sources.closest_approach_m(now, TrafficKind::Uncrewed)),
            Field::VesselApproach => snapshot.set(field, sources.closest_approach_m(now, TrafficKind::Vessel)),
            Field::HomeMargin => snapshot.set(field, outlook.home_margin_percent),
            Field::PlaceMargin => snapshot.set(field, outlook.place_margin_percent),
            Field::Consumption => snapshot.set(field, outlook.consumption_percent),
            Field::Endurance => snapshot.set(field, outlook.endurance_s),
            Field::PathDeviation => snapshot.set(field, outlook.path_deviation_m),
            Field::Pace => snapshot.set(field, outlook.pace_percent),
            Field::CancelWait => snapshot.set(field, outlook.cancel_s),
            Field::OperatorWait => snapshot.set(field, outlook.operator_s),
            Field::PlanWait => snapshot.set(field, outlook.plan_s),
            Field::SkillMissing => snapshot.set_truth(field, sources.missing_skill(now).map(|it| it.is_some())),
            Field::RecordFails => snapshot.set_truth(field, sources.record_fails()),
            Field::ClockStep => snapshot.set(field, Some(sources.clock_step_s(now))),
            Field::Armed => snapshot.set_truth(field, status.map(|it| it.armed)),
            Field::Flying => snapshot.set_truth(field, sources.flying()),
            Field::Failsafe => snapshot.set_truth(field, status.map(|it| it.failsafe)),
            Field::Mode => status.into_iter().for_each(|it| snapshot.set_choice(field, mode(it.actual))),
            Field::IntendedMode => status.into_iter().for_each(|it| snapshot.set_choice(field, mode(it.intended))),
            Field::Preempts => snapshot.set_truth(field, sources.pre_empts()),
            Field::NotReady => {
                // One that is armed has no more to say about it.
                let refuses = status.and_then(|it| if it.armed { Some(false) } else { it.can_arm.map(|it| !it) });
                snapshot.set_truth(field, refuses);
            }
            Field::SetpointsLost => snapshot.set_truth(field, reported(Failure::OffboardSignalLost)),
            Field::OwnLinkLost => snapshot.set_truth(field, reported(Failure::GroundLinkLost)),
            Field::EstimatorInvalid => {
                let doubtful = local.map(|it| !(it.horizontal_valid && it.vertical_valid));
                let failed = reported(Failure::Estimator);
                let either = failed.into_iter().chain(doubtful).reduce(|failed, doubtful| failed || doubtful);
                snapshot.set_truth(field, either);
            }
            Field::GnssLost => snapshot.set_truth(field, reported(Failure::GnssLost)),
            Field::MotorFailed => snapshot.set_truth(field, reported(Failure::Motor)),
            Field::BatteryFaulty => snapshot.set_truth(field, reported(Failure::Battery)),
            Field::DetectorContradicts => snapshot.set_truth(field, sources.contradicts_detector()),
            Field::TargetSeen => snapshot.set_truth(field, status.and_then(|it| it.landing_target_seen)),
            Field::TouchdownSpeed => snapshot.set(field, sources.touchdown_m_s()),
            Field::StatusSilence
            | Field::AttitudeSilence
            | Field::PositionSilence
            | Field::GlobalPositionSilence
            | Field::DetectorSilence
            | Field::BatterySilence
            | Field::LinkSilence
            | Field::TowerSilence
            | Field::PlannerSilence
            | Field::SkillManagerSilence
            | Field::ManagerSilence => {
                snapshot.set(field, field.silence().and_then(|source| sources.silent_s(source, now)));
            }
        }
    }
    snapshot
}

/// The same with no silence longer than before: after a pause of the whole process every source looks silent until its mailbox is empty.
pub(crate) fn without_longer_silences(mut snapshot: Snapshot, before: &Snapshot) -> Snapshot {
    for field in Field::ALL.iter().copied().filter(|it| it.silence().is_some()) {
        let least = before.get(field).zip(snapshot.get(field)).map(|(before, now)| before.min(now));
        snapshot.set(field, least);
    }
    snapshot
}

/// The brakes of a climb, in m/s2. (PX4: MPC_ACC_DOWN_MAX 3 m/s2.)
const BRAKES_CLIMB_M_S2: f64 = 3.0;

/// Where a climb comes to rest: higher by v^2 / 2a. A descent is asked for, and ends where it is to.
fn height_at_rest_m(local: &LocalPosition) -> f64 {
    let climb_m_s = local.velocity.climb_rate_m_s().max(0.0);
    local.position.height_m() + climb_m_s * climb_m_s / (2.0 * BRAKES_CLIMB_M_S2)
}

fn heading_difference_deg(attitude: &Attitude, local: &LocalPosition) -> f64 {
    let difference_rad = attitude.heading_rad() - local.heading_rad;
    let (sin, cos) = difference_rad.sin_cos();
    sin.atan2(cos).abs().to_degrees()
}

fn mode(mode: Option<FlightMode>) -> &'static str {
    match mode {
        Some(FlightMode::Loiter) => "loiter",
        Some(FlightMode::Takeoff) => "takeoff",
        Some(FlightMode::Land) => "land",
        Some(FlightMode::Offboard) => "offboard",
        Some(FlightMode::Return) => "return",
        None => "other",
    }
}

#[cfg(test)]
mod tests {
    use domain::contingency::snapshot::{Kind, MODES};

    use super::*;

    #[test]
    fn every_mode_has_a_name_that_rules_know() {
        use FlightMode::{Land, Loiter, Offboard, Return, Takeoff};
        for it in [Some(Loiter), Some(Takeoff), Some(Land), Some(Offboard), Some(Return), None] {
            assert!(MODES.contains(&mode(it)), "{it:?}");
        }
        assert_eq!(Field::Mode.kind(), Kind::Choice(MODES));
    }
}
