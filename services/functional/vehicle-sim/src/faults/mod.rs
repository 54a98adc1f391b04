//! The faults that can be injected at run time, and how they are written.
//!
//! What a fault does is decided in `inject.rs`. A new one is an entry in [`mod@catalogue`], a variant
//! of `Fault`, and the match arm that the compiler asks for.

use domain::file::did_you_mean;
use domain::fmu::TrafficKind;
use kittiwake_proto::topics::Topic;

mod arguments;
pub mod catalogue;

use arguments::Arguments;
use catalogue::catalogue;

use crate::pilot::Mode;

/// A fault, checked.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Fault {
    /// The next commands are not carried out and are rejected.
    RejectAcks(u32),
    /// The next commands are carried out but not acknowledged.
    SwallowAcks(u32),
    /// The topic repeats its present value at its rate.
    Freeze(Topic),
    /// The topic falls silent.
    Drop(Topic),
    /// The topic is neither frozen nor dropped.
    Thaw(Topic),
    /// Sets the charge left, 0 to 1.
    Battery(f64),
    /// Sets the temperature of the battery's cells, degrees Celsius.
    BatteryTemperature(f64),
    /// No satellites are received.
    GnssLoss(bool),
    /// The position estimate drifts at this many metres per second.
    EstimatorDrift(f64),
    /// The estimator reports itself as invalid.
    EstimatorInvalid(bool),
    /// This many motors have failed in total: one is a controlled descent, two are a fall.
    MotorFailure(u8),
    /// The wind, where it blows to, with gusts.
    Wind {
        /// Mean, towards north.
        north_m_s: f64,
        /// Mean, towards east.
        east_m_s: f64,
        /// Standard deviation of each component.
        gust_m_s: f64,
    },
    /// The vehicle does not hear its ground station for this many mission seconds.
    LinkLoss(f64),
    /// A landing stops above the ground.
    BlockedLanding(bool),
    /// At this height above the ground and below, the target of a landing is not seen.
    HideTarget(f64),
    /// The gripper takes commands and does not open.
    GripperStuck(bool),
    /// The land detector is stuck at the ground (true) or in the air (false), or works.
    LandDetector(Option<bool>),
    /// Another aircraft appears, and flies straight and level.
    Intruder {
        /// Metres north of the origin.
        north_m: f64,
        /// Metres east of the origin.
        east_m: f64,
        /// Metres above the origin.
        height_m: f64,
        /// Towards north.
        north_m_s: f64,
        /// Towards east.
        east_m_s: f64,
        /// What it is.
        kind: TrafficKind,
    },
    /// Other traffic appears, and flies a level circle.
    Circling {
        /// Metres north of the origin, of the middle.
        north_m: f64,
        /// Metres east of the origin, of the middle.
        east_m: f64,
        /// Metres above the origin.
        height_m: f64,
        /// Of the circle.
        radius_m: f64,
        /// Along the circle.
        speed_m_s: f64,
        /// What it is.
        kind: TrafficKind,
    },
    /// Other traffic appears ahead of the vehicle, at its height, and flies to where the vehicle is.
    HeadOn {
        /// How far ahead.
        distance_m: f64,
        /// Over ground.
        speed_m_s: f64,
        /// What it is.
        kind: TrafficKind,
    },
    /// Somebody else chooses this mode.
    PilotTakesOver(Mode),
    /// The autopilot flies this mode by a failsafe, for this reason; `None`: the failsafe ends.
    AutopilotFailsafe(Option<(Mode, String)>),
    /// The autopilot starts again; armed, it holds (true) or its motors stop.
    RestartAutopilot(bool),
    /// The motors stop at once, also in the air.
    FlightTermination,
    /// Positions of the local frame jump by this much.
    FrameJump {
        /// Metres north.
        north_m: f64,
        /// Metres east.
        east_m: f64,
        /// Metres down.
        down_m: f64,
    },
    /// The autopilot would not arm, for this reason; `None`: it would.
    NotReady(Option<String>),
    /// The frame shakes this much, m/s2.
    Vibration(f64),
    /// The motors take this many times what they should.
    Drain(f64),
    /// The battery reports a fault of its own.
    FaultyBattery(bool),
    /// The estimate jumps: north, east, up, in metres. It stays there.
    PositionJump {
        /// Towards north.
        north_m: f64,
        /// Towards east.
        east_m: f64,
        /// Upwards.
        up_m: f64,
    },
    /// The heading of the position estimate is off by this many degrees.
    HeadingError(f64),
    /// The autopilot steers for a place beside each position that it is sent.
    SteeringError {
        /// How far north, in metres.
        north_m: f64,
        /// How far east, in metres.
        east_m: f64,
    },
    /// The autopilot flies no faster than this over ground, m/s; `None`: than its own limit.
    SlowFlight(Option<f64>),
    /// Ends all faults; the battery keeps its charge.
    Clear,
}

/// Why a fault cannot be injected.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum InvalidFault {
    /// No fault has this name.
    #[error("there is no fault `{name}`; {help}")]
    Unknown {
        /// The name that was given.
        name: String,
        /// A similar name, or all names.
        help: String,
    },
    /// The fault takes other arguments.
    #[error("`{name}`: {problem}; usage: {name} {arguments}")]
    Arguments {
        /// The fault.
        name: &'static str,
        /// What is wrong.
        problem: String,
        /// The arguments it takes.
        arguments: &'static str,
    },
}

impl Fault {
    /// The fault called `name` with `args`.
    ///
    /// # Errors
    /// If no fault has that name, or it takes other arguments; the error says which.
    pub(crate) fn parse(name: &str, args: &[String]) -> Result<Fault, InvalidFault> {
        let Some(entry) = catalogue().iter().find(|it| it.name == name) else {
            let known: Vec<_> = catalogue().iter().map(|it| it.name).collect();
            return Err(InvalidFault::Unknown { name: name.into(), help: did_you_mean(name, &known) });
        };
        let mut arguments = Arguments::new(args);
        let fault = (entry.parse)(&mut arguments).and_then(|fault| arguments.finish(fault));
        fault.map_err(|problem| InvalidFault::Arguments { name: entry.name, problem, arguments: entry.arguments })
    }
}

/// Whether the simulator would take this fault.
///
/// # Errors
/// Why not, and what was expected.
pub fn check(name: &str, args: &[String]) -> Result<(), String> {
    Fault::parse(name, args).map(drop).map_err(|it| it.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(line: &str, expected: Result<Fault, &str>) {
        let mut words = line.split_whitespace().map(String::from);
        let name = words.next().unwrap();
        let parsed = Fault::parse(&name, &words.collect::<Vec<_>>());
        assert_eq!(parsed.map_err(|it| it.to_string()), expected.map_err(String::from));
    }

    #[test]
    fn a_fault_is_written_as_name_and_arguments() {
        check("reject_acks 2", Ok(Fault::RejectAcks(2)));
        check("swallow_acks 1", Ok(Fault::SwallowAcks(1)));
        check("freeze vehicle_local_position", Ok(Fault::Freeze(Topic::VehicleLocalPosition)));
        check("drop battery_status", Ok(Fault::Drop(Topic::BatteryStatus)));
        check("thaw battery_status", Ok(Fault::Thaw(Topic::BatteryStatus)));
        check("battery 0.2", Ok(Fault::Battery(0.2)));
        check("battery_temperature 70", Ok(Fault::BatteryTemperature(70.0)));
        check("gnss_loss", Ok(Fault::GnssLoss(true)));
        check("gnss_loss off", Ok(Fault::GnssLoss(false)));
        check("estimator_drift 1.5", Ok(Fault::EstimatorDrift(1.5)));
        check("estimator_invalid on", Ok(Fault::EstimatorInvalid(true)));
        check("motor_failure", Ok(Fault::MotorFailure(1)));
        check("motor_failure 2", Ok(Fault::MotorFailure(2)));
        check("wind 3 -4", Ok(Fault::Wind { north_m_s: 3.0, east_m_s: -4.0, gust_m_s: 0.0 }));
        check("wind 3 -4 1.5", Ok(Fault::Wind { north_m_s: 3.0, east_m_s: -4.0, gust_m_s: 1.5 }));
        check("link_loss 30", Ok(Fault::LinkLoss(30.0)));
        check("land_detector landed", Ok(Fault::LandDetector(Some(true))));
        check("land_detector flying", Ok(Fault::LandDetector(Some(false))));
        check("land_detector works", Ok(Fault::LandDetector(None)));
        check("blocked_landing", Ok(Fault::BlockedLanding(true)));
        check("hide_target 2", Ok(Fault::HideTarget(2.0)));
        check("gripper_stuck", Ok(Fault::GripperStuck(true)));
        check("gripper_stuck off", Ok(Fault::GripperStuck(false)));
        check(
            "intruder 1 2 3 4 5",
            Ok(Fault::Intruder {
                north_m: 1.0,
                east_m: 2.0,
                height_m: 3.0,
                north_m_s: 4.0,
                east_m_s: 5.0,
                kind: TrafficKind::Crewed,
            }),
        );
        let circle = Fault::Circling {
            north_m: 1.0,
            east_m: 2.0,
            height_m: 3.0,
            radius_m: 400.0,
            speed_m_s: 20.0,
            kind: TrafficKind::Crewed,
        };
        check("circling 1 2 3 400 20", Ok(circle));
        let head_on = Fault::HeadOn { distance_m: 2000.0, speed_m_s: 30.0, kind: TrafficKind::Uncrewed };
        check("head_on 2000 30 uncrewed", Ok(head_on));
        check("pilot_takes_over", Ok(Fault::PilotTakesOver(Mode::Manual)));
        check("pilot_takes_over land", Ok(Fault::PilotTakesOver(Mode::Land)));
        check("autopilot_failsafe return GCS", Ok(Fault::AutopilotFailsafe(Some((Mode::Return, "GCS".into())))));
        check("autopilot_failsafe off", Ok(Fault::AutopilotFailsafe(None)));
        check("restart_autopilot", Ok(Fault::RestartAutopilot(true)));
        check("restart_autopilot falls", Ok(Fault::RestartAutopilot(false)));
        check("flight_termination", Ok(Fault::FlightTermination));
        check("frame_jump 1 -2 3", Ok(Fault::FrameJump { north_m: 1.0, east_m: -2.0, down_m: 3.0 }));
        check("not_ready compass", Ok(Fault::NotReady(Some("compass".into()))));
        check("not_ready", Ok(Fault::NotReady(None)));
        check(
            "intruder 1 2 0 4 5 vessel",
            Ok(Fault::Intruder {
                north_m: 1.0,
                east_m: 2.0,
                height_m: 0.0,
                north_m_s: 4.0,
                east_m_s: 5.0,
                kind: TrafficKind::Vessel,
            }),
        );
        check("vibration 70", Ok(Fault::Vibration(70.0)));
        check("drain 1.5", Ok(Fault::Drain(1.5)));
        check("battery_fault", Ok(Fault::FaultyBattery(true)));
        check("position_jump 0 15", Ok(Fault::PositionJump { north_m: 0.0, east_m: 15.0, up_m: 0.0 }));
        check("position_jump 0 0 200", Ok(Fault::PositionJump { north_m: 0.0, east_m: 0.0, up_m: 200.0 }));
        check("heading_error -90", Ok(Fault::HeadingError(-90.0)));
        check("steering_error 30 -5", Ok(Fault::SteeringError { north_m: 30.0, east_m: -5.0 }));
        check("slow_flight 4", Ok(Fault::SlowFlight(Some(4.0))));
        check("slow_flight", Ok(Fault::SlowFlight(None)));
        check("clear", Ok(Fault::Clear));
    }

    #[test]
    fn a_mistake_is_answered_with_what_was_expected() {
        check("batery 0.2", Err("there is no fault `batery`; did you mean `battery`?"));
        check(
            "intruder 1 2 0 4 5 ghost",
            Err(
                "`intruder`: found `ghost`, expected crewed, uncrewed or vessel; usage: intruder NORTH EAST HEIGHT VNORTH VEAST [KIND]",
            ),
        );
        check("battery", Err("`battery`: FRACTION is missing; usage: battery FRACTION"));
        check("battery 2", Err("`battery`: FRACTION is 2, expected 0 to 1; usage: battery FRACTION"));
        check("battery NaN", Err("`battery`: FRACTION is NaN, expected 0 to 1; usage: battery FRACTION"));
        check("battery full", Err("`battery`: FRACTION is `full`, expected a number; usage: battery FRACTION"));
        check("battery 0 1", Err("`battery`: `1` is one argument too many; usage: battery FRACTION"));
        check("gnss_loss perhaps", Err("`gnss_loss`: found `perhaps`, expected on or off; usage: gnss_loss [on|off]"));
        check(
            "reject_acks 1.5",
            Err("`reject_acks`: COUNT is `1.5`, expected a whole number; usage: reject_acks COUNT"),
        );
        check(
            "drop vehicle_atitude",
            Err("`drop`: there is no topic `vehicle_atitude`; did you mean `vehicle_attitude`?; usage: drop TOPIC"),
        );
    }
}
