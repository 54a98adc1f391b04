//! Processes that are killed or hang in flight are started again by systemd, and the mission is achieved.

use std::time::{Duration, Instant};

use crate::site::{ON_BOARD, Site};

/// `WatchdogSec` of the unit, and as much again for the death, the next start, and a machine with too much to do.
const HUNG_LIMIT: Duration = Duration::from_secs(6);

/// What may die in flight: with the simulator the vehicle itself would be gone.
fn mortal() -> impl Iterator<Item = &'static str> {
    ON_BOARD.into_iter().filter(|it| *it != "vehicle-sim")
}

/// Sends a signal to a process and waits for the next one; how long that took.
#[track_caller]
fn lose(site: &Site, process: &str, signal: &str) -> Duration {
    site.check_flies(&format!("before {signal} to {process}"));
    let (lost, start) = (site.aircraft.process_id(process).expect("it runs"), Instant::now());
    site.aircraft.run(&format!("kill -{signal} {lost}"));
    site.aircraft.wait_for_another(process, Some(lost));
    start.elapsed()
}

#[test]
#[ignore = "needs an image: KITTIWAKE_SYSTEMD_IMAGE=NAME cargo test --test systemd -- --ignored"]
fn whatever_is_killed_in_flight_is_started_again_and_the_mission_is_achieved() {
    let site = Site::start("killed", 4);
    site.wait_for_flight();
    for process in mortal() {
        let took = lose(&site, process, "KILL");
        eprintln!("{process}: ready again {took:.2?} after kill -9");
        assert_eq!(site.aircraft.property(process, "NRestarts"), "1", "{process}\n{}", site.aircraft.journal());
    }
    site.wait_for_success();
    site.check_active();
}

#[test]
#[ignore = "needs an image: KITTIWAKE_SYSTEMD_IMAGE=NAME cargo test --test systemd -- --ignored"]
fn a_manager_and_a_planner_that_hang_in_flight_are_killed_by_the_watchdog_and_the_mission_is_achieved() {
    let site = Site::start("hung", 4);
    site.wait_for_flight();
    for process in ["mcm", "planner"] {
        let took = lose(&site, process, "STOP");
        eprintln!("{process}: ready again {took:.2?} after it hung");
        assert!(took < HUNG_LIMIT, "{process}: {took:?}\n{}", site.aircraft.journal());
        let told = format!("kittiwake@{process}.service: Failed with result 'watchdog'");
        assert!(site.aircraft.journal().contains(&told), "{}", site.aircraft.journal());
    }
    site.wait_for_success();
    site.check_active();
}
