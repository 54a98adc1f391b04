//! The link between the containers is cut and mended while the vehicle flies.

use std::time::Instant;

use serde_json::Value;

use crate::compose::support::{Project, wait_for};
use crate::support::engine::docker;

#[test]
#[ignore = "needs an image: KITTIWAKE_IMAGE=NAME cargo test --test stories -- --ignored compose::"]
fn a_cut_link_is_seen_on_the_ground_and_changes_nothing_among_the_processes_on_board() {
    let mut project = Project::new("cuts");
    // Slow enough for the vehicle to be in the air all the time.
    project.set("KITTIWAKE_SPEED", "2");
    project.up();
    let token = project.token();
    wait_for("the vehicle to fly", || {
        (project.vehicle("uav1", &token)?["aircraft"]["derived"]["flying"] == true).then_some(())
    });
    let (router, network) = (project.container("uav1-router"), project.network("link"));
    let before = uptimes(&project);

    check(&docker(&["network", "disconnect", &network, &router]));
    let cut = Instant::now();
    wait_for("the ground to see that nothing comes", || is_stale(&project.vehicle("uav1", &token)?).then_some(()));
    let stale = cut.elapsed();
    wait_for("the router to say that the link is down", || {
        project.log("uav1-router").contains("the link to ground-router is down").then_some(())
    });
    let said = String::from_utf8_lossy(&docker(&["exec", &router, "kittiwake", "health"]).stdout).into_owned();
    assert!(said.contains("link down"), "{said}");

    check(&docker(&["network", "connect", &network, &router]));
    let healed = Instant::now();
    wait_for("the ground to see the vehicle again", || (!is_stale(&project.vehicle("uav1", &token)?)).then_some(()));
    eprintln!("containers: stale {stale:.2?} after the cut, fresh {:.2?} after its end", healed.elapsed());
    let after = uptimes(&project);
    for ((name, before), (_, after)) in before.iter().zip(&after) {
        assert!(before < after, "{name} was started again");
    }
    assert!(project.restarts().values().all(|it| it == "0"), "{:?}", project.restarts());
}

/// Whether the ground has heard nothing new of the vehicle's monitor, which publishes twice a second over the link, for
/// long enough that the page shows it as stale.
fn is_stale(vehicle: &Value) -> bool {
    vehicle["sources"]["introspection"]["wallAgeS"].as_f64().is_none_or(|it| 0.9 < it)
}

/// The uptimes of the processes on board, as heard over their own router.
fn uptimes(project: &Project) -> Vec<(String, f64)> {
    let on_board = project.containers().into_iter().filter(|(it, _)| it.starts_with("uav1-") && it != "uav1-router");
    let uptime = |container: &str| {
        let output = docker(&["exec", container, "kittiwake", "health"]);
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        let seconds = said.split_once("up for ").and_then(|(_, it)| it.split(' ').next()?.parse().ok());
        seconds.unwrap_or_else(|| panic!("no uptime in `{said}`"))
    };
    on_board.map(|(name, container)| (name, uptime(&container))).collect()
}

#[track_caller]
fn check(output: &std::process::Output) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
