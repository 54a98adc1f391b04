//! A permission that is asked for ahead, as a whole flight.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::MissionOutcome;
use simulation::{Machine, Setup, Simulation};

use crate::stories::support::{config_with, mission_file};

/// A place to land at, in an area that is flown over without a permission and landed in with one.
const YARD: &str = "\
name = \"yard\"
[[objective]]
name = \"deliver\"
north_m = 0.0
east_m = 150.0
height_m = 0.0
flying = false
[[area]]
name = \"yard\"
kind = \"permission\"
ceiling_m = 5.0
corners_m = [[-60, 90], [60, 90], [60, 210], [-60, 210]]
";

/// Flies there while the tower answers after three seconds; returns for how long, and what was said about permissions.
#[track_caller]
fn fly(ask_ahead_s: &str) -> (f64, Vec<String>) {
    let config = config_with("asking-ahead", &[("delay_s", "3.0"), ("ask_ahead_s", ask_ahead_s)]);
    let mission = mission_file("yard", YARD);
    let setup = Setup {
        config: &config,
        mission: Some(&mission),
        permissions: Policy::Delay,
        seed: 1,
        machine: Machine::Ideal,
    };
    let mut simulation = Simulation::new(&setup).unwrap();
    let report = simulation.fly(Duration::from_secs(600));
    let log = simulation.decision_log();
    let report = report.unwrap_or_else(|| panic!("no end:\n{log}"));
    assert_eq!(report.outcome(), MissionOutcome::Success, "\n{log}");
    assert_eq!(simulation.breaches(), [], "\n{log}");
    (report.duration_s, simulation.story(&["permission"]))
}

#[test]
fn a_permission_that_is_asked_for_ahead_saves_the_wait_for_it() {
    let (at_border_s, said) = fly("0.0");
    assert_eq!(said, ["asking for area yard", "area yard: granted"]);
    let (ahead_s, said) = fly("8.0");
    assert_eq!(said, ["asking for area yard ahead", "area yard: granted"]);
    let saved_s = at_border_s - ahead_s;
    assert!((2.0..4.0).contains(&saved_s), "{at_border_s} s without, {ahead_s} s with");
}
