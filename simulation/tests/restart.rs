//! Processes that are killed and started again, and a bus that loses, repeats and holds back: the mission is flown all the same.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::operator_command::Verb;
use kittiwake_proto::v1::{self, MissionOutcome, MissionPhase};
use simulation::{Disturbance, Memory, Simulation, System};

use crate::stories::support::story::kill;
use crate::stories::support::{each, sample, simulation};

const LIMIT: Duration = Duration::from_secs(2400);
/// Until a process that was killed is there again.
const DEAD: Duration = Duration::from_millis(300);
/// What the reference mission decides, one after the other: on the ground, climbing, on the way, waiting at a border, inside, landing.
const MOMENTS: [&str; 6] =
    ["plan 1", "step 1 of 5", "step 2 of 5", "asking for area A", "area A: granted", "step 5 of 5"];

#[track_caller]
fn when(decided: &str) -> Simulation<'static> {
    let mut simulation = simulation(None, Policy::Delay);
    assert!(simulation.fly_until(decided, LIMIT), "{}", simulation.decision_log());
    simulation
}

/// Flies to the end, which is a success, with nothing against it.
#[track_caller]
fn succeeds(mut simulation: Simulation<'_>, what: &str) {
    let report = simulation.fly(LIMIT);
    let outcome = report.map(|it| it.outcome());
    assert_eq!(outcome, Some(MissionOutcome::Success), "{what}:\n{}", simulation.decision_log());
    assert_eq!(simulation.breaches(), [], "{what}:\n{}", simulation.decision_log());
    assert_eq!(simulation.stale_setpoints(), [], "{what}");
}

#[test]
fn any_process_may_die_at_any_moment_of_the_mission() {
    for (moment, process) in sample(each(MOMENTS, ["mcm", "planner", "skill-manager", "monitor", "control-tower"])) {
        let mut simulation = when(moment);
        kill(&mut simulation, process, DEAD);
        succeeds(simulation, &format!("{process} dies at \"{moment}\""));
    }
}

#[test]
fn all_of_them_die_together() {
    for moment in sample(MOMENTS) {
        let mut simulation = when(moment);
        for process in ["mcm", "planner", "skill-manager", "monitor", "control-tower"] {
            kill(&mut simulation, process, DEAD);
        }
        succeeds(simulation, moment);
    }
}

#[test]
fn one_that_dies_again_while_it_is_started_is_there_later() {
    let mut simulation = when("step 2 of 5");
    for _ in 0..3 {
        kill(&mut simulation, "mcm", DEAD);
        simulation.pass(DEAD / 2);
    }
    succeeds(simulation, "three deaths in half a second");
}

/// What is forgotten in the air is asked of an operator, and the vehicle holds until then.
#[test]
fn a_manager_without_its_memory_holds_until_an_operator_lets_it_go_on() {
    let mut simulation = when("step 3 of 5");
    simulation.restart("mcm", DEAD, Memory::Lost);
    assert!(simulation.fly_until("`memory_unusable`: stop", Duration::from_secs(20)), "{}", simulation.decision_log());
    simulation.pass(Duration::from_secs(60));
    assert!(!simulation.is_on_ground() && simulation.phase() != MissionPhase::Over);
    simulation.order(Verb::Resume(v1::ResumeMission {}));
    succeeds(simulation, "a manager without its memory");
}

/// The ground's end of the link hangs for `cut_s`, and the monitor dies `dies_after_s` after that.
fn cut_and_monitor_dies(cut_s: u64, dies_after_s: u64) -> Simulation<'static> {
    let mut simulation = when("step 3 of 5");
    simulation.freeze("gateway", Duration::from_secs(cut_s));
    simulation.pass(Duration::from_secs(dies_after_s));
    kill(&mut simulation, "monitor", DEAD);
    simulation
}

/// What the one before had heard is missed by the one that has never heard it.
#[test]
fn a_link_that_is_cut_stays_cut_when_the_monitor_dies_and_the_vehicle_returns_as_without() {
    for dies_after_s in sample([5, 15, 60]) {
        let mut simulation = cut_and_monitor_dies(1000, dies_after_s);
        assert!(simulation.fly_until("`link_lost`: stop", Duration::from_secs(20)) || 10 < dies_after_s);
        simulation.pass(Duration::from_secs(60));
        let log = simulation.decision_log();
        assert!(simulation.is_up("link_lost"), "dead after {dies_after_s} s:\n{log}");
        assert!(!log.contains("`link_lost` is over"), "dead after {dies_after_s} s:\n{log}");
        assert!(simulation.fly_until("`link_gone`: return_home", Duration::from_secs(120)), "{log}");
        assert_eq!(simulation.fly(LIMIT).map(|it| it.outcome()), Some(MissionOutcome::Emergency), "{log}");
        assert_eq!(simulation.breaches(), []);
    }
}

#[test]
fn a_link_that_is_back_ends_the_hold_that_a_monitor_before_has_begun() {
    for cut_s in [18, 40] {
        let mut simulation = cut_and_monitor_dies(cut_s, 15);
        assert!(simulation.fly_until("`link_lost` is over", LIMIT), "{}", simulation.decision_log());
        succeeds(simulation, &format!("cut for {cut_s} s"));
    }
}

#[test]
fn when_monitor_and_manager_die_together_the_link_stays_cut() {
    for dies_after_s in [5, 15] {
        let mut simulation = cut_and_monitor_dies(1000, dies_after_s);
        kill(&mut simulation, "mcm", DEAD);
        assert!(simulation.fly_until("`link_gone`: return_home", LIMIT), "{}", simulation.decision_log());
        let log = simulation.decision_log();
        assert!(!log.contains("`link_lost` is over"), "dead after {dies_after_s} s:\n{log}");
    }
}

#[test]
fn a_tower_that_is_silent_stays_lost_when_the_monitor_dies() {
    let mut simulation = when("step 3 of 5");
    simulation.freeze("control-tower", Duration::from_secs(60));
    assert!(simulation.fly_until("flag `tower_lost` raised", Duration::from_secs(20)));
    kill(&mut simulation, "monitor", DEAD);
    simulation.pass(Duration::from_secs(30));
    assert!(simulation.is_up("tower_lost"), "{}", simulation.decision_log());
    assert!(simulation.fly_until("`tower_lost` is over", Duration::from_secs(60)), "{}", simulation.decision_log());
}

/// Nobody misses what was never there.
#[test]
fn a_vehicle_without_a_ground_flies_on_when_the_monitor_dies() {
    let system = System::read(&crate::stories::support::config()).unwrap();
    let mission = std::fs::read_to_string(crate::stories::support::config().join("missions/reference.toml")).unwrap();
    let mut simulation = system.simulation(&mission, Policy::Grant, Default::default()).unwrap();
    assert!(simulation.fly_until("step 3 of 5", LIMIT), "{}", simulation.decision_log());
    kill(&mut simulation, "monitor", DEAD);
    succeeds(simulation, "without a ground");
}

#[test]
fn one_message_in_twenty_lost_one_in_ten_twice_and_all_late_cost_time_and_no_mission() {
    for seed in sample(0..5) {
        let mut simulation = simulation(None, Policy::Grant);
        let late = Duration::from_millis(50);
        simulation.disturb(Disturbance { seed, lost: 0.05, twice: 0.1, late }, LIMIT);
        succeeds(simulation, &format!("seed {seed}"));
    }
}
