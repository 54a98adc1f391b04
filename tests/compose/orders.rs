//! Containers may be started in any order, as after a power cut.

use std::time::{SystemTime, UNIX_EPOCH};

use rand::SeedableRng;
use rand::rngs::StdRng;
use rand::seq::SliceRandom;

use crate::compose::support::Project;
use crate::support::engine::docker;

#[test]
#[ignore = "needs an image: KITTIWAKE_IMAGE=NAME cargo test --test stories -- --ignored compose::"]
fn started_in_any_order_it_flies() {
    let project = Project::new("orders");
    let seed = match std::env::var("SEED").map(|it| it.parse()) {
        Ok(seed) => seed.expect("SEED is a number"),
        Err(_) => SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs(),
    };
    project.up();
    let mut containers: Vec<_> = project.containers().into_iter().collect();
    containers.shuffle(&mut StdRng::seed_from_u64(seed));
    let order: Vec<_> = containers.iter().map(|(name, _)| name.as_str()).collect();
    for (name, container) in &containers {
        let cut = docker(&["stop", "--time", "0", container]);
        assert!(cut.status.success(), "{name}: {}", String::from_utf8_lossy(&cut.stderr));
    }
    println!("SEED={seed}: {}", order.join(", "));
    for (name, container) in &containers {
        let started = docker(&["start", container]);
        assert!(started.status.success(), "{name}: {}", String::from_utf8_lossy(&started.stderr));
    }
    let token = project.token();
    // Where it flew already when it was cut, nobody knows how it came to the ground: then it waits for an operator.
    let report = project.start_until_report("uav1", &token);
    assert_eq!(report["outcome"], "MISSION_OUTCOME_SUCCESS", "{report}");
    project.wait_until_healthy();
}
