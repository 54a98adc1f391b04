//! A landing on a target: seen to the ground, lost for a while, never seen, lost in the last moment.

use control_tower::policy::Policy;
use kittiwake_proto::v1::operator_command::Verb;
use kittiwake_proto::v1::{MissionOutcome, PauseMission, ResumeMission};
use simulation::Simulation;

use crate::stories::support::story::{ends, kill, s, when_flown};
use crate::stories::support::{config, simulation};

fn deck() -> Simulation<'static> {
    when_flown(simulation(Some(&config().join("missions/deck.toml")), Policy::Grant), "step 2 of 3")
}

const LANDS: &str = "step 3 of 3: land on the target";
const LANDS_AGAIN: &str = "step 1 of 1: land on the target";
const HOME: &str = "every objective was achieved";
const RAISED: &str = "flag `landing_target_lost` raised: landing.target_seen false";
const CLIMBS: &str = "`landing_target_lost`: climb";

#[test]
fn a_target_that_is_seen_is_landed_on() {
    ends(deck(), MissionOutcome::Success, &[LANDS, "step 3 succeeded", HOME]);
}

#[test]
fn a_target_that_is_lost_at_5_m_is_looked_for_from_above_and_landed_on() {
    let mut simulation = deck();
    simulation.inject_fault("hide_target", &["5"]);
    assert!(simulation.fly_until(CLIMBS, s(60)), "{}", simulation.decision_log());
    simulation.inject_fault("hide_target", &["0"]);
    let expected = [LANDS, RAISED, CLIMBS, "`landing_target_lost` is over", LANDS_AGAIN, "step 1 succeeded", HOME];
    ends(simulation, MissionOutcome::Success, &expected);
}

#[test]
fn a_target_that_is_never_seen_is_given_up_after_three_landings() {
    let mut simulation = deck();
    simulation.inject_fault("hide_target", &["1000"]);
    let failed = "objective `deck` failed: land failed 3 times in a row: interrupted by `landing_target_lost`";
    let expected = [LANDS, CLIMBS, LANDS_AGAIN, CLIMBS, LANDS_AGAIN, CLIMBS, "fly to (0, 0, 10); land", failed];
    ends(simulation, MissionOutcome::Failure, &expected);
}

#[test]
fn a_target_that_is_lost_in_the_last_moment_is_landed_on() {
    let mut simulation = deck();
    simulation.inject_fault("hide_target", &["0.8"]);
    ends(simulation, MissionOutcome::Success, &[LANDS, "step 3 succeeded", HOME]);
}

/// The target is hidden below 5 m, then `trouble` comes on the way up, then the target is shown again.
#[track_caller]
fn check(trouble: impl Fn(&mut Simulation<'_>), outcome: MissionOutcome, expected: &str) {
    let mut simulation = deck();
    simulation.inject_fault("hide_target", &["5"]);
    assert!(simulation.fly_until(CLIMBS, s(60)), "{}", simulation.decision_log());
    trouble(&mut simulation);
    simulation.inject_fault("hide_target", &["0"]);
    ends(simulation, outcome, &[RAISED, CLIMBS, expected]);
}

#[test]
fn a_second_trouble_on_the_way_up_from_a_lost_target_does_no_harm() {
    for process in ["mcm", "monitor", "skill-manager", "planner"] {
        check(|it| kill(it, process, s(3)), MissionOutcome::Success, HOME);
    }
    check(|it| it.inject_fault("battery", &["0.2"]), MissionOutcome::Emergency, "`battery_low`: divert");
    check(|it| it.inject_fault("battery", &["0.08"]), MissionOutcome::Emergency, "`battery_critical`: land");
    let gust = |it: &mut Simulation<'_>| {
        it.inject_fault("wind", &["0", "13.7"]);
        it.pass(s(30));
        it.inject_fault("wind", &["0", "0"]);
    };
    check(gust, MissionOutcome::Success, HOME);
    let pause = |it: &mut Simulation<'_>| {
        it.order(Verb::Pause(PauseMission { overrides: false }));
        it.pass(s(30));
        it.order(Verb::Resume(ResumeMission::default()));
    };
    check(pause, MissionOutcome::Success, HOME);
}
