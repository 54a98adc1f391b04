//! A load that is dropped, as whole flights: where it left the vehicle, and how often.

use std::time::Duration;

use crate::stories::support::{mission_file, simulation};
use control_tower::policy::Policy;
use domain::geometry::Ned;
use kittiwake_proto::v1::{MissionOutcome, MissionReport, ObjectiveState};
use simulation::{Memory, Simulation};

const LIMIT: Duration = Duration::from_secs(1200);
/// One metre for the position skill, and as much for the estimate and for coming to rest.
const NEAR_M: f64 = 2.0;

/// Drops over `(0, 200)` from 30 m, once for each name, and lands at home.
fn flight(name: &str, drops: &[&str]) -> Simulation<'static> {
    let drop = |name: &&str| {
        format!(
            "[[objective]]\nname = \"{name}\"\nnorth_m = 0\neast_m = 200\nheight_m = 30\nflying = true\ndrop = true\n"
        )
    };
    let text = format!(
        "name = \"drop\"\n{}[[objective]]\nname = \"home\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\n",
        drops.iter().map(drop).collect::<String>()
    );
    simulation(Some(&mission_file(name, &text)), Policy::Grant)
}

/// The mission ends, and the load was released as often as expected: over the place, or not at all.
#[track_caller]
fn ends(simulation: &mut Simulation<'_>, expected: MissionOutcome, drops: usize) -> MissionReport {
    let report = simulation.fly(LIMIT);
    let log = simulation.decision_log();
    let report = report.unwrap_or_else(|| panic!("no end:\n{log}"));
    assert_eq!(report.outcome(), expected, "\n{log}");
    assert_eq!(simulation.breaches(), [], "\n{log}");
    let places = simulation.loads_released_at();
    let far_m = |it: &Ned| it.distance_m(Ned::new(0.0, 200.0, -30.0));
    assert!(places.len() == drops && places.iter().all(|it| far_m(it) < NEAR_M), "{places:?}\n{log}");
    report
}

#[test]
fn a_load_is_released_over_its_place() {
    let mut simulation = flight("drop", &["buoy"]);
    let report = ends(&mut simulation, MissionOutcome::Success, 1);
    let log = simulation.decision_log();
    assert!(report.objectives.iter().all(|it| it.state() == ObjectiveState::Success), "{report:?}");
    let plan = "plan 1: takeoff by 30 m; fly to (0, 200, 30); stop; release the load over (0, 200, 30)";
    assert!(simulation.story(&["plan"]).iter().any(|it| it == plan), "\n{log}");
    assert_eq!(simulation.release_commands(), 1, "\n{log}");
}

#[test]
fn a_gripper_that_is_stuck_fails_its_objective_and_the_vehicle_flies_home() {
    let mut simulation = flight("drop_stuck", &["buoy"]);
    simulation.inject_fault("gripper_stuck", &["on"]);
    let report = ends(&mut simulation, MissionOutcome::Failure, 0);
    let [buoy, home] = report.objectives.as_slice() else { panic!("{report:?}") };
    assert!(buoy.reason.contains("release failed 5 times in a row"), "{}", buoy.reason);
    assert!(buoy.reason.contains("the gripper holds its load"), "{}", buoy.reason);
    assert_eq!(home.state(), ObjectiveState::Success, "{}", simulation.decision_log());
}

#[test]
fn a_second_drop_has_nothing_to_release_so_that_the_mission_is_not_begun() {
    let mut simulation = flight("drop_twice", &["buoy", "again"]);
    let report = ends(&mut simulation, MissionOutcome::Failure, 0);
    assert!(report.objectives.iter().all(|it| it.state() == ObjectiveState::Failure), "{report:?}");
    assert_eq!(report.objectives[1].reason, "there is no load to release: the gripper is open already");
    assert_eq!(simulation.release_commands(), 0, "{}", simulation.decision_log());
}

#[test]
fn a_flag_that_interrupts_the_release_makes_it_no_second_one() {
    let mut simulation = flight("drop_interrupted", &["buoy"]);
    assert!(simulation.fly_until("step 4 of 4: release the load", LIMIT), "{}", simulation.decision_log());
    // The command was taken, and the gripper opens.
    simulation.pass(Duration::from_millis(300));
    simulation.inject_flag("obstacle");
    ends(&mut simulation, MissionOutcome::Success, 1);
    assert_eq!(simulation.release_commands(), 1, "{}", simulation.decision_log());
}

/// The new one does not know that a release was commanded: another could drop the next load.
#[test]
fn a_skill_manager_that_dies_while_the_gripper_opens_makes_it_no_second_one() {
    let mut simulation = flight("drop_killed", &["buoy"]);
    assert!(simulation.fly_until("step 4 of 4: release the load", LIMIT), "{}", simulation.decision_log());
    simulation.pass(Duration::from_millis(300));
    simulation.inject_fault("gripper_stuck", &["on"]);
    simulation.restart("skill-manager", Duration::from_millis(300), Memory::Restored);
    simulation.pass(Duration::from_secs(4));
    assert_eq!(simulation.release_commands(), 1, "{}", simulation.decision_log());
    simulation.inject_fault("gripper_stuck", &["off"]);
    ends(&mut simulation, MissionOutcome::Success, 1);
    assert_eq!(simulation.release_commands(), 1, "{}", simulation.decision_log());
}

/// Out of the air with it before the place is reached: the load stays on board.
#[test]
fn a_response_on_the_way_keeps_the_load() {
    let mut simulation = flight("drop_returned", &["buoy"]);
    assert!(simulation.fly_until("step 2 of 4", LIMIT), "{}", simulation.decision_log());
    simulation.pass(Duration::from_secs(5));
    simulation.inject_flag("operator_return");
    ends(&mut simulation, MissionOutcome::Emergency, 0);
    assert_eq!(simulation.release_commands(), 0, "{}", simulation.decision_log());
}
