//! A busy machine delivers messages late and in another order, and lets processes wait: the mission is the same.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::MissionOutcome;
use simulation::{Machine, Setup, Simulation};

use crate::stories::support::sample;

const LIMIT: Duration = Duration::from_secs(1200);
/// The longest delay of a message, and the longest wait of a process for a processor. With twice that, positions count
/// as stale now and then, as they should.
const WORST: Duration = Duration::from_millis(200);

const MACHINES: u64 = 12;

/// The decisions and the outcome. Left out: whether an area is flown round in the north or in the south, which is as far; and what
/// bridges the time between two plans, which depends on how fast the vehicle is just then.
fn story(permissions: Policy, machine: Machine) -> (Vec<String>, String) {
    let config = crate::stories::support::config();
    let mut simulation =
        Simulation::new(&Setup { config: &config, mission: None, permissions, seed: 1, machine }).unwrap();
    let report = simulation.fly(LIMIT).expect("the mission to end");
    let mut story = simulation.story(&["plan", "step", "permission", "contingency"]);
    story.push(format!("{}: {}", report.outcome().as_str_name(), report.reason));
    story.retain(|it| !it.starts_with("transition: "));
    (story.iter().map(|it| it.replace("(-", "(")).collect(), simulation.decision_log())
}

#[track_caller]
fn check(permissions: Policy) {
    let (expected, _) = story(permissions, Machine::Ideal);
    for seed in sample(0..MACHINES) {
        let (flown, log) = story(permissions, Machine::Busy { seed, worst: WORST });
        assert_eq!(flown, expected, "{permissions}, machine of seed {seed}:\n{log}");
    }
}

#[test]
fn a_battery_that_is_low_and_critical() {
    let config = crate::stories::support::config();
    for seed in sample(0..MACHINES) {
        let machine = Machine::Busy { seed, worst: WORST };
        let setup = Setup { config: &config, mission: None, permissions: Policy::Grant, seed: 1, machine };
        let mut simulation = Simulation::new(&setup).unwrap();
        assert!(simulation.fly_until("step 4 of 5", LIMIT));
        simulation.inject_fault("battery", &["0.09"]);
        let report = simulation.fly(LIMIT).expect("the mission to end");
        simulation.pass(Duration::from_secs(60));
        let log = simulation.decision_log();
        assert_eq!(report.outcome(), MissionOutcome::Emergency, "machine of seed {seed}:\n{log}");
        assert_eq!(simulation.breaches(), [], "machine of seed {seed}:\n{log}");
        assert_eq!(log.matches("`battery_critical`: land").count(), 1, "machine of seed {seed}:\n{log}");
    }
}

#[test]
fn granted_at_once() {
    check(Policy::Grant);
}

#[test]
fn granted_after_a_delay() {
    check(Policy::Delay);
}

#[test]
fn denied() {
    check(Policy::Deny);
}

#[test]
fn never_answered() {
    check(Policy::Silent);
}
