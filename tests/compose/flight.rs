//! One command brings the system up; it flies, and the host observes it.

use std::time::{Duration, Instant};

use crate::compose::support::Project;
use crate::compose::support::docker_lines;
use crate::support::engine::docker;

/// An aircraft and its ground come up within this time.
const START_LIMIT: Duration = Duration::from_secs(60);

/// The services of one aircraft and its ground that do not end.
const PROCESSES: [&str; 9] = [
    "control-tower",
    "gateway",
    "ground-router",
    "uav1-mcm",
    "uav1-monitor",
    "uav1-planner",
    "uav1-router",
    "uav1-skill-manager",
    "uav1-vehicle-sim",
];

#[test]
#[ignore = "needs an image: KITTIWAKE_IMAGE=NAME cargo test --test stories -- --ignored compose::"]
fn it_comes_up_and_flies_the_reference_mission_watched_from_the_host() {
    let project = Project::new("flight");
    let start = Instant::now();
    project.up();
    let token = project.token();
    let ready = crate::compose::support::wait_for("the gateway to be ready", || {
        project.get("/readyz", "").filter(|it| it.0 == 200).map(|_| start.elapsed())
    });
    assert!(ready < START_LIMIT, "ready after {ready:?}");
    assert_eq!(project.get("/api/v1/vehicles", "").map(|it| it.0), Some(401), "nobody without a token is let in");
    let report = project.wait_for_report("uav1", &token);
    assert_eq!(report["outcome"], "MISSION_OUTCOME_SUCCESS", "{report}");
    assert_eq!(report["objectives"].as_array().map(Vec::len), Some(2));

    project.wait_until_healthy();
    let running: Vec<_> = project.processes().into_keys().collect();
    assert_eq!(running, PROCESSES);
    for (service, container) in project.containers().into_iter().filter(|(it, _)| PROCESSES.contains(&it.as_str())) {
        check_health(&service, &container);
        check_confinement(&service, &container);
    }
    assert!(project.restarts().values().all(|it| it == "0"), "{:?}", project.restarts());
    assert_eq!(project.down(), Vec::<String>::new(), "left behind");
    eprintln!("ready {ready:?} after `up`");
}

/// Each container's health check prints one line and ends in time.
#[track_caller]
fn check_health(service: &str, container: &str) {
    let process = service.trim_start_matches("uav1-").trim_start_matches("ground-");
    let start = Instant::now();
    let output = docker(&["exec", container, "kittiwake", "health"]);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && said.starts_with(&format!("{process}: ")), "{service}: {said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(start.elapsed() < Duration::from_secs(10), "the engine included, {:?}", start.elapsed());
    if process == "router" {
        let peer = if service == "uav1-router" { "link up: ground-router" } else { "link up: uav1-router" };
        assert!(said.contains(peer), "{said}");
    }
}

/// No process is root, only volumes can be written, and no capability is left.
#[track_caller]
fn check_confinement(service: &str, container: &str) {
    let format = "{{.HostConfig.ReadonlyRootfs}} {{.Config.User}} {{.HostConfig.CapDrop}} {{.HostConfig.Memory}}";
    let found = docker_lines(&["inspect", "--format", format, container]).concat();
    let parts: Vec<_> = found.split(' ').collect();
    assert_eq!(parts[..3], ["true", "65532:65532", "[ALL]"], "{service}");
    assert!(parts[3].parse::<u64>().is_ok_and(|it| 0 < it), "{service} has no limit of memory");
}
