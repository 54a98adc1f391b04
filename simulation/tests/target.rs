//! A landing on a target: seen to the ground, lost for a while, never seen, lost in the last moment.

use control_tower::policy::Policy;
use kittiwake_proto::v1::MissionOutcome;
use simulation::Simulation;

use crate::stories::support::story::{ends, s, when_flown};
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
