//! Processes that hang: alive, and doing nothing.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::MissionOutcome;
use simulation::{Machine, Setup, Simulation};

use crate::stories::support::sample;

const LIMIT: Duration = Duration::from_secs(1500);

fn simulation() -> Simulation<'static> {
    let config = crate::stories::support::config();
    let permissions = Policy::Grant;
    let setup = Setup { config: &config, mission: None, permissions, seed: 1, machine: Machine::Ideal };
    Simulation::new(&setup).unwrap()
}

const fn s(seconds: u64) -> Duration {
    Duration::from_secs(seconds)
}

/// What happens in a flight while a process hangs.
struct Story<'a> {
    process: &'a str,
    hangs_s: f64,
    /// Five seconds after this was decided.
    after: &'a str,
    /// Raised in that moment.
    flag: Option<&'a str>,
    outcome: MissionOutcome,
    /// Decided in this order.
    expected: &'a [&'a str],
    never: &'a [&'a str],
}

#[track_caller]
fn check(story: &Story<'_>) {
    let mut simulation = simulation();
    assert!(simulation.fly_until(story.after, LIMIT));
    simulation.pass(s(5));
    if let Some(flag) = story.flag {
        simulation.inject_flag(flag);
        simulation.pass(Duration::from_millis(10));
    }
    let frozen_at = simulation.now();
    simulation.freeze(story.process, Duration::from_secs_f64(story.hangs_s));
    let report = simulation.fly(LIMIT);
    let log = simulation.decision_log();
    assert_eq!(report.map(|it| it.outcome()), Some(story.outcome), "{} hung at {frozen_at:?}:\n{log}", story.process);
    let mut lines = log.lines();
    for part in story.expected {
        assert!(lines.any(|it| it.contains(part)), "`{part}` is missing or too early:\n{log}");
    }
    for part in story.never {
        assert!(!log.contains(part), "`{part}`:\n{log}");
    }
    assert_eq!(simulation.breaches(), []);
    // Nothing is started by what hung once the mission is over.
    simulation.pass(s(60));
    assert_eq!(simulation.breaches(), []);
}

#[test]
fn a_planner_that_hangs_during_a_leg_is_not_missed_before_a_plan_is() {
    check(&Story {
        process: "planner",
        hangs_s: 10.0,
        after: "step 4 of 5",
        flag: None,
        outcome: MissionOutcome::Success,
        expected: &[
            "flag `planner_lost` raised: the planner has been silent for 1.0 s",
            "`planner_lost` is over: what raised it is gone",
            "step 4 succeeded",
            "step 5 of 5: land",
        ],
        never: &["`planner_lost`: stop"],
    });
}

#[test]
fn who_waits_for_a_plan_holds_until_the_planner_is_back() {
    check(&Story {
        process: "planner",
        hangs_s: 20.0,
        after: "step 4 of 5",
        flag: Some("obstacle"),
        outcome: MissionOutcome::Success,
        expected: &[
            "`obstacle`: stop",
            "`planner_lost`: stop",
            "`planner_lost` is over",
            "plan 2: fly to (0, 500, 10)",
        ],
        never: &["planner_gone"],
    });
}

#[test]
fn without_a_planner_for_a_minute_the_vehicle_returns() {
    check(&Story {
        process: "planner",
        hangs_s: 1000.0,
        after: "step 4 of 5",
        flag: Some("obstacle"),
        outcome: MissionOutcome::Emergency,
        expected: &[
            "`planner_lost`: stop",
            "flag `planner_gone` raised: the planner has been silent for 60.0 s",
            "`planner_gone`: return_home",
            "over: `planner_gone`",
        ],
        never: &[],
    });
    // The leg and the landing that are known are flown; nothing is begun that needs a plan.
    check(&Story {
        process: "planner",
        hangs_s: 1000.0,
        after: "step 1 of 3: takeoff",
        flag: None,
        outcome: MissionOutcome::Emergency,
        expected: &["`planner_gone`: return_home", "over: `planner_gone`"],
        never: &[],
    });
}

#[test]
fn a_skill_manager_that_hangs_on_the_way_is_stopped_when_it_is_back() {
    check(&Story {
        process: "skill-manager",
        hangs_s: 4.0,
        after: "step 4 of 5",
        flag: None,
        outcome: MissionOutcome::Success,
        expected: &[
            "flag `skill_manager_lost` raised: the skill manager has been silent for 1.0 s",
            "`skill_manager_lost`: stop",
            "`skill_manager_lost` is over",
            "plan 2: fly to (0, 500, 10)",
        ],
        never: &[],
    });
}

#[test]
fn a_landing_under_way_needs_no_skill_manager() {
    check(&Story {
        process: "skill-manager",
        hangs_s: 4.0,
        after: "step 5 of 5: land",
        flag: None,
        outcome: MissionOutcome::Success,
        expected: &["flag `skill_manager_lost` raised", "step 5 succeeded"],
        never: &["`skill_manager_lost`: stop"],
    });
}

#[test]
fn an_emergency_action_is_tried_again_when_the_skill_manager_is_back() {
    let mut simulation = simulation();
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    simulation.pass(s(5));
    simulation.freeze("skill-manager", s(4));
    simulation.pass(Duration::from_millis(100));
    simulation.inject_flag("operator_abort");
    let report = simulation.fly(LIMIT);
    let log = simulation.decision_log();
    assert_eq!(report.map(|it| it.outcome()), Some(MissionOutcome::Emergency), "{log}");
    let mut lines = log.lines();
    for part in
        ["`operator_abort`: land", "land failed (try 1 of 2): failed: skill manager", "`operator_abort` is over"]
    {
        assert!(lines.any(|it| it.contains(part)), "`{part}` is missing or too early:\n{log}");
    }
    assert!(simulation.now().as_secs_f64() < 60.0, "down in time:\n{log}");
}

#[test]
fn what_a_hanging_manager_has_ordered_is_flown_and_goes_on_after_it() {
    check(&Story {
        process: "mcm",
        hangs_s: 10.0,
        after: "step 4 of 5",
        flag: None,
        outcome: MissionOutcome::Success,
        expected: &["flag `manager_lost` raised", "`manager_lost` is over: what raised it is gone", "step 4 succeeded"],
        never: &["`manager_lost`: stop"],
    });
    // Past the end of its leg it loiters.
    check(&Story {
        process: "mcm",
        hangs_s: 100.0,
        after: "step 4 of 5",
        flag: None,
        outcome: MissionOutcome::Success,
        expected: &["flag `manager_lost` raised", "land"],
        never: &[],
    });
}

#[test]
fn a_monitor_that_hangs_is_noticed_by_the_manager() {
    check(&Story {
        process: "monitor",
        hangs_s: 10.0,
        after: "step 4 of 5",
        flag: None,
        outcome: MissionOutcome::Success,
        expected: &["flag `introspection_lost` raised", "`introspection_lost`: stop", "plan 2: fly to (0, 500, 10)"],
        never: &[],
    });
}

/// Whatever hangs whenever, and however long: the rules are kept and there is a report.
#[test]
fn processes_that_hang_at_random_end_no_mission_in_the_air() {
    const PROCESSES: [&str; 5] = ["planner", "skill-manager", "mcm", "monitor", "control-tower"];
    const FLAGS: [Option<&str>; 4] = [None, Some("obstacle"), Some("battery_low"), Some("operator_abort")];
    for seed in sample(0..24_u64) {
        // Spread over the flight, and every process with every flag.
        let (process, flag) = (PROCESSES[seed as usize % 5], FLAGS[seed as usize % 4]);
        let (from_ms, hangs_ms) = (1_000 + seed * 7_919 % 150_000, 300 + seed * 3_571 % 25_000);
        let mut simulation = simulation();
        let early = simulation.fly(Duration::from_millis(from_ms));
        simulation.freeze(process, Duration::from_millis(hangs_ms));
        simulation.pass(Duration::from_millis(hangs_ms / 3));
        if let Some(flag) = flag {
            simulation.inject_flag(flag);
        }
        let report = early.or(simulation.fly(LIMIT));
        simulation.pass(s(60));
        let told = format!("{process} from {from_ms} ms for {hangs_ms} ms, {flag:?}:\n{}", simulation.decision_log());
        assert!(report.is_some(), "no report: {told}");
        assert_eq!(simulation.breaches(), [], "{told}");
        assert!(simulation.position().is_some_and(|it| it.down_m.abs() < 1.0), "{told}");
    }
}
