//! What the expressions of the table read, from what was heard.
//!
//! A sample counts until the next one arrives, as for a fact: the silence of a source is a row of its own. What was never heard,
//! and what the estimator does not vouch for, is not known.

use domain::contingency::rule::Quantity;
use domain::contingency::snapshot::{Field, Snapshot};
use domain::fmu::{Attitude, FlightMode, LocalPosition, TrafficKind};
use domain::time::Time;

use crate::derived::value;
use crate::sources::Sources;

/// The values of all fields at `now`.
pub(crate) fn snapshot(sources: &Sources, now: Time) -> Snapshot {
    let mut snapshot = Snapshot::UNKNOWN;
    let local = sources.local_position.latest();
    let status = sources.status.latest();
    let outlook = sources.outlook(now);
    for field in Field::ALL.iter().copied() {
        let measured = |quantity| value(quantity, sources);
        match field {
            Field::BatteryCharge => snapshot.set(field, measured(Quantity::BatteryRemaining).map(|it| it * 100.0)),
            Field::BatteryVoltage => snapshot.set(field, measured(Quantity::BatteryVoltage)),
            Field::BatteryCurrent => snapshot.set(field, sources.battery.latest().and_then(|it| it.current_a)),
            Field::BatteryTemperature => snapshot.set(field, measured(Quantity::BatteryTemperature)),
            Field::HorizontalDeviation => snapshot.set(field, measured(Quantity::HorizontalAccuracy)),
            Field::VerticalDeviation => snapshot.set(field, measured(Quantity::VerticalAccuracy)),
            Field::Height => snapshot.set(field, measured(Quantity::Height)),
            Field::DistanceHome => snapshot.set(field, measured(Quantity::DistanceHome)),
            Field::GroundSpeed => snapshot.set(field, measured(Quantity::GroundSpeed)),
            Field::Climb => {
                let vertical = local.filter(|it| it.vertical_valid);
                snapshot.set(field, vertical.map(|it| it.velocity.climb_rate_m_s()));
            }
            Field::Tilt => snapshot.set(field, measured(Quantity::Tilt).map(f64::to_degrees)),
            Field::HeightAtRest => {
                let vertical = local.filter(|it| it.vertical_valid);
                snapshot.set(field, vertical.map(height_at_rest_m));
            }
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
            Field::Gust => snapshot.set(field, sources.gust_m_s(now)),
            Field::ClosestApproach => snapshot.set(field, sources.closest_approach_m(now, TrafficKind::Crewed)),
            Field::UncrewedApproach => snapshot.set(field, sources.closest_approach_m(now, TrafficKind::Uncrewed)),
            Field::VesselApproach => snapshot.set(field, sources.closest_approach_m(now, TrafficKind::Vessel)),
            Field::HomeMargin => snapshot.set(field, outlook.home_margin_percent),
            Field::PlaceMargin => snapshot.set(field, outlook.place_margin_percent),
            Field::Consumption => snapshot.set(field, outlook.consumption_percent),
            Field::Endurance => snapshot.set(field, outlook.endurance_s),
            Field::PathDeviation => snapshot.set(field, outlook.path_deviation_m),
            Field::Overrun => snapshot.set(field, outlook.overrun_percent),
            Field::CancelWait => snapshot.set(field, outlook.cancel_s),
            Field::OperatorWait => snapshot.set(field, outlook.operator_s),
            Field::PlanWait => snapshot.set(field, outlook.plan_s),
            Field::RecordFails => snapshot.set_truth(field, sources.record_fails()),
            Field::ClockStep => snapshot.set(field, Some(sources.clock_step_s(now))),
            Field::Armed => snapshot.set_truth(field, status.map(|it| it.armed)),
            Field::Flying => snapshot.set_truth(field, sources.flying()),
            Field::Failsafe => snapshot.set_truth(field, status.map(|it| it.failsafe)),
            Field::Mode => status.into_iter().for_each(|it| snapshot.set_choice(field, mode(it.actual))),
            Field::IntendedMode => status.into_iter().for_each(|it| snapshot.set_choice(field, mode(it.intended))),
        }
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
