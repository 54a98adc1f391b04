//! What may happen to a flight.

use std::fmt;
use std::time::Duration;

use kittiwake_proto::v1::Decision;
use kittiwake_proto::v1::operator_command::Verb;

use crate::{Disturbance, Memory};

/// Something that happens to a flight.
#[derive(Debug, Clone, PartialEq)]
pub enum Trouble {
    /// A fault of the simulator's catalogue.
    Fault {
        /// Its name.
        name: String,
        /// Its arguments.
        args: Vec<String>,
    },
    /// A flag is raised by hand.
    Flag(String),
    /// An operator gives an order.
    Order(Verb),
    /// The control tower decides by hand.
    Decide {
        /// About which area.
        area: String,
        /// What.
        decision: Decision,
        /// Mission seconds for which a grant holds; `None`: as configured.
        valid_for_s: Option<f64>,
    },
    /// A process does nothing for a while.
    Hang {
        /// Which.
        process: String,
        /// For how long.
        time: Duration,
    },
    /// A process is killed and started again.
    Kill {
        /// Which.
        process: String,
        /// How long it takes until it is there again.
        time: Duration,
        /// What it knows then.
        memory: Memory,
    },
    /// Messages are lost, come twice and late.
    Disturb {
        /// How.
        disturbance: Disturbance,
        /// For how long.
        time: Duration,
    },
    /// The wall clocks are set by this many milliseconds.
    Clock(i64),
    /// An operator uploads this mission file.
    Upload(String),
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Trouble::Fault { name, args } if args.is_empty() => write!(f, "fault {name}"),
            Trouble::Fault { name, args } => write!(f, "fault {name} {}", args.join(" ")),
            Trouble::Flag(name) => write!(f, "flag {name}"),
            Trouble::Order(verb) => write!(f, "operator orders: {}", order(verb)),
            Trouble::Decide { area, decision, valid_for_s } => {
                let decision = decision.as_str_name().trim_start_matches("DECISION_").to_lowercase();
                write!(f, "tower decides: {decision} {area}")?;
                valid_for_s.map_or(Ok(()), |valid_s| write!(f, ", valid for {valid_s} s"))
            }
            Trouble::Hang { process, time } => write!(f, "{process} hangs for {} s", time.as_secs_f64()),
            Trouble::Kill { process, time, memory } => {
                write!(f, "{process} is killed, and is there again {memory} after {} s", time.as_secs_f64())
            }
            Trouble::Disturb { disturbance: Disturbance { lost, twice, late, .. }, time } => {
                let (lost, twice) = (lost * 100.0, twice * 100.0);
                write!(f, "for {} s {lost:.0} % of all messages are lost and {twice:.0} % ", time.as_secs_f64())?;
                write!(f, "come twice, each late by up to {} ms", late.as_millis())
            }
            Trouble::Clock(by_ms) => write!(f, "clocks are set by {by_ms} ms"),
            Trouble::Upload(text) => {
                let areas: Vec<&str> = text.split("[[area]]").skip(1).map(str::trim).collect();
                let areas =
                    if areas.is_empty() { "without areas".to_owned() } else { areas.join(", ").replace('\n', ", ") };
                write!(f, "operator uploads a mission: the objectives and sites as before, {areas}")
            }
        }
    }
}

/// An order in words.
fn order(verb: &Verb) -> String {
    let (what, overrides) = match verb {
        Verb::Start(_) => ("start".to_owned(), false),
        Verb::Pause(it) => ("pause".to_owned(), it.overrides),
        Verb::Resume(_) => ("resume".to_owned(), false),
        Verb::Abort(it) => ("abort".to_owned(), it.overrides),
        Verb::Return(it) => ("return".to_owned(), it.overrides),
        Verb::LandAt(it) => {
            let place = it.position.unwrap_or_default();
            (format!("land at ({}, {})", place.north_m, place.east_m), it.overrides)
        }
        Verb::Replan(_) => ("replan".to_owned(), false),
        Verb::Acknowledge(it) => (format!("acknowledge {}", it.flag), false),
        Verb::Inspected(_) => ("inspected".to_owned(), false),
        Verb::DecidePlan(_) => ("decide about the plan".to_owned(), false),
    };
    if overrides { what + ", before every response that may be overridden" } else { what }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kittiwake_proto::v1;

    #[test]
    fn a_trouble_is_told_in_words() {
        #[track_caller]
        fn check(trouble: Trouble, expected: &str) {
            assert_eq!(trouble.to_string(), expected);
        }
        let wind = ["6", "-6"].map(str::to_owned).to_vec();
        check(Trouble::Fault { name: "wind".into(), args: wind }, "fault wind 6 -6");
        check(Trouble::Fault { name: "clear".into(), args: Vec::new() }, "fault clear");
        check(Trouble::Flag("obstacle".into()), "flag obstacle");
        check(Trouble::Hang { process: "mcm".into(), time: Duration::from_secs(4) }, "mcm hangs for 4 s");
        let time = Duration::from_millis(300);
        let kill = |memory| Trouble::Kill { process: "planner".into(), time, memory };
        check(kill(Memory::Restored), "planner is killed, and is there again with its memory after 0.3 s");
        check(kill(Memory::Lost), "planner is killed, and is there again without its memory after 0.3 s");
        let disturbance = Disturbance { seed: 1, lost: 0.1, twice: 0.05, late: Duration::from_millis(40) };
        let expected = "for 9 s 10 % of all messages are lost and 5 % come twice, each late by up to 40 ms";
        check(Trouble::Disturb { disturbance, time: Duration::from_secs(9) }, expected);
        check(Trouble::Clock(-90_000), "clocks are set by -90000 ms");
        let grant = Trouble::Decide { area: "A".into(), decision: Decision::Grant, valid_for_s: Some(20.0) };
        check(grant, "tower decides: grant A, valid for 20 s");
        let revoke = Trouble::Decide { area: "A".into(), decision: Decision::Revoke, valid_for_s: None };
        check(revoke, "tower decides: revoke A");
        let pause = Verb::Pause(v1::PauseMission { overrides: true });
        check(Trouble::Order(pause), "operator orders: pause, before every response that may be overridden");
        let position = Some(v1::Ned { north_m: -20.0, east_m: 300.0, down_m: 0.0 });
        let land = Verb::LandAt(v1::LandAt { position, overrides: false });
        check(Trouble::Order(land), "operator orders: land at (-20, 300)");
    }
}
