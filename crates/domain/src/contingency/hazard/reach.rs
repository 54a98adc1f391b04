//! What each field says while all is well, and how far its source can go.

use super::super::snapshot::{Field, MODES, NO_TRAFFIC_M, Snapshot};

/// A field as a flight knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// On the ground, armed, before the takeoff.
    pub on_ground: f64,
    /// On the way.
    pub in_air: f64,
    /// The least that its source can say; a threshold below it is never crossed.
    pub lowest: f64,
    /// The most.
    pub highest: f64,
    /// What it is to hazards.
    pub part: Part,
}

/// What a field is to hazards.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// It shows one.
    Hazard,
    /// It says where and how the vehicle flies, which shows nothing by itself.
    Circumstance,
    /// It shows what another field shows as well.
    Shown(Field),
}

use Part::{Circumstance, Hazard, Shown};

const fn number(on_ground: f64, in_air: f64, lowest: f64, highest: f64, part: Part) -> Reach {
    Reach { on_ground, in_air, lowest, highest, part }
}

const fn measured(well: f64, lowest: f64, highest: f64) -> Reach {
    number(well, well, lowest, highest, Hazard)
}

/// A yes or no, `false` while all is well.
const NO: Reach = number(0.0, 0.0, 0.0, 1.0, Hazard);
/// A silence, over a whole flight.
const SILENCE: Reach = measured(0.0, 0.0, 3600.0);
/// The name `offboard` in the list of modes.
const OFFBOARD: f64 = 3.0;

/// What this field can say. Numbers are those of a multicopter; ENG where no source is named.
#[rustfmt::skip]
pub const fn reach(field: Field) -> Reach {
    match field {
        Field::BatteryCharge => measured(80.0, 0.0, 100.0),
        // Six cells.
        Field::BatteryVoltage => measured(23.0, 0.0, 60.0),
        Field::BatteryCurrent => number(1.0, 30.0, -50.0, 300.0, Shown(Field::Consumption)),
        Field::BatteryTemperature => measured(25.0, -20.0, 120.0),
        Field::HorizontalDeviation => measured(0.4, 0.0, 100.0),
        Field::VerticalDeviation => measured(0.6, 0.0, 100.0),
        Field::Height => number(0.0, 40.0, -50.0, 1000.0, Hazard),
        Field::DistanceHome => number(0.0, 200.0, 0.0, 50_000.0, Circumstance),
        Field::GroundSpeed => number(0.0, 8.0, 0.0, 40.0, Circumstance),
        Field::Climb => measured(0.0, -30.0, 10.0),
        Field::HeightAtRest => number(0.0, 40.0, -50.0, 1000.0, Hazard),
        Field::PositionJump => measured(0.0, 0.0, 10_000.0),
        Field::Tilt => number(0.0, 10.0, 0.0, 180.0, Hazard),
        Field::HeadingDifference => measured(2.0, 0.0, 180.0),
        Field::Vibration => number(1.0, 8.0, 0.0, 200.0, Hazard),
        Field::FlightTime => number(0.0, 300.0, 0.0, 36_000.0, Hazard),
        // WMO: 33 m/s is a hurricane.
        Field::WindSpeed => measured(3.0, 0.0, 33.0),
        Field::AirspeedLeft => number(12.0, 12.0, -30.0, 50.0, Shown(Field::WindSpeed)),
        Field::Gust => measured(4.0, 0.0, 45.0),
        Field::ClosestApproach | Field::UncrewedApproach | Field::VesselApproach => {
            measured(NO_TRAFFIC_M, 0.0, NO_TRAFFIC_M)
        }
        Field::HomeMargin => measured(40.0, -100.0, 75.0),
        Field::PlaceMargin => measured(45.0, -100.0, 75.0),
        Field::Consumption => measured(100.0, 0.0, 400.0),
        Field::Endurance => number(1000.0, 800.0, 0.0, 36_000.0, Shown(Field::PlaceMargin)),
        Field::PathDeviation => measured(0.5, 0.0, 1000.0),
        Field::Pace => measured(100.0, -1000.0, 1000.0),
        // As long as the battery of a long flight lasts.
        Field::CancelWait | Field::OperatorWait | Field::PlanWait => measured(0.0, 0.0, 7200.0),
        Field::ClockStep => measured(0.0, 0.0, 1e9),
        Field::Armed => number(1.0, 1.0, 0.0, 1.0, Circumstance),
        Field::Flying => number(0.0, 1.0, 0.0, 1.0, Circumstance),
        Field::Mode => number(0.0, OFFBOARD, 0.0, MODES.len() as f64 - 1.0, Hazard),
        Field::IntendedMode => number(0.0, OFFBOARD, 0.0, MODES.len() as f64 - 1.0, Circumstance),
        // The fastest descent, after a free fall from 30 m.
        Field::TouchdownSpeed => number(0.0, 0.0, 0.0, 25.0, Hazard),
        Field::TargetSeen => number(1.0, 1.0, 0.0, 1.0, Hazard),
        Field::SkillMissing
        | Field::RecordFails
        | Field::Failsafe
        | Field::Preempts
        | Field::NotReady
        | Field::SetpointsLost
        | Field::OwnLinkLost
        | Field::EstimatorInvalid
        | Field::GnssLost
        | Field::MotorFailed
        | Field::BatteryFaulty
        | Field::DetectorContradicts => NO,
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
        | Field::ManagerSilence => SILENCE,
    }
}

/// Whether an autopilot, or a site, may never say it: that alone is not a fault.
pub const fn may_be_missing(field: Field) -> bool {
    matches!(
        field,
        Field::BatteryCurrent
            | Field::BatteryTemperature
            | Field::Vibration
            | Field::WindSpeed
            | Field::AirspeedLeft
            | Field::Gust
            | Field::ClosestApproach
            | Field::UncrewedApproach
            | Field::VesselApproach
            | Field::HomeMargin
            | Field::PlaceMargin
            | Field::Consumption
            | Field::Endurance
            | Field::PathDeviation
            | Field::Pace
            | Field::NotReady
            | Field::SkillMissing
            | Field::TargetSeen
            | Field::RecordFails
            | Field::LinkSilence
            | Field::TowerSilence
            | Field::TouchdownSpeed
    )
}

/// What all fields say while all is well, on the way or on the ground.
pub fn well(in_air: bool) -> Snapshot {
    let mut snapshot = Snapshot::UNKNOWN;
    for field in Field::ALL.iter().copied() {
        let reach = reach(field);
        snapshot.set(field, Some(if in_air { reach.in_air } else { reach.on_ground }));
    }
    snapshot
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contingency::snapshot::Kind;

    #[test]
    fn what_a_field_says_lies_in_its_range() {
        assert_eq!(MODES[OFFBOARD as usize], "offboard");
        for field in Field::ALL.iter().copied() {
            let Reach { on_ground, in_air, lowest, highest, part } = reach(field);
            assert!(lowest <= on_ground && on_ground <= highest && lowest <= in_air && in_air <= highest, "{field:?}");
            match field.kind() {
                Kind::Number { least, most, .. } => assert!(least <= lowest && highest <= most, "{field:?}"),
                Kind::Choice(names) => assert_eq!((lowest, highest), (0.0, names.len() as f64 - 1.0), "{field:?}"),
            }
            if let Part::Shown(other) = part {
                assert_eq!(reach(other).part, Part::Hazard, "{field:?}");
            }
        }
    }
}
