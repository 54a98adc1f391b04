//! Processes that are killed or hang in flight are started again by systemd, and the mission is achieved.

use std::time::{Duration, Instant};

use crate::systemd::machine::Machine;
use crate::systemd::site::{ON_BOARD, ON_GROUND, Site};

/// What may die in flight, on its machine: with the simulator the vehicle itself would be gone.
fn mortal(site: &Site) -> impl Iterator<Item = (&Machine, &'static str)> {
    let on_board = ON_BOARD.into_iter().filter(|it| *it != "vehicle-sim").map(|it| (&site.aircraft, it));
    on_board.chain(ON_GROUND.into_iter().map(|it| (&site.ground, it)))
}

/// Sends a signal to a process and waits for the next one; how long that took.
#[track_caller]
fn lose(site: &Site, (machine, process): (&Machine, &str), signal: &str) -> Duration {
    site.check_flies(&format!("before {signal} to {process}"));
    let (lost, start) = (machine.process_id(process).expect("it runs"), Instant::now());
    machine.run(&format!("kill -{signal} {lost}"));
    machine.wait_for_another(process, Some(lost));
    start.elapsed()
}

#[test]
#[ignore = "needs an image: KITTIWAKE_SYSTEMD_IMAGE=NAME cargo test --test stories -- --ignored systemd::"]
fn whatever_is_killed_in_flight_is_started_again_with_the_files_that_were_checked_and_the_mission_is_achieved() {
    let site = Site::start("killed", 4);
    let machine = &site.aircraft;
    site.wait_for_flight();
    for machine in [&site.aircraft, &site.ground] {
        machine.run("cd /etc/kittiwake/config && echo 'half a line' >kittiwake.toml && rm -r trees");
    }
    for (machine, process) in mortal(&site) {
        let took = lose(&site, (machine, process), "KILL");
        eprintln!("{process}: ready again {took:.2?} after kill -9");
        assert_eq!(machine.property(process, "NRestarts"), "1", "{process}\n{}", machine.journal());
    }
    site.wait_for_success();

    // The files count from the next start of the target.
    machine.run("systemctl restart kittiwake.target");
    let said = machine.journal();
    assert!(said.contains("/etc/kittiwake/config/kittiwake.toml:1:"), "the mistake and its place are not in:\n{said}");
    for process in ON_BOARD {
        assert_eq!(machine.property(process, "ActiveState"), "inactive", "{process}\n{said}");
    }
    machine.run("rm -r /etc/kittiwake/config && cp -r config /etc/kittiwake/ && systemctl restart kittiwake.target");
    site.check_active();
}

#[test]
#[ignore = "needs an image: KITTIWAKE_SYSTEMD_IMAGE=NAME cargo test --test stories -- --ignored systemd::"]
fn whatever_hangs_in_flight_is_killed_by_the_watchdog_and_the_mission_is_achieved() {
    let site = Site::start("hung", 2);
    site.wait_for_flight();
    for (machine, process) in mortal(&site) {
        let took = lose(&site, (machine, process), "STOP");
        eprintln!("{process}: ready again {took:.2?} after it hung");
        // It died by the watchdog's first signal: the second would come `TimeoutStopSec` later.
        for told in ["Watchdog timeout (limit 3s)!", "status=6/ABRT", "Failed with result 'watchdog'"] {
            let unit = format!("kittiwake@{process}.service: ");
            let journal = machine.journal();
            assert!(journal.lines().any(|it| it.contains(&unit) && it.contains(told)), "{told} is not in:\n{journal}");
        }
    }
    site.wait_for_success();
    site.check_active();
}
