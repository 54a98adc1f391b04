//! A survey from takeoff to landing, with an area across its lines, as a whole flight.

use std::time::Duration;

use crate::stories::support::{mission_file, simulation};
use control_tower::policy::Policy;
use kittiwake_proto::v1::MissionOutcome;

const FIELD: &str = "\
name = \"field\"
[[objective]]
name = \"look\"
height_m = 30.0
flying = true
survey = { corners_m = [[100, 0], [300, 0], [300, 120], [100, 120]], spacing_m = 40 }
[[objective]]
name = \"home\"
north_m = 0.0
east_m = 0.0
height_m = 0.0
flying = false
[[area]]
name = \"road\"
kind = \"permission\"
corners_m = [[190, -100], [210, -100], [210, 220], [190, 220]]
";

#[test]
fn a_survey_is_flown_to_its_end() {
    let mission = mission_file("survey", FIELD);
    let mut simulation = simulation(Some(&mission), Policy::Grant);
    let report = simulation.fly(Duration::from_secs(600));
    simulation.pass(Duration::from_secs(60));
    let log = simulation.decision_log();
    let report = report.unwrap_or_else(|| panic!("no end:\n{log}"));
    assert_eq!(report.outcome(), MissionOutcome::Success, "\n{log}");
    assert_eq!(simulation.breaches(), [], "\n{log}");
    let story = [
        "plan 1: takeoff by 30 m; fly to (100, 20, 30); fly to (170, 20, 30), asking road; fly to (300, 20, 30); fly to (300, 60, 30); \
         fly to (100, 60, 30); fly to (100, 100, 30); fly to (300, 100, 30)",
        "asking for area road ahead",
        "area road: granted",
        "transition: stop",
        "plan 2: fly to (0, 0, 10); land",
        "every objective is settled",
    ];
    assert_eq!(simulation.story(&["plan", "permission", "contingency"]), story, "\n{log}");
}

#[test]
fn a_survey_that_was_paused_is_flown_to_its_end() {
    let mission = mission_file("survey_paused", FIELD);
    let mut simulation = simulation(Some(&mission), Policy::Grant);
    assert!(simulation.fly_until("step 3 of 8", Duration::from_secs(300)), "{}", simulation.decision_log());
    simulation.pass(Duration::from_secs(25));
    simulation.inject_flag("obstacle");
    let report = simulation.fly(Duration::from_secs(600)).unwrap_or_else(|| panic!("{}", simulation.decision_log()));
    let log = simulation.decision_log();
    assert_eq!(report.outcome(), MissionOutcome::Success, "\n{log}");
    assert_eq!((report.objectives[0].replans, simulation.breaches().len()), (1, 0), "\n{log}");
}
