//! Routers are killed in flight and started again: there is a pause, and no other process must be restarted.

use std::time::Instant;

use super::world::{Deployment, ON_BOARD, Router, Services};
use crate::support::wait_for;

/// Mission time runs twice as fast as the wall clock: on a busy machine a router takes seconds to be back, and a vehicle that knows
/// nothing of its battery for 15 mission seconds lands.
const SPEED: &[&str] = &["--speed", "2"];

fn processes_alive(services: &Services) -> Option<()> {
    let document = services.document();
    let alive = |name: &str| {
        let rows = document["processes"].as_array();
        rows.is_some_and(|it| it.iter().any(|it| it["service"] == name && it["health"] == "alive"))
    };
    ON_BOARD.iter().all(|it| alive(it)).then_some(())
}

/// In the air, with all processes seen.
fn in_flight(services: &Services) {
    services.wait_in_flight();
    wait_for("everybody on board to be seen", || processes_alive(services));
}

/// Waits until data of every kind have come that were sent after the router was up again. How long that takes depends on
/// the machine: it is printed.
#[track_caller]
fn fresh(services: &Services, what: &str) {
    let there_again = Instant::now();
    wait_for("fresh data of every kind", || {
        let sources = services.document()["sources"].clone();
        let since = there_again.elapsed().as_secs_f64();
        let young = |it: &str| sources[it]["wallAgeS"].as_f64().is_some_and(|age| age < since);
        ["introspection", "mcmStatus", "missionStatus", "vehicleStatus"].iter().all(|it| young(it)).then_some(())
    });
    eprintln!("{what} killed and started again: everything fresh after {:.2?}", there_again.elapsed());
}

/// Waits until the mission is over; returns its outcome and the reason.
fn outcome(services: &Services) -> String {
    wait_for("the end of the mission", || {
        let report = services.document()["report"].clone();
        let outcome = report["outcome"].as_str().filter(|it| !it.contains("UNSPECIFIED"))?;
        Some(format!("{outcome}: {}", report["reason"]))
    })
}

#[test]
fn either_router_may_be_killed_and_started_again() {
    let mut deployment = Deployment::start(SPEED);
    in_flight(&deployment.services);
    deployment.ground.kill();
    deployment.aircraft.process().wait_for("the link to ground-router is down");
    deployment.ground.start_again();
    deployment.aircraft.process().wait_for_nth("the link to ground-router is up", 2);
    fresh(&deployment.services, "the router of the ground");
    deployment.aircraft.kill();
    deployment.ground.process().wait_for("the link to uav1-router is down");
    deployment.aircraft.start_again();
    deployment.ground.process().wait_for_nth("the link to uav1-router is up", 2);
    fresh(&deployment.services, "the router on board");
    flies_on(&mut deployment.services);
}

#[test]
fn the_only_router_may_be_killed_and_started_again() {
    let mut router = Router::plain();
    let mut services = Services::start(&router.inside, &router.inside, SPEED);
    in_flight(&services);
    router.kill();
    router.start_again();
    fresh(&services, "the only router");
    flies_on(&mut services);
}

/// Flies to the end of the mission, with the processes that it began with.
fn flies_on(services: &mut Services) {
    wait_for("everybody on board to be seen again", || processes_alive(services));
    services.expect_all_run();
    let outcome = outcome(services);
    assert!(outcome.contains("SUCCESS"), "{outcome}");
    services.expect_all_run();
}
