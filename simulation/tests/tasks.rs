//! Declared skills, as whole flights: a winch that is carried out by a process of its own, and what that process does wrong.

use std::time::Duration;

use crate::stories::support::{mission_file, simulation};
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
