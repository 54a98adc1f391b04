//! A landing that does not come down: the vehicle climbs and goes elsewhere.

use std::path::Path;
use std::time::Duration;

use control_tower::policy::Policy;
use simulation::{Machine, Setup, Simulation};

const LIMIT: Duration = Duration::from_secs(2000);

fn simulation(mission: &str) -> Simulation<'static> {
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config");
    let path = config.join("missions").join(format!("{mission}.toml"));
    let setup = Setup {
        config: &config,
        mission: Some(&path),
        permissions: Policy::Grant,
        seed: 1,
        machine: Machine::Ideal,
    };
    Simulation::new(&setup).unwrap()
}

#[test]
fn explore() {
    let mut s = simulation("reference");
    assert!(s.fly_until("step 5 of 5: land", LIMIT));
    s.inject_fault("blocked_landing", &["on"]);
    let report = s.fly(LIMIT);
    println!("{}\n{report:#?}", s.decision_log());
    let mut s = simulation("reference");
    assert!(s.fly_until("step 4 of 5: fly", LIMIT));
    s.inject_fault("blocked_landing", &["on"]);
    s.inject_flag("operator_abort");
    let report = s.fly(LIMIT);
    println!("{}\n{report:#?}", s.decision_log());
}
