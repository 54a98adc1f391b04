//! Declared skills, as whole flights: a winch that is carried out by a process of its own, and what that process does wrong.

use std::time::Duration;

use crate::stories::support::{config_with, mission_file, simulation, simulation_of};
use control_tower::policy::Policy;
use kittiwake_proto::v1::{MissionOutcome, MissionReport, ObjectiveState};
use simulation::{Conduct, Memory, Simulation};

const LIMIT: Duration = Duration::from_secs(1200);

/// Winches a load down at `(0, 200)` from 15 m, as often as there are lengths, and lands at home.
fn flight(name: &str, lengths_m: &[f64]) -> Simulation<'static> {
    let tasks: Vec<String> =
        lengths_m.iter().map(|it| format!("{{ skill = \"winch_down\", length_m = {it:.1} }}")).collect();
    let text = format!(
        "name = \"winch\"\n\
         [[objective]]\nname = \"boat\"\nnorth_m = 0\neast_m = 200\nheight_m = 15\nflying = true\ndo = [{}]\n\
         [[objective]]\nname = \"home\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\n",
        tasks.join(", ")
    );
    simulation(Some(&mission_file(name, &text)), Policy::Grant)
}

#[track_caller]
fn ends(simulation: &mut Simulation<'_>, expected: MissionOutcome) -> MissionReport {
    let report = simulation.fly(LIMIT);
    let log = simulation.decision_log();
    let report = report.unwrap_or_else(|| panic!("no end:\n{log}"));
    assert_eq!(report.outcome(), expected, "\n{log}");
    assert_eq!(simulation.breaches(), [], "\n{log}");
    report
}

#[test]
fn tasks_are_done_one_after_the_other_where_the_vehicle_hovers() {
    let mut simulation = flight("tasks", &[12.0, 3.0]);
    let report = ends(&mut simulation, MissionOutcome::Success);
    let log = simulation.decision_log();
    assert!(report.objectives.iter().all(|it| it.state() == ObjectiveState::Success), "{report:?}");
    let plan = "plan 1: takeoff by 15 m; fly to (0, 200, 15); stop; winch_down (length_m 12) over (0, 200, 15); \
                winch_down (length_m 3) over (0, 200, 15)";
    assert!(simulation.story(&["plan"]).iter().any(|it| it == plan), "\n{log}");
}

/// The objective fails, for this reason, and the vehicle flies home.
#[track_caller]
fn fails(name: &str, conduct: Conduct, reason: &str) {
    let mut simulation = flight(name, &[12.0]);
    assert!(simulation.fly_until("step 2 of 4: fly to", LIMIT), "{}", simulation.decision_log());
    simulation.skills_conduct(conduct);
    let report = ends(&mut simulation, MissionOutcome::Failure);
    let [boat, home] = report.objectives.as_slice() else { panic!("{report:?}") };
    assert!(boat.reason.contains(reason), "{}\n{}", boat.reason, simulation.decision_log());
    assert_eq!(home.state(), ObjectiveState::Success, "{}", simulation.decision_log());
    assert!(simulation.decision_log().contains("skill_failed"), "{}", simulation.decision_log());
}

#[test]
fn a_process_that_does_not_do_its_task_fails_the_objective_and_nothing_else() {
    fails("tasks_fail", Conduct::Fails, "winch_down ended as `snagged`");
    fails("tasks_endless", Conduct::Endless, "winch_down has not ended after 90 s");
    fails("tasks_deaf", Conduct::Deaf, "the process of winch_down does not answer");
    fails("tasks_gone", Conduct::Gone, "no process offers skill `winch_down`");
}

#[test]
fn a_process_that_dies_at_its_task_fails_the_objective() {
    let mut simulation = flight("tasks_dies", &[12.0]);
    assert!(simulation.fly_until("step 4 of 4: winch_down", LIMIT), "{}", simulation.decision_log());
    simulation.pass(Duration::from_secs(5));
    simulation.skills_conduct(Conduct::Gone);
    let report = ends(&mut simulation, MissionOutcome::Failure);
    let reason = &report.objectives[0].reason;
    assert!(reason.contains("has fallen silent") || reason.contains("no process offers"), "{reason}");
}

#[test]
fn nothing_takes_off_for_a_skill_that_nobody_offers() {
    let mut simulation = flight("tasks_absent", &[12.0]);
    simulation.skills_conduct(Conduct::Gone);
    assert!(!simulation.fly_until("step 2 of", Duration::from_secs(120)), "{}", simulation.decision_log());
    assert!(simulation.is_up("skill_missing"), "{}", simulation.decision_log());
    simulation.skills_conduct(Conduct::Nominal);
    ends(&mut simulation, MissionOutcome::Success);
}

#[test]
fn an_emergency_interrupts_a_task_and_waits_until_that_is_safe() {
    let mut simulation = flight("tasks_interrupted", &[12.0]);
    assert!(simulation.fly_until("step 4 of 4: winch_down", LIMIT), "{}", simulation.decision_log());
    simulation.pass(Duration::from_secs(5));
    // It does not hear that it is to end: the next skill waits for `interrupt_s`, five seconds, and no longer.
    simulation.skills_conduct(Conduct::Deaf);
    simulation.inject_flag("battery_low");
    let east_m = |it: &Simulation<'_>| it.position().map_or(0.0, |it| it.east_m);
    simulation.pass(Duration::from_secs(4));
    assert!((east_m(&simulation) - 200.0).abs() < 3.0, "{}", simulation.decision_log());
    simulation.pass(Duration::from_secs(6));
    assert!(east_m(&simulation) < 190.0, "{}", simulation.decision_log());
    let report = ends(&mut simulation, MissionOutcome::Emergency);
    assert_ne!(report.objectives[0].state(), ObjectiveState::Success, "{report:?}");
}

/// The winch works below 40 m: down to it, and up again for the way home.
#[test]
fn a_task_at_another_height_is_come_to_straight_down() {
    let text = "name = \"winch\"\n\
         [[objective]]\nname = \"boat\"\nnorth_m = 0\neast_m = 200\nheight_m = 60\nflying = true\n\
         do = [{ skill = \"winch_down\", length_m = 12.0 }]\n\
         [[objective]]\nname = \"home\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\n";
    let mut simulation = simulation(Some(&mission_file("tasks_height", text)), Policy::Grant);
    ends(&mut simulation, MissionOutcome::Success);
    let plan = "plan 1: takeoff by 60 m; fly to (0, 200, 60); fly to (0, 200, 39); stop; \
                winch_down (length_m 12) over (0, 200, 39); fly to (0, 200, 60)";
    assert!(simulation.story(&["plan"]).iter().any(|it| it == plan), "\n{}", simulation.decision_log());
}

/// If a process dies during a task, the load is delivered, and the mission goes on.
#[test]
fn no_process_that_dies_during_a_task_ends_the_mission() {
    for process in ["monitor", "planner", "mcm", "skill-manager"] {
        let mut simulation = flight(&format!("tasks_{process}"), &[12.0, 3.0]);
        assert!(simulation.fly_until("step 4 of 5: winch_down", LIMIT), "{}", simulation.decision_log());
        simulation.pass(Duration::from_secs(5));
        simulation.restart(process, Duration::from_secs(2), Memory::Restored);
        ends(&mut simulation, MissionOutcome::Success);
    }
}

/// A camera and a gas sensor that run along a leg, and a meter that is read on the ground.
const MORE: [(&str, &str); 3] = [
    (
        "film",
        "version = 1\nsummary = \"Films\"\nvehicle = \"flies\"\nprecondition = \"position.height_m >= 20 m\"\n\
         invariant = \"position.height_m >= 18 m\"\noutcome = { done = \"success\" }\n",
    ),
    (
        "sniff",
        "version = 1\nsummary = \"Measures gas\"\nvehicle = \"flies\"\n\
         invariant = \"position.distance_home_m < 300 m\"\noutcome = { done = \"success\", broken = \"failure\" }\n",
    ),
    (
        "read_meter",
        "version = 1\nsummary = \"Reads a meter\"\nvehicle = \"stands\"\nseconds = 20.0\nlimit_s = 60.0\n\
         precondition = \"not vehicle.flying\"\noutcome = { read = \"success\", broken = \"failure\" }\n",
    ),
];

/// A mission with the skills of [`MORE`], whose first objective has these lines; it ends at home.
fn flight_with_more(name: &str, objective: &str) -> Simulation<'static> {
    let config = config_with(name, &[]);
    for (skill, text) in MORE {
        std::fs::write(config.join(format!("skills/{skill}.toml")), text).unwrap();
    }
    let text = format!(
        "name = \"more\"\n[[objective]]\nname = \"there\"\n{objective}\n\
         [[objective]]\nname = \"home\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\n"
    );
    simulation_of(&config, Some(&mission_file(name, &text)), Policy::Grant)
}

/// It measures all the way to a place so far to the east, and flies home.
fn measures_to(name: &str, east_m: f64) -> Simulation<'static> {
    let there = format!("north_m = 0\neast_m = {east_m:?}\nheight_m = 15\nflying = true");
    let flight = flight_with_more(name, &format!("{there}\nalong = [{{ skill = \"sniff\" }}]"));
    assert_eq!(flight.tasks_along(), [""; 0]);
    flight
}

#[test]
fn a_task_along_a_leg_begins_and_ends_with_its_flight() {
    let mut simulation = measures_to("along", 200.0);
    assert!(
        simulation.fly_until("step 2 of 2: fly to (0, 200, 15) with sniff", LIMIT),
        "{}",
        simulation.decision_log()
    );
    simulation.pass(Duration::from_secs(5));
    assert_eq!(simulation.tasks_along(), ["sniff begins"], "{}", simulation.decision_log());
    ends(&mut simulation, MissionOutcome::Success);
    assert_eq!(simulation.tasks_along(), ["sniff begins", "sniff cancelled"], "{}", simulation.decision_log());
}

/// From below its height it climbs first, where it is.
#[test]
fn a_task_along_a_leg_has_its_height_from_the_beginning() {
    let low = "north_m = 0\neast_m = 50\nheight_m = 6\nflying = true\n\
               [[objective]]\nname = \"higher\"\nnorth_m = 0\neast_m = 200\nheight_m = 25\nflying = true\n\
               along = [{ skill = \"film\" }]";
    let mut simulation = flight_with_more("along_height", low);
    ends(&mut simulation, MissionOutcome::Success);
    let plan = "plan 2: fly to (0, 50, 25); fly to (0, 200, 25) with film";
    assert!(simulation.story(&["plan"]).iter().any(|it| it == plan), "\n{}", simulation.decision_log());
}

/// No process hears anything between two lines.
#[test]
fn a_task_along_a_survey_goes_on_from_its_first_line_to_its_last() {
    let survey = "survey = { corners_m = [[50, 0], [150, 0], [150, 60], [50, 60]], spacing_m = 20 }\n\
                  height_m = 20\nflying = true\nalong = [{ skill = \"camera_by_distance\", every_m = 10.0 }]";
    let mut simulation = flight_with_more("along_survey", survey);
    ends(&mut simulation, MissionOutcome::Success);
    let steps: Vec<String> = simulation.story(&["step"]).into_iter().filter(|it| it.contains("with camera")).collect();
    assert_eq!(steps.len(), 5, "three lines and two ways between them: {steps:?}");
    assert_eq!(simulation.tasks_along(), ["camera_by_distance begins", "camera_by_distance cancelled"]);
}

#[test]
fn a_task_that_fails_along_a_leg_fails_the_objective_once_the_vehicle_is_there() {
    #[track_caller]
    fn check(name: &str, east_m: f64, conduct: Conduct, reason: &str) {
        let mut simulation = measures_to(name, east_m);
        assert!(simulation.fly_until("step 2 of 2: fly to", LIMIT), "{}", simulation.decision_log());
        simulation.skills_conduct(if conduct == Conduct::Gone { Conduct::Nominal } else { conduct });
        simulation.pass(Duration::from_secs(4));
        simulation.skills_conduct(conduct);
        let report = ends(&mut simulation, MissionOutcome::Failure);
        let log = simulation.decision_log();
        let [there, home] = report.objectives.as_slice() else { panic!("{report:?}") };
        assert!(there.reason.contains(reason), "{}\n{log}", there.reason);
        assert_eq!((home.state(), there.replans), (ObjectiveState::Success, 0), "{log}");
        let steps = simulation.story(&["step"]);
        assert!(steps.iter().any(|it| it.contains("the flight goes on")), "\n{log}");
        assert!(steps.iter().any(|it| it == "step 2 succeeded"), "\n{log}");
    }
    check("along_gone", 200.0, Conduct::Gone, "the process of sniff has fallen silent");
    check("along_deaf", 200.0, Conduct::Deaf, "the process of sniff does not answer");
    check("along_fails", 200.0, Conduct::Fails, "sniff ended as `broken`");
    check("along_leaves", 400.0, Conduct::Nominal, "sniff: invariant not met: `position.distance_home_m < 300 m`");
}

#[test]
fn an_emergency_ends_a_task_along_a_leg_and_waits_for_nothing() {
    let mut simulation = measures_to("along_interrupted", 250.0);
    assert!(simulation.fly_until("step 2 of 2: fly to", LIMIT), "{}", simulation.decision_log());
    simulation.pass(Duration::from_secs(8));
    let east_m = |it: &Simulation<'_>| it.position().map_or(0.0, |it| it.east_m);
    let reached_m = east_m(&simulation);
    simulation.inject_flag("battery_low");
    simulation.pass(Duration::from_secs(8));
    assert_eq!(simulation.tasks_along(), ["sniff begins", "sniff cancelled"], "{}", simulation.decision_log());
    assert!(east_m(&simulation) < reached_m + 10.0, "{}", simulation.decision_log());
    ends(&mut simulation, MissionOutcome::Emergency);
}

#[test]
fn no_process_that_dies_along_a_leg_ends_the_mission() {
    for process in ["monitor", "planner", "mcm", "skill-manager"] {
        let mut simulation = measures_to(&format!("along_{process}"), 250.0);
        assert!(simulation.fly_until("step 2 of 2: fly to", LIMIT), "{}", simulation.decision_log());
        simulation.pass(Duration::from_secs(8));
        simulation.restart(process, Duration::from_secs(2), Memory::Restored);
        ends(&mut simulation, MissionOutcome::Success);
        assert_eq!(simulation.tasks_along().last().map(String::as_str), Some("sniff cancelled"), "{process}");
    }
}

#[test]
fn a_task_on_the_ground_comes_between_landing_and_takeoff() {
    let ground = "north_m = 0\neast_m = 60\nheight_m = 0\nflying = false\ndo = [{ skill = \"read_meter\" }]";
    let mut simulation = flight_with_more("ground", ground);
    assert!(simulation.fly_until("step 4 of 4: read_meter", LIMIT), "{}", simulation.decision_log());
    simulation.pass(Duration::from_secs(10));
    assert!(simulation.is_on_ground(), "{}", simulation.decision_log());
    ends(&mut simulation, MissionOutcome::Success);
    let log = simulation.decision_log();
    let done = simulation.story(&["step"]).into_iter().filter(|it| it.contains("read") || it.contains("takeoff"));
    let expected = [
        "step 1 of 4: takeoff by 10 m",
        "step 4 of 4: read_meter at (0, 60, 0)",
        "step 4 succeeded: read",
        "step 1 of 3: takeoff by 10 m",
    ];
    assert_eq!(done.collect::<Vec<_>>(), expected, "\n{log}");
}

/// A flag that ends the mission on the ground, and a task that fails there.
#[test]
fn a_task_on_the_ground_is_interrupted_and_fails_like_any_other() {
    let ground = "north_m = 0\neast_m = 60\nheight_m = 0\nflying = false\ndo = [{ skill = \"read_meter\" }]";
    let mut simulation = flight_with_more("ground_fails", ground);
    assert!(simulation.fly_until("step 4 of 4: read_meter", LIMIT), "{}", simulation.decision_log());
    simulation.skills_conduct(Conduct::Gone);
    simulation.pass(Duration::from_secs(30));
    assert!(simulation.is_on_ground(), "{}", simulation.decision_log());
    simulation.skills_conduct(Conduct::Nominal);
    ends(&mut simulation, MissionOutcome::Success);
}
