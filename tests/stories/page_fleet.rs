//! Two vehicles on one page.

use std::process::{Child, Command, Stdio};

use crate::support::browser::watch;
use crate::support::{KITTIWAKE, System, kittiwake};

/// A second vehicle beside the system's own: five services on the same router, with the same ground.
struct Vehicle(Vec<Child>);

impl Vehicle {
    fn start(name: &str, system: &System) -> Vehicle {
        let start = |service: &str| {
            Command::new(KITTIWAKE)
                .args([
                    service,
                    "--vehicle",
                    name,
                    "--speed",
                    "2",
                    "--connect",
                    &system.locator(),
                    "--exit-with-parent",
                ])
                .stdin(Stdio::piped())
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .expect("the program starts")
        };
        Vehicle(["vehicle-sim", "skill-manager", "monitor", "planner", "mcm"].map(start).into())
    }
}

impl Drop for Vehicle {
    fn drop(&mut self) {
        for process in &mut self.0 {
            let _ = process.kill();
            let _ = process.wait();
        }
    }
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored"]
fn of_two_vehicles_the_one_in_trouble_comes_first() {
    let (system, browser) = watch(&["--speed", "2"]);
    let uav2 = Vehicle::start("uav2", &system);
    browser.wait_for("#fleet .rows li:nth-child(2)", "uav2");
    browser.wait_for("#fleet .rows li:nth-child(1)", "uav1");
    browser.wait_for("#fleet .rows li:nth-child(2)", "in the air");
    let fault = ["inject", "fault", "battery", "0.2", "--vehicle", "uav2", "--connect", &system.locator()];
    let output = kittiwake(&fault);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    browser.wait_for("#fleet .rows li:nth-child(1)", "battery low");
    assert!(browser.text("#fleet .rows li:nth-child(1)").is_some_and(|it| it.contains("uav2")));
    // The contingencies of another vehicle do not appear among those of the selected one.
    assert_eq!(browser.text("[data-flag=battery_low]"), None);
    browser.picture("fleet-first");
    browser.click("#fleet .rows li:nth-child(1) button");
    browser.wait_for("[data-flag=battery_low]", "acting");
    browser.wait_for("#headline", "uav2");
    browser.wait_for("#timeline .log", "`battery_low`: ");
    browser.views("fleet");
    // Command is taken of one vehicle, not of all.
    browser.take_command();
    browser.click("#fleet .rows li:nth-child(2) button");
    browser.wait_for("#headline", "uav1");
    browser.wait_for("#take-command", "Take command");
    // The one that is not selected falls silent as a whole: the link is what is lost, as far as anybody on the ground can know.
    drop(uav2);
    browser.wait_for("#fleet .rows li:nth-child(1)", "no contact for");
    assert!(browser.text("#fleet .rows li:nth-child(1)").is_some_and(|it| it.contains("uav2")));
    browser.wait_for("#alarm", "uav2 warning: no contact");
    browser.picture("fleet-lost");
    browser.click("#fleet .rows li:nth-child(1) button");
    browser.wait_for("#headline", "no contact for");
    browser.wait_for(
        "#staleness",
        "In flight, without contact, it holds after 10 s and flies to a landing site and lands after 2 min.",
    );
    browser.wait_for("#processes", "unheard");
    browser.picture("fleet-lost-selected");
    browser.expect_no_error();
}
