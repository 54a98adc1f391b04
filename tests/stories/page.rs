//! What an operator sees and does in a browser. These stories are ignored unless they are asked for, because they need one:
//! `cargo test --test stories -- --ignored`. `.ci/run` runs them.
//!
//! Screenshots of each story go to `target/tmp/screenshots`.

use nix::sys::signal::Signal;
use serde_json::json;

use crate::support::browser::{Browser, watch};
use crate::support::files::Files;
use crate::support::wait_for;

const AREA_A: &str = "[data-area=A]";
const BATTERY: &str = "[data-flag=battery_low]";

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored"]
fn an_area_turns_granted_and_the_mission_flies_to_its_end() {
    // Long enough to be seen.
    let files = Files::shipped().with("kittiwake.toml", "delay_s = 5.0", "delay_s = 7.0");
    let config = files.config();
    let args = ["--config", &config.to_string_lossy(), "--speed", "2", "--permissions", "delay"];
    let (_system, browser) = watch(&args);
    browser.wait_for("#phase", "nominal");
    browser.wait_for(AREA_A, "requested");
    browser.picture("area-asked");
    browser.wait_for(AREA_A, "granted");
    browser.wait_for("#timeline .log", "Area A: granted.");
    browser.wait_for("#strip", "offboard");
    let far = || browser.document("uav1")["aircraft"]["derived"]["distanceHomeM"].as_f64().filter(|it| *it > 150.0);
    wait_for("the vehicle to be in area A", far);
    browser.picture("flying");
    browser.wait_for("#phase", "over: success");
    browser.wait_for("#report", "2 of 2 objectives achieved");
    browser.click("#recordings summary");
    browser.wait_for("#recordings", "reference");
    browser.picture("over");
    browser.expect_no_error();
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored"]
fn a_flag_is_raised_and_acknowledged() {
    let (system, browser) = watch(&["--speed", "5"]);
    browser.wait_for("#strip", "offboard");
    assert!(system.inject(&["fault", "battery", "0.2"]).status.success());
    browser.wait_for(BATTERY, "acting");
    browser.wait_for("#fleet", "battery low");
    browser.picture("flag");
    browser.take_command();
    browser.click(&format!("{BATTERY} button"));
    browser.wait_for(BATTERY, "Acknowledged by");
    browser.picture("flag-acknowledged");
    browser.expect_no_error();
}

/// How deep the node of this name is shown, from 1; `None` while it is folded away.
fn level(browser: &Browser, name: &str) -> Option<u64> {
    let script = "const it = [...document.querySelectorAll('#tree [role=treeitem]')]
            .find((it) => it.querySelector('[data-part=name]').textContent === arguments[0]);
        return it ? Number(it.ariaLevel) : null";
    browser.run(script, vec![json!(name)]).as_u64()
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored"]
fn the_tree_includes_its_subtrees_and_says_why_nodes_failed() {
    let (system, browser) = watch(&["--speed", "3"]);
    browser.wait_for("#strip", "offboard");
    // The tree that the executor has made of the step is shown below it.
    let executor = wait_for("the executor", || level(&browser, "NominalExecutor"));
    wait_for("the step below the executor", || level(&browser, "step").filter(|it| *it == executor + 1));
    assert_eq!(level(&browser, "contingency behavior"), None, "idle nodes are folded");
    browser.click("#tree-active");
    let included = wait_for("the included tree", || level(&browser, "contingency behavior"));
    assert_eq!(level(&browser, "contingencies").map(|it| it + 1), Some(included));
    assert!(system.inject(&["flag", "obstacle"]).status.success());
    browser.wait_for("#tree [data-failed]", "ago");
    browser.picture("tree");
    browser.click("#tree [aria-level='1']");
    wait_for("the root to be folded", || level(&browser, "contingencies").is_none().then_some(()));
    browser.expect_no_error();
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored"]
fn abort_takes_two_steps() {
    let (_system, browser) = watch(&["--speed", "5"]);
    browser.wait_for("#strip", "offboard");
    browser.take_command();
    browser.click("#verb-abort");
    browser.wait_for("#question", "End the mission now");
    browser.click("#cancel");
    assert_eq!(browser.text("#question"), None, "the question is withdrawn");
    browser.wait_for("#phase", "nominal");
    browser.click("#verb-abort");
    browser.picture("abort-asked");
    browser.click("#confirm");
    browser.wait_for("#said[data-tone=good]", "abort");
    browser.wait_for("#phase", "over");
    browser.picture("aborted");
    browser.expect_no_error();
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored"]
fn loss_of_the_gateway_is_shown_until_it_is_back() {
    let (system, browser) = watch(&["--speed", "5"]);
    browser.wait_for("#strip", "offboard");
    assert_eq!(browser.text("#staleness"), None, "nothing is stale");
    let gateway = system.process("gateway");
    gateway.signal(Signal::SIGSTOP);
    browser.wait_for("#staleness", "Connection lost");
    browser.wait_for("#strip[data-stale=true]", "");
    browser.picture("stale");
    gateway.signal(Signal::SIGCONT);
    browser.wait_for("body:not(.stale) #strip[data-stale=false]", "");
    // The whole system ends.
    drop(system);
    browser.wait_for("#staleness", "Connection lost");
    browser.expect_no_error();
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored"]
fn it_is_legible_on_a_tablet_by_day_and_by_night() {
    let (_system, browser) = watch(&["--speed", "5"]);
    browser.wait_for("#strip", "offboard");
    browser.views("flight");
    browser.expect_no_error();
}
