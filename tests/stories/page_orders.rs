//! Hazardous orders in a browser: with the mouse on the map, with the keyboard only, and after something forgot what it had decided.

use std::path::Path;

use nix::sys::signal::Signal;

use crate::support::browser::{Browser, ENTER, ESCAPE, watch};
use crate::support::files::state_folder;
use crate::support::{System, wait_for};

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn a_landing_place_is_clicked_on_the_map_and_confirmed() {
    let (_system, browser) = watch(&[]);
    browser.wait_for("#strip", "offboard");
    browser.take_command();
    // Escape on the map cancels.
    browser.click("#verb-land-at");
    browser.wait_for("#said", "Choose the place on the map");
    browser.type_keys(ESCAPE);
    wait_for("no more choosing", || browser.text("#map.picking").is_none().then_some(()));
    browser.click("#verb-land-at");
    browser.wait_for("#map.picking", "");
    // North of the areas, in which landing is not allowed.
    browser.click_off("#map canvas", 0, -140);
    let question = browser.wait_for("#question", "End the mission and land at N 1");
    browser.picture("land-at");
    browser.click("#confirm");
    browser.wait_for("#said[data-tone=good]", "land-at");
    browser.wait_for("[data-flag=operator_land]", "acting");
    browser.wait_for("#phase", "over");
    let landed = &browser.document("uav1")["aircraft"]["localPosition"]["position"];
    for (letter, axis) in [("N ", "northM"), ("E ", "eastM")] {
        let chosen: f64 = number_after(&question, letter);
        let reached = landed[axis].as_f64().unwrap_or(f64::NAN);
        assert!((chosen - reached).abs() < 3.0, "{question} and {landed}");
    }
    browser.expect_no_error();
}

fn number_after(text: &str, letter: &str) -> f64 {
    let rest = text.split(letter).nth(1).unwrap_or_default();
    let digits = rest.split([',', '?']).next().unwrap_or_default().replace('−', "-");
    digits.parse().unwrap_or_else(|error| panic!("{error}: `{digits}` in `{text}`"))
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn abort_needs_no_mouse() {
    let (_system, browser) = watch(&[]);
    browser.wait_for("#strip", "offboard");
    browser.wait_for("#take-command:enabled", "Take");
    browser.tab_to("take-command");
    browser.type_keys(ENTER);
    browser.wait_for("#take-command", "Release");
    browser.wait_for("#verb-abort:enabled", "");
    browser.tab_to("verb-abort");
    browser.type_keys(ENTER);
    browser.wait_for("#question", "End the mission now");
    // The focus is on Cancel: a second Enter by mistake does no harm.
    assert_eq!(browser.run("return document.activeElement.id", vec![]), "cancel");
    browser.tab_to("confirm");
    browser.picture("abort-by-keys");
    browser.type_keys(ENTER);
    browser.wait_for("#said[data-tone=good]", "abort");
    browser.wait_for("#phase", "over");
    browser.expect_no_error();
}

/// A system that remembers in a folder, and a browser that shows it.
fn watch_with_memory(state: &Path) -> (System, Browser) {
    watch(&["--state", state.to_str().expect("a readable path")])
}

/// The process is killed, and the next one cannot use what it has remembered.
#[track_caller]
fn forget(system: &System, state: &Path, process: &str) {
    let killed = system.process(process);
    killed.signal(Signal::SIGSTOP);
    for slot in [0, 1] {
        std::fs::write(state.join(format!("{process}.{slot}")), "\u{0}garbled").expect("it can be written");
    }
    killed.signal(Signal::SIGKILL);
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn a_vehicle_whose_manager_has_lost_its_memory_says_so_and_begins_by_hand_only() {
    let state = state_folder();
    let (system, browser) = watch_with_memory(state.path());
    browser.wait_for("#strip", "offboard");
    browser.take_command();
    browser.click("#verb-abort");
    browser.click("#confirm");
    browser.wait_for("#phase", "over");
    let armed = || browser.document("uav1")["aircraft"]["status"]["armed"].as_bool();
    wait_for("the landing", || armed().filter(|it| !*it));
    forget(&system, state.path(), "mcm");
    browser.wait_for("[data-flag=memory_unusable]", "is garbled");
    browser.wait_for("#alarm", "uav1 caution: memory unusable");
    browser.wait_for("#verb-start:enabled", "");
    browser.wait_for("#verb-reasons", "The mission waits for Start.");
    assert_eq!(armed(), Some(false), "it does not take off by itself");
    system.http().wait_for_problem("is garbled");
    browser.picture("memory-lost");
    browser.click("#verb-start");
    browser.wait_for("#said[data-tone=good]", "start");
    wait_for("the notice to go", || browser.text("[data-flag=memory_unusable]").is_none().then_some(()));
    wait_for("the bar to go", || browser.text("#alarm").is_none().then_some(()));
    browser.wait_for("#strip", "offboard");
    wait_for("the health", || Some(system.http().json("/healthz")).filter(|it| it["status"] == "ok"));
    browser.picture("memory-lost-started");
    browser.expect_no_error();
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn after_a_crash_it_says_that_the_vehicle_fell_and_waits_for_an_inspection() {
    let (system, browser) = watch(&[]);
    browser.wait_for("#strip", "offboard");
    browser.take_command();
    assert_eq!(browser.text("#verb-inspected"), None, "it has not crashed");
    assert!(system.inject(&["fault", "flight_termination"]).status.success());
    browser.wait_for("#report", "the motors were stopped at");
    browser.wait_for("#verb-reasons", "The vehicle has crashed, `crashed`: the motors were stopped at");
    assert_eq!(browser.text("#verb-start:enabled"), None);
    browser.picture("crashed");
    browser.click("#verb-inspected");
    browser.click("#confirm");
    browser.wait_for("#said[data-tone=good]", "inspected");
    wait_for("the order to go", || browser.text("#verb-inspected").is_none().then_some(()));
    browser.expect_no_error();
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn decisions_that_the_tower_has_lost_are_stale_until_somebody_accepts_the_loss() {
    let area = "[data-area=A]";
    let grant = format!("{area} [data-decision=DECISION_GRANT]");
    let state = state_folder();
    let (system, browser) = watch_with_memory(state.path());
    browser.wait_for(area, "granted");
    assert_eq!((browser.text("#permissions-stale"), browser.text("#accept-loss")), (None, None));
    forget(&system, state.path(), "control-tower");
    browser.wait_for("#permissions-stale", "is garbled");
    browser.wait_for("#permissions-stale", "Nobody knows whether these still hold.");
    browser.wait_for("#accept-loss:enabled", "Accept the loss");
    browser.wait_for(&format!("{area}[data-stale]"), "stale");
    assert_eq!(browser.text(&grant), None, "nothing is granted before that");
    browser.picture("permissions-lost");
    browser.click("#accept-loss");
    browser.wait_for("#question", "It does so for every other vehicle too.");
    browser.picture("permissions-lost-question");
    browser.click("#confirm");
    browser.wait_for("#said[data-tone=good]", "uav1");
    wait_for("the notice to go", || browser.text("#permissions-stale").is_none().then_some(()));
    wait_for("the button to go", || browser.text("#accept-loss").is_none().then_some(()));
    browser.wait_for(&format!("{area}:not([data-stale])"), "Area A");
    browser.picture("permissions-lost-accepted");
    browser.expect_no_error();
}
