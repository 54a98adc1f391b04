//! The reference mission and what may happen to it.

use control_tower::policy::Policy;
use fake_autopilots::bridged::BRIDGE_DIES;
use fake_autopilots::wire::Faults;
use fake_autopilots::{BATTERY_FAILSAFE, Kind, PRECISION_LANDING};
use kittiwake_proto::v1::MissionOutcome;
use simulation::Simulation;

use crate::stories::support::sample;

use super::{BOTH, LIMIT, assert_success, fly, mission, reference, with_keys};

#[test]
fn the_reference_mission_is_flown_over_both_autopilots() {
    for kind in sample(BOTH) {
        let mut simulation = reference(kind, Policy::Grant, Faults::default());
        let report = fly(&mut simulation);
        assert_success(&simulation, &report);
    }
}

#[test]
fn a_signed_link_flies_the_mission_also_when_the_bridge_dies_and_forgets_what_time_it_was() {
    for kind in sample(BOTH) {
        let mut simulation = with_keys(kind, Policy::Grant, Faults::default(), Some("11"), Some("11"));
        assert!(simulation.fly_until("step 4 of 5", LIMIT), "{kind:?}\n{}", simulation.decision_log());
        simulation.inject_fault(BRIDGE_DIES, &["3"]);
        let report = fly(&mut simulation);
        assert_success(&simulation, &report);
    }
}

#[test]
fn a_mission_ends_when_the_failsafe_of_an_autopilot_has_landed_it() {
    let mut simulation = reference(Kind::ArduPilot, Policy::Grant, Faults::default());
    assert!(simulation.fly_until("step 4 of 5", LIMIT), "\n{}", simulation.decision_log());
    simulation.pass(std::time::Duration::from_secs(10));
    simulation.inject_fault(BATTERY_FAILSAFE, &[]);
    let report = fly(&mut simulation);
    // It waits for an operator for a while: what the autopilot landed it for may be mended.
    assert_eq!(report.outcome(), MissionOutcome::Failure, "{}\n{}", report.reason, simulation.decision_log());
    assert!(report.reason.contains("landed because of `autopilot_comes_down`"), "{}", report.reason);
    assert_eq!(simulation.breaches(), [], "\n{}", simulation.decision_log());
}

#[test]
fn without_the_same_key_on_both_sides_nothing_takes_off() {
    for kind in sample(BOTH) {
        for (autopilots, bridges) in [(None, Some("11")), (Some("11"), None), (Some("11"), Some("22"))] {
            let mut simulation = with_keys(kind, Policy::Grant, Faults::default(), autopilots, bridges);
            let _ = simulation.fly(std::time::Duration::from_secs(60));
            let log = simulation.decision_log();
            assert!(!log.contains("step 1 succeeded"), "{kind:?}, {autopilots:?} and {bridges:?}\n{log}");
        }
    }
}

/// A flight to a buoy, at which this is done, and back.
fn to_a_buoy(name: &str, does: &str, kind: Kind) -> Simulation<'static> {
    let text = format!(
        "name = \"gripper\"
        [[objective]]\nname = \"buoy\"\nnorth_m = 0\neast_m = 100\nheight_m = 10\nflying = true\n{does}
        [[objective]]\nname = \"home\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\n"
    );
    let file = crate::stories::support::mission_file(&format!("{name}_{kind:?}"), &text);
    mission(Some(&file), kind, Policy::Grant, Faults::default(), None, None)
}

#[test]
fn a_skill_that_is_a_command_is_carried_out_by_the_autopilot() {
    for kind in BOTH {
        let does = "do = [{ skill = \"gripper_release\" }]";
        let mut simulation = to_a_buoy("gripper", does, kind);
        let report = fly(&mut simulation);
        assert_success(&simulation, &report);
    }
}

#[test]
fn a_load_is_released_over_both_autopilots() {
    for kind in BOTH {
        let mut simulation = to_a_buoy("drop", "drop = true", kind);
        let report = fly(&mut simulation);
        assert_success(&simulation, &report);
        assert_eq!(simulation.loads_released_at().len(), 1, "{kind:?}\n{}", simulation.decision_log());
    }
}

#[test]
fn a_landing_whose_target_is_lost_is_tried_again_and_fails_the_objective() {
    let text = "name = \"deck\"
        [[objective]]\nname = \"away\"\nnorth_m = 0\neast_m = 60\nheight_m = 10\nflying = true
        [[objective]]\nname = \"deck\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\nland_on_target = true\n";
    let file = crate::stories::support::mission_file("deck", text);
    for (hidden_below_m, outcome, losses) in [("0", MissionOutcome::Success, 0), ("8", MissionOutcome::Failure, 3)] {
        let mut simulation = mission(Some(&file), Kind::ArduPilot, Policy::Grant, Faults::default(), None, None);
        simulation.inject_fault(PRECISION_LANDING, &[]);
        simulation.inject_fault("hide_target", &[hidden_below_m]);
        let report = fly(&mut simulation);
        let log = simulation.decision_log();
        let found = (report.outcome(), log.matches("`landing_target_lost` raised").count());
        assert_eq!(found, (outcome, losses), "{}\n{log}", report.reason);
    }
}

#[test]
fn a_survey_by_overlap_has_its_pictures_over_both_autopilots() {
    // From 40 m a picture shows 60 by 40 m: 30 m between lines, 12 m between pictures.
    const TEXT: &str = "name = \"field\"
        [camera]\nsensor_width_mm = 13.2\nsensor_height_mm = 8.8\nfocal_length_mm = 8.8
        [[objective]]\nname = \"look\"\nheight_m = 40\nflying = true\nalong = [{ skill = \"camera_by_distance\" }]
        survey = { corners_m = [[60, 0], [180, 0], [180, 90], [60, 90]], side_overlap = 0.5, forward_overlap = 0.7 }
        [[objective]]\nname = \"home\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\n";
    for kind in BOTH {
        let file = crate::stories::support::mission_file(&format!("overlap_{kind:?}"), TEXT);
        let mut simulation = mission(Some(&file), kind, Policy::Grant, Faults::default(), None, None);
        let report = fly(&mut simulation);
        assert_success(&simulation, &report);
        let pictures = simulation.pictures();
        let numbers: Vec<u32> = pictures.iter().map(|it| it.number).collect();
        // Three lines of 120 m, and the ways between them.
        assert!((30..=40).contains(&numbers.len()) && numbers.is_sorted_by(|a, b| a < b), "{kind:?}: {numbers:?}");
        assert!(pictures.iter().all(|it| it.place.is_some_and(|it| (50.0..70.0).contains(&it.altitude_amsl_m))));
    }
}
