//! Whatever the planner says, the vehicle enters no area without a permission, stays inside the volume, and ends on the ground or holds for a reason.

use std::time::Duration;

use control_tower::policy::Policy;
use simulation::{Changes, Machine, Setup, Simulation};

use crate::stories::support::{config, seeds};

/// A flight with a planner that lies as `seed` draws it; what is wrong with it.
fn wrong(seed: u64, permissions: Policy) -> Option<String> {
    let config = config();
    let setup = Setup { config: &config, mission: None, permissions, seed, machine: Machine::Ideal };
    let mut simulation = Simulation::changed(&setup, Changes { lies: Some(seed), ..Changes::default() }).unwrap();
    let report = simulation.fly(Duration::from_secs(3000));
    let rests = simulation.is_on_ground() || !simulation.reason_to_stay().is_empty();
    let (breaches, excursions) = (simulation.breaches(), simulation.excursions());
    let is_right = breaches.is_empty() && excursions.is_empty() && rests;
    (!is_right).then(|| {
        let log = simulation.decision_log();
        format!("seed {seed}, {permissions:?}: {breaches:?} {excursions:?} rests {rests}, {report:?}\n{log}")
    })
}

/// `KITTIWAKE_SEEDS=1000` flies that many, `KITTIWAKE_SEEDS=21..22` one again.
#[test]
fn whatever_the_planner_says_the_vehicle_stays_where_it_may_be() {
    let policies = [Policy::Grant, Policy::Deny, Policy::Silent];
    let flights = seeds(24).into_iter().map(|seed| wrong(seed, policies[seed as usize % policies.len()]));
    let wrong: Vec<String> = flights.flatten().collect();
    assert!(wrong.is_empty(), "{} flights went wrong:\n\n{}", wrong.len(), wrong.join("\n\n"));
}
