//! The faults that can be injected at run time, and how they are written.
//!
//! What a fault does is decided in `inject.rs`. A new one is an entry in [`mod@catalogue`], a variant
//! of `Fault`, and the match arm that the compiler asks for.

use domain::file::did_you_mean;
use kittiwake_proto::topics::Topic;

mod arguments;
pub mod catalogue;

use arguments::Arguments;
use catalogue::catalogue;

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
    },
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
        check(
            "intruder 1 2 3 4 5",
            Ok(Fault::Intruder { north_m: 1.0, east_m: 2.0, height_m: 3.0, north_m_s: 4.0, east_m_s: 5.0 }),
        );
        check("clear", Ok(Fault::Clear));
    }

    #[test]
    fn a_mistake_is_answered_with_what_was_expected() {
        check("batery 0.2", Err("there is no fault `batery`; did you mean `battery`?"));
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
