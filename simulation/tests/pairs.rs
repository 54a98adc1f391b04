//! Two things go wrong one after the other, in every order: the vehicle ends on the ground, or holds and says why.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1;
use simulation::Simulation;
use v1::operator_command::Verb;

use crate::stories::support::{each, sample, simulation};

/// What goes wrong, as it does in the air: by a fault of the vehicle or an operator's order.
const TROUBLES: [&str; 10] = [
    "battery_low",
    "battery_critical",
    "obstacle",
    "estimator_lost",
    "link_lost",
    "local_position_stale",
    "pause",
    "abort",
    "return",
    "landing blocked",
];
/// Far longer than any way home with every try of every action.
const LIMIT: Duration = Duration::from_secs(900);

fn happens(trouble: &str, simulation: &mut Simulation<'_>) {
    match trouble {
        "battery_low" => simulation.inject_fault("battery", &["0.2"]),
        "battery_critical" => simulation.inject_fault("battery", &["0.09"]),
        "estimator_lost" => simulation.inject_fault("estimator_invalid", &["on"]),
        "link_lost" => simulation.freeze("gateway", Duration::from_secs(40)),
        "local_position_stale" => simulation.inject_fault("drop", &["vehicle_local_position"]),
        "landing blocked" => simulation.inject_fault("blocked_landing", &["on"]),
        "pause" => simulation.order(Verb::Pause(v1::PauseMission { overrides: false })),
        "abort" => simulation.order(Verb::Abort(v1::AbortMission { overrides: false })),
        "return" => simulation.order(Verb::Return(v1::ReturnHome { overrides: false })),
        flag => simulation.inject_flag(flag),
    }
}

/// Both happen on the way to the far end of the mission, `gap` apart.
fn check(first: &str, second: &str, gap: Duration) {
    let mut simulation = simulation(None, Policy::Grant);
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    // A hold is ended by the battery: with a full one after twenty minutes, with this one after four.
    simulation.inject_fault("battery", &["0.4"]);
    simulation.pass(Duration::from_secs(10));
    happens(first, &mut simulation);
    simulation.pass(gap);
    happens(second, &mut simulation);
    let report = simulation.fly(LIMIT);
    simulation.pass(Duration::from_secs(30));
    let log = || format!("{first}, then {second} after {gap:?}:\n{}", simulation.decision_log());
    assert_eq!(simulation.breaches(), [], "{}", log());
    match report {
        Some(_) => assert!(simulation.is_on_ground(), "{}", log()),
        None => assert!(!simulation.responder().is_empty(), "it holds without a reason: {}", log()),
    }
    let may_hold =
        |it: &str| matches!(it, "pause" | "local_position_stale" | "landing blocked" | "link_lost" | "obstacle");
    let holds = may_hold(first) && may_hold(second);
    assert!(report.is_some() || holds, "what calls for a landing is not answered by one: {}", log());
}

/// Each of `firsts` with each other trouble after it.
fn check_all(firsts: &[&'static str], gap: Duration) {
    let pairs = each(firsts.iter().copied(), TROUBLES).into_iter().filter(|(first, second)| first != second);
    for (first, second) in sample(pairs) {
        check(first, second, gap);
    }
}

#[test]
fn every_ordered_pair_ends_on_the_ground_or_holds_with_a_reason() {
    check_all(&TROUBLES, Duration::from_secs(4));
}

#[test]
fn the_same_while_the_vehicle_comes_down() {
    check_all(&["abort", "return", "battery_low", "battery_critical"], Duration::from_secs(70));
}
