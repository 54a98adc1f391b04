//! The hazards, by their groups. A level lies well beyond the thresholds in use, so that a table may choose its own before it.

use super::super::snapshot::Field;
use super::super::{
    AREA_AHEAD, AREA_BREACHED, ENDED_IN_AIR, FRAME_MOVED, INTROSPECTION_LOST, MEMORY_UNUSABLE, MEMORY_UNWRITABLE,
    OPERATOR_ABORT, OPERATOR_LAND, OPERATOR_PAUSE, OPERATOR_RETURN, Phase, SOMEBODY_ELSE_FLIES, Severity,
    TRANSITION_FAILED,
};
use super::Answer::{Narrowed, Response, Told};
use super::Sign::{Fields, Flag};
use super::{Answer, Hazard, Sign};
use crate::contingency::narrowing::Narrows;
use Severity::{Avoid, Divert, Hold, Land, Leave, Return, Terminate, Yield};

type Calls = &'static [(&'static [Phase], Answer)];

const GROUND: &[Phase] = &[Phase::OnGround];
/// In the air between takeoff and landing: a takeoff and a landing are over within a minute.
const ON_WAY: &[Phase] = &[Phase::Cruise, Phase::Waiting, Phase::InsideArea];
const UNTIL_LANDING: &[Phase] = &[Phase::Takeoff, Phase::Cruise, Phase::Waiting, Phase::InsideArea];
const AIR: &[Phase] = &[Phase::Takeoff, Phase::Cruise, Phase::Waiting, Phase::InsideArea, Phase::Landing];
const TAKEOFF: &[Phase] = &[Phase::Takeoff];
const LANDING: &[Phase] = &[Phase::Landing];
const WAITING: &[Phase] = &[Phase::Waiting];
const LEGS: &[Phase] = &[Phase::Cruise, Phase::InsideArea];
const EVERYWHERE: &[Phase] = &Phase::ALL;

/// Any response keeps it on the ground.
const STAYS_DOWN: Answer = Response(&[Hold, Leave, Return, Divert, Avoid, Land, Terminate]);
/// It flies no farther on its way, and comes down nowhere but at a place.
const STOPS: Answer = Response(&[Hold, Leave, Return, Divert]);
/// It keeps away from what flies or swims there.
const KEEPS_AWAY: Answer = Response(&[Avoid, Land]);
/// It still flies, so it comes down at a place to land at, not in water and not among people.
const TO_A_PLACE: Answer = Response(&[Return, Divert]);
/// It flies nowhere any more.
const DOWN: Answer = Response(&[Land, Terminate]);
const SLOWER: Answer = Narrowed(Narrows::Slow);
const NO_NEW_AREA: Answer = Narrowed(Narrows::NoNewArea);

/// The places of the names in the list of modes.
const LOITERS: f64 = 0.0;
const LANDS: f64 = 2.0;
const RETURNS: f64 = 4.0;
const YES: f64 = 1.0;

const fn hazard(name: &'static str, sign: Sign, within_s: f64, calls_for: Calls, source: &'static str) -> Hazard {
    Hazard { name, sign, within_s, calls_for, source }
}

/// Every hazard: each condition that an autopilot can report, each source and process that can fall silent, and each field of energy,
/// navigation, vehicle, link, weather and airspace.
#[rustfmt::skip]
pub const HAZARDS: &[Hazard] = &[
    // Energy.
    hazard("battery-low", Fields(&[(Field::BatteryCharge, 15.0)]), 10.0,
        &[(UNTIL_LANDING, TO_A_PLACE), (GROUND, STAYS_DOWN)], "PX4 BAT_LOW_THR 15 %"),
    hazard("battery-nearly-empty", Fields(&[(Field::BatteryCharge, 6.0)]), 5.0,
        &[(UNTIL_LANDING, Response(&[Land])), (GROUND, STAYS_DOWN)], "PX4 BAT_CRIT_THR 7 %; at BAT_EMERGEN_THR 5 % autopilots land by themselves"),
    hazard("battery-empty", Fields(&[(Field::BatteryCharge, 4.0)]), 5.0,
        &[(UNTIL_LANDING, Response(&[Land])), (GROUND, STAYS_DOWN)], "PX4 BAT_EMERGEN_THR 5 %"),
    hazard("battery-faulty", Fields(&[(Field::BatteryFaulty, YES)]), 10.0,
        &[(UNTIL_LANDING, TO_A_PLACE), (GROUND, STAYS_DOWN)], "MAVLink MAV_BATTERY_CHARGE_STATE_UNHEALTHY; PX4 battery_unhealthy"),
    hazard("battery-voltage-low", Fields(&[(Field::BatteryVoltage, 16.0)]), 30.0,
        &[(UNTIL_LANDING, TO_A_PLACE)], "ArduPilot BATT_LOW_VOLT; ENG: 2.7 V a cell of six"),
    hazard("battery-hot", Fields(&[(Field::BatteryTemperature, 80.0)]), 30.0,
        &[(UNTIL_LANDING, TO_A_PLACE), (GROUND, STAYS_DOWN)], "ENG: cells burn by themselves from some 130 degC, and warm by 1 degC a second"),
    hazard("battery-silent", Fields(&[(Field::BatterySilence, 10.0)]), 1.0,
        &[(ON_WAY, STOPS), (GROUND, STAYS_DOWN)], "ENG: half a per cent of the battery by hovering"),
    hazard("battery-silent-for-long", Fields(&[(Field::BatterySilence, 120.0)]), 1.0,
        &[(UNTIL_LANDING, TO_A_PLACE)], "ENG: 10 % of the battery by hovering"),
    hazard("energy-short", Fields(&[(Field::PlaceMargin, -5.0), (Field::HomeMargin, -5.0)]), 15.0,
        &[(ON_WAY, TO_A_PLACE)], "PX4 COM_FLTT_LOW_ACT; ENG: half a per cent of the battery more"),
    hazard("home-out-of-reach", Fields(&[(Field::HomeMargin, -5.0)]), 30.0,
        &[(ON_WAY, Told)], "ENG: a person decides before the next leg"),
    hazard("consumption-high", Fields(&[(Field::Consumption, 180.0)]), 60.0,
        &[(ON_WAY, Told)], "icing was measured to take 80 % more (Iowa State 2023)"),
    hazard("flight-too-long", Fields(&[(Field::FlightTime, 36_000.0)]), 10.0,
        &[(UNTIL_LANDING, TO_A_PLACE)], "PX4 COM_FLT_TIME_MAX; ENG: no multicopter flies for ten hours"),
    // Navigation.
    hazard("position-invalid", Fields(&[(Field::EstimatorInvalid, YES)]), 5.0,
        &[(UNTIL_LANDING, DOWN)], "PX4 EKF2_NOAID_TOUT 5 s, then it lands by itself"),
    hazard("satellites-lost", Fields(&[(Field::GnssLost, YES)]), 5.0,
        &[(ON_WAY, STOPS)], "PX4 EKF2_NOAID_TOUT 5 s"),
    hazard("position-silent", Fields(&[(Field::PositionSilence, 3.0)]), 1.0,
        &[(UNTIL_LANDING, Response(&[Hold, Land])), (GROUND, STAYS_DOWN)], "ENG: 30 m at 10 m/s"),
    hazard("attitude-silent", Fields(&[(Field::AttitudeSilence, 3.0)]), 1.0,
        &[(AIR, Told), (GROUND, STAYS_DOWN)], "ENG: the autopilot has its own"),
    hazard("global-position-silent", Fields(&[(Field::GlobalPositionSilence, 30.0)]), 1.0,
        &[(AIR, Told)], "ENG: nothing flies by it but the map"),
    hazard("position-coarse", Fields(&[(Field::HorizontalDeviation, 8.0)]), 10.0,
        &[(UNTIL_LANDING, SLOWER), (GROUND, STAYS_DOWN)], "PX4 COM_POS_FS_EPH 5 m"),
    hazard("height-coarse", Fields(&[(Field::VerticalDeviation, 12.0)]), 10.0,
        &[(UNTIL_LANDING, SLOWER), (GROUND, STAYS_DOWN)], "PX4 EKF2_REQ_EPV 5 m"),
    hazard("position-jumped", Fields(&[(Field::PositionJump, 50.0)]), 2.0,
        &[(ON_WAY, STOPS)], "ENG: 20 m at 10 m/s the wrong way"),
    hazard("heading-wrong", Fields(&[(Field::HeadingDifference, 120.0)]), 5.0,
        &[(UNTIL_LANDING, SLOWER), (GROUND, STAYS_DOWN)], "PX4 EKF2: a magnetometer 60 deg off prevents arming"),
    hazard("off-its-path", Fields(&[(Field::PathDeviation, 60.0)]), 10.0,
        &[(LEGS, Told)], "ICAROUS FlightPlanDeviation; ENG: three times the stand-off from areas"),
    hazard("frame-moved", Flag(FRAME_MOVED), 0.0,
        &[(UNTIL_LANDING, STOPS), (GROUND, STAYS_DOWN)], "PX4 vehicle_local_position reset counters"),
    // Vehicle.
    hazard("motor-failed", Fields(&[(Field::MotorFailed, YES)]), 1.0,
        &[(AIR, DOWN), (GROUND, STAYS_DOWN)], "PX4 FD_ACT_EN"),
    hazard("turned-over", Fields(&[(Field::Tilt, 120.0)]), 1.0,
        &[(AIR, DOWN)], "PX4 FD_FAIL_P and FD_FAIL_R 60 deg within 0.3 s"),
    hazard("falling", Fields(&[(Field::Climb, -10.0)]), 1.5,
        &[(AIR, DOWN)], "ENG: twice what PX4 descends at most; 15 m until then"),
    hazard("vibration-extreme", Fields(&[(Field::Vibration, 90.0)]), 20.0,
        &[(UNTIL_LANDING, TO_A_PLACE), (GROUND, STAYS_DOWN)], "ArduPilot, Measuring Vibration: above 60 m/s2 there are nearly always problems"),
    hazard("vibration-high", Fields(&[(Field::Vibration, 50.0)]), 20.0,
        &[(UNTIL_LANDING, SLOWER), (GROUND, STAYS_DOWN)], "ArduPilot, Measuring Vibration: below 30 m/s2 is acceptable"),
    hazard("crashed", Fields(&[(Field::TouchdownSpeed, 6.0)]), 2.0,
        &[(GROUND, DOWN)], "PX4 MPC_LAND_SPEED 0.7 m/s, MPC_Z_VEL_MAX_DN 1.5 m/s"),
    hazard("autopilot-holds", Fields(&[(Field::Preempts, YES), (Field::Failsafe, YES), (Field::Mode, LOITERS)]), 3.0,
        &[(UNTIL_LANDING, Response(&[Hold]))], "PX4 vehicle_status.failsafe"),
    hazard("autopilot-returns", Fields(&[(Field::Preempts, YES), (Field::Failsafe, YES), (Field::Mode, RETURNS)]), 3.0,
        &[(AIR, Response(&[Return, Divert]))], "PX4 vehicle_status.failsafe"),
    hazard("autopilot-lands", Fields(&[(Field::Preempts, YES), (Field::Failsafe, YES), (Field::Mode, LANDS)]), 3.0,
        &[(AIR, Response(&[Return, Divert, Land]))], "PX4 vehicle_status.failsafe"),
    hazard("autopilot-silent", Fields(&[(Field::StatusSilence, 10.0)]), 1.0,
        &[(TAKEOFF, STOPS), (ON_WAY, Told)], "ENG: 20 samples of 2 Hz"),
    hazard("land-detector-wrong", Fields(&[(Field::DetectorContradicts, YES)]), 10.0,
        &[(AIR, Told), (GROUND, STAYS_DOWN)], "ENG: ten statements of 1 Hz"),
    hazard("landing-target-lost", Fields(&[(Field::TargetSeen, 0.0)]), 5.0,
        &[(LANDING, STOPS)], "PX4 PLD_BTOUT 5 s"),
    hazard("land-detector-silent", Fields(&[(Field::DetectorSilence, 30.0)]), 1.0,
        &[(AIR, Told)], "ENG: 30 statements of 1 Hz"),
    hazard("autopilot-not-ready", Fields(&[(Field::NotReady, YES)]), 2.0,
        &[(GROUND, STAYS_DOWN)], "PX4 pre_flight_checks_pass, MAVLink PREARM_CHECK"),
    hazard("setpoints-lost", Fields(&[(Field::SetpointsLost, YES)]), 2.0,
        &[(UNTIL_LANDING, STOPS)], "PX4 COM_OF_LOSS_T 1 s"),
    hazard("somebody-else-flies", Flag(SOMEBODY_ELSE_FLIES), 0.0,
        &[(EVERYWHERE, Response(&[Yield]))], "ENG: two who fly one vehicle are worse than either"),
    // Links.
    hazard("link-lost", Fields(&[(Field::LinkSilence, 30.0)]), 1.0,
        &[(ON_WAY, STOPS)], "PX4 COM_DL_LOSS_T 10 s; ENG: three times that"),
    hazard("link-lost-for-long", Fields(&[(Field::LinkSilence, 600.0)]), 1.0,
        &[(UNTIL_LANDING, TO_A_PLACE)], "EU 2019/947 UAS.OPEN.060: the pilot can end the flight; ENG: 40 % of the battery by hovering"),
    hazard("autopilots-own-link-lost", Fields(&[(Field::OwnLinkLost, YES)]), 30.0,
        &[(AIR, Told)], "PX4 COM_DL_LOSS_T 10 s"),
    hazard("tower-silent", Fields(&[(Field::TowerSilence, 60.0)]), 1.0,
        &[(UNTIL_LANDING, NO_NEW_AREA)], "ENG: 60 ledgers of 1 Hz"),
    hazard("record-fails", Fields(&[(Field::RecordFails, YES)]), 30.0,
        &[(AIR, Told)], "ENG: no record is a fault of the ground, and ends no flight"),
    // Airspace.
    hazard("aircraft-near", Fields(&[(Field::ClosestApproach, 200.0)]), 3.0,
        &[(ON_WAY, KEEPS_AWAY), (GROUND, STAYS_DOWN)], "ASTM F3442: well clear is 610 m; ENG: a third of that"),
    hazard("drone-near", Fields(&[(Field::UncrewedApproach, 60.0)]), 3.0,
        &[(ON_WAY, KEEPS_AWAY), (GROUND, STAYS_DOWN)], "ENG: less than half of ArduPilot's AVD"),
    hazard("vessel-near", Fields(&[(Field::VesselApproach, 10.0)]), 5.0,
        &[(ON_WAY, KEEPS_AWAY)], "SORA ground risk buffer 1:1"),
    hazard("too-high", Fields(&[(Field::Height, 250.0), (Field::HeightAtRest, 250.0)]), 10.0,
        &[(UNTIL_LANDING, TO_A_PLACE)], "EU 2019/947: 120 m; ENG: no authorization of the specific category is for twice that"),
    hazard("area-closed", Flag(AREA_BREACHED), 0.0,
        &[(AIR, Response(&[Leave, Return, Divert]))], "EU 2021/664 Art. 6(6)"),
    hazard("area-ahead", Flag(AREA_AHEAD), 0.0,
        &[(ON_WAY, Response(&[Hold]))], "PX4 geofence prediction"),
    // Weather.
    hazard("wind-too-strong", Fields(&[(Field::WindSpeed, 22.0)]), 30.0,
        &[(UNTIL_LANDING, TO_A_PLACE), (GROUND, STAYS_DOWN)], "PX4 COM_WIND_MAX; ENG: 10 m/s beyond the fastest over ground"),
    hazard("wind-high", Fields(&[(Field::WindSpeed, 13.0)]), 30.0,
        &[(GROUND, STAYS_DOWN)], "PX4 COM_WIND_WARN; ENG: beyond the fastest over ground"),
    hazard("gust-too-strong", Fields(&[(Field::Gust, 25.0)]), 10.0,
        &[(UNTIL_LANDING, TO_A_PLACE)], "WMO No. 8; ENG: 3 m/s beyond the mean wind that is too strong"),
    hazard("gust-at-landing", Fields(&[(Field::Gust, 16.0)]), 3.0,
        &[(LANDING, STOPS)], "ENG: no correction of a landing is that fast"),
    // Processes, the mission and people.
    hazard("monitor-dead", Flag(INTROSPECTION_LOST), 0.0,
        &[(UNTIL_LANDING, STOPS)], "ENG: no flag rises any more"),
    hazard("skill-manager-dead", Fields(&[(Field::SkillManagerSilence, 5.0)]), 1.0,
        &[(ON_WAY, STOPS)], "ENG: its restart takes 4 s"),
    hazard("planner-dead", Fields(&[(Field::PlannerSilence, 5.0)]), 1.0,
        &[(WAITING, STOPS)], "ENG: its restart takes 4 s"),
    hazard("planner-dead-for-long", Fields(&[(Field::PlannerSilence, 600.0)]), 1.0,
        &[(WAITING, TO_A_PLACE)], "ENG: 40 % of the battery by hovering"),
    hazard("mission-manager-dead", Fields(&[(Field::ManagerSilence, 5.0)]), 1.0,
        &[(AIR, Told)], "ENG: its restart takes 4 s; nobody responds meanwhile"),
    hazard("skill-does-not-end", Fields(&[(Field::CancelWait, 30.0)]), 5.0,
        &[(ON_WAY, STOPS)], "ENG: sixty times the pause between two tries"),
    hazard("skill-takes-too-long", Fields(&[(Field::Pace, 25.0)]), 60.0,
        &[(LEGS, Told)], "PlanSys2 duration_overrun_percentage 20 %"),
    hazard("nothing-to-fly", Fields(&[(Field::PlanWait, 3600.0), (Field::PlaceMargin, 2.0)]), 5.0,
        &[(WAITING, TO_A_PLACE)], "ENG: longer than the battery lasts"),
    hazard("nobody-decides", Fields(&[(Field::OperatorWait, 3600.0)]), 5.0,
        &[(UNTIL_LANDING, TO_A_PLACE)], "ENG: longer than the battery lasts"),
    hazard("skill-missing", Fields(&[(Field::SkillMissing, YES)]), 3.0,
        &[(GROUND, STAYS_DOWN)], "ENG: a flight that cannot do its task is not begun"),
    hazard("clock-jumped", Fields(&[(Field::ClockStep, 60.0)]), 2.0,
        &[(UNTIL_LANDING, NO_NEW_AREA), (GROUND, STAYS_DOWN)], "ENG: windows of areas are minutes long"),
    hazard("transition-failed", Flag(TRANSITION_FAILED), 0.0,
        &[(UNTIL_LANDING, STOPS), (GROUND, STAYS_DOWN)], "ENG: nothing else flies meanwhile"),
    hazard("memory-lost", Flag(MEMORY_UNUSABLE), 0.0,
        &[(ON_WAY, STOPS), (GROUND, STAYS_DOWN)], "ENG: an order may be forgotten"),
    hazard("memory-unwritable", Flag(MEMORY_UNWRITABLE), 0.0,
        &[(GROUND, STAYS_DOWN)], "ENG: an order would be forgotten"),
    hazard("order-to-land", Flag(OPERATOR_ABORT), 0.0,
        &[(AIR, Response(&[Land]))], "an order does what it says"),
    hazard("order-to-return", Flag(OPERATOR_RETURN), 0.0,
        &[(AIR, TO_A_PLACE)], "an order does what it says"),
    hazard("order-to-land-at-a-place", Flag(OPERATOR_LAND), 0.0,
        &[(AIR, TO_A_PLACE)], "an order does what it says"),
    hazard("order-to-pause", Flag(OPERATOR_PAUSE), 0.0,
        &[(UNTIL_LANDING, Response(&[Hold]))], "an order does what it says"),
    hazard("ended-in-the-air", Flag(ENDED_IN_AIR), 0.0,
        &[(AIR, TO_A_PLACE)], "ENG: nothing else brings it down"),
];

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::super::reach::{Part, reach};
    use super::*;
    use crate::contingency::snapshot::MODES;

    #[test]
    fn every_field_is_in_a_hazard_or_says_why_it_shows_nothing() {
        let signs = HAZARDS.iter().filter_map(|it| match it.sign {
            Fields(fields) => Some(fields),
            Flag(_) => None,
        });
        let read: Vec<Field> = signs.flatten().map(|(field, _)| *field).collect();
        for field in Field::ALL.iter().copied() {
            assert_eq!(read.contains(&field), reach(field).part == Part::Hazard, "{field:?}");
        }
    }

    #[test]
    fn each_has_a_name_of_its_own_and_one_answer_in_a_phase() {
        let names: BTreeSet<&str> = HAZARDS.iter().map(|it| it.name).collect();
        assert_eq!(names.len(), HAZARDS.len());
        for hazard in HAZARDS {
            assert_eq!(Hazard::named(hazard.name), Some(hazard));
            let phases: Vec<Phase> = hazard.calls_for.iter().flat_map(|(phases, _)| phases.iter().copied()).collect();
            assert_eq!(phases.iter().collect::<BTreeSet<_>>().len(), phases.len(), "{}", hazard.name);
            assert!(!phases.is_empty() && !hazard.source.is_empty(), "{}", hazard.name);
            // What a source cannot say shows nothing.
            if let Fields(fields) = hazard.sign {
                for (field, value) in fields {
                    let reach = reach(*field);
                    assert!(reach.lowest <= *value && *value <= reach.highest, "{}: {field:?}", hazard.name);
                }
            }
        }
        assert_eq!([LOITERS, LANDS, RETURNS].map(|it| MODES[it as usize]), ["loiter", "land", "return"]);
    }
}
