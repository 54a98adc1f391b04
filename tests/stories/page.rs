//! What an operator sees and does in a browser. These stories are ignored unless they are asked for, because they need one:
//! `cargo test --test stories -- --ignored stories::page`. `.ci/run` runs those of `page::`, `.ci/long` all.
//!
//! Screenshots of each story go to `target/tmp/screenshots`.

use nix::sys::signal::Signal;
use serde_json::json;

use crate::support::browser::{Browser, watch};
use crate::support::files::Files;
use crate::support::processes::Process;
use crate::support::wait_for;

const AREA_A: &str = "[data-area=A]";
const GNSS: &str = "[data-flag=gnss_lost]";

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn an_area_turns_granted_and_the_mission_flies_to_its_end() {
    // Faster than a person could act, for nobody acts here but the tower: it answers once it is seen that it is asked, and is asked until then.
    let files = Files::shipped().with("kittiwake.toml", "permission_tries = 3", "permission_tries = 60");
    let config = files.config();
    let (system, browser) = watch(&["--config", &config.to_string_lossy(), "--speed", "2", "--permissions", "silent"]);
    browser.wait_for("#phase", "nominal");
    browser.wait_for(AREA_A, "requested");
    browser.picture("area-asked");
    for area in ["A", "B"] {
        system.grant(area);
    }
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
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn a_flag_is_raised_and_acknowledged() {
    let (system, browser) = watch(&[]);
    browser.wait_for("#strip", "offboard");
    // It holds until somebody lowers it, so that the operator finds the alarm however late.
    assert!(system.inject(&["flag", "gnss_lost"]).status.success());
    browser.wait_for(GNSS, "acting");
    browser.wait_for("#fleet", "gnss lost");
    browser.wait_for("#alarm", "uav1 warning: gnss lost");
    browser.wait_for("#contingencies[data-alarm=bad]", "gnss lost");
    wait_for("the tab to say it", || {
        browser.run("return document.title", vec![]).as_str()?.contains("uav1: gnss lost").then_some(())
    });
    browser.picture("flag");
    browser.take_command();
    browser.click(&format!("{GNSS} button"));
    browser.wait_for(GNSS, "Acknowledged by");
    wait_for("the bar to go", || browser.text("#alarm").is_none().then_some(()));
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
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn the_tree_includes_its_subtrees_and_says_why_nodes_failed() {
    let (system, browser) = watch(&[]);
    browser.wait_for("#strip", "offboard");
    // The tree that the executor has made of the step is shown below it.
    let executor = wait_for("the executor", || level(&browser, "NominalExecutor"));
    wait_for("the step below the executor", || level(&browser, "step").filter(|it| *it == executor + 1));
    assert_eq!(level(&browser, "contingency behavior"), None, "idle nodes are not sent");
    browser.wait_for("#tree", " idle");
    // It holds until somebody lowers it: a response that ends at once is not seen.
    assert!(system.inject(&["flag", "gnss_lost"]).status.success());
    let included = wait_for("the included tree", || level(&browser, "contingency behavior"));
    assert_eq!(level(&browser, "contingencies").map(|it| it + 1), Some(included));
    browser.wait_for("#tree [data-failed]", "ago");
    browser.picture("tree");
    browser.click("#tree [aria-level='1']");
    wait_for("the root to be folded", || level(&browser, "contingencies").is_none().then_some(()));
    browser.expect_no_error();
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn abort_takes_two_steps() {
    let (_system, browser) = watch(&[]);
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
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn loss_of_the_gateway_is_shown_until_it_is_back() {
    let (system, browser) = watch(&[]);
    browser.wait_for("#strip", "offboard");
    assert_eq!(browser.text("#staleness"), None, "nothing is stale");
    let gateway = system.process("gateway");
    gateway.signal(Signal::SIGSTOP);
    browser.wait_for("#staleness", "Connection lost");
    browser.wait_for("#strip[data-stale=true]", "");
    browser.picture("stale");
    // On a slow machine the launcher has found that it hangs, and another stands in its place.
    let _ = gateway.try_signal(Signal::SIGCONT);
    browser.wait_for("body:not(.stale) #strip[data-stale=false]", "");
    // The whole system ends.
    drop(system);
    browser.wait_for("#staleness", "Connection lost");
    browser.expect_no_error();
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn a_page_knows_after_a_restart_of_the_gateway_what_was_flown_before() {
    let folder = tempfile::tempdir().unwrap();
    let (system, browser) = watch(&["--recordings", folder.path().to_str().unwrap()]);
    browser.wait_for("#timeline .log", "Area A: granted.");
    // The gateway writes once a second; what it had not written when it was killed is lost.
    let area = || browser.document("uav1")["aircraft"]["derived"]["distanceHomeM"].as_f64().filter(|it| 150.0 < *it);
    wait_for("the vehicle to be in area A", area);
    let before = browser.document("uav1")["missionTimeS"].as_f64().expect("the time is known");
    let killed = system.process("gateway");
    killed.signal(Signal::SIGKILL);
    // The next gateway may be there before the page calls its data stale, so that no banner is waited for.
    let is_another = |(name, it): &(String, Process)| name == "gateway" && it.id() != killed.id();
    wait_for("another gateway", || system.children().iter().any(is_another).then_some(()));
    let after = wait_for("the time", || browser.document("uav1")["missionTimeS"].as_f64());
    assert!(before <= after, "{after} s after {before} s");
    // The page has heard that.
    let shown_s = || {
        let text = browser.text("#mission-time")?;
        let (minutes, seconds) = text.split_once(':')?;
        Some(minutes.parse::<f64>().ok()? * 60.0 + seconds.parse::<f64>().ok()?)
    };
    wait_for("the page to go on", || shown_s().filter(|it| after + 1.0 < *it));
    browser.wait_for("body:not(.stale) #strip[data-stale=false]", "");
    browser.wait_for("#timeline .log", "Area A: granted.");
    browser.picture("restarted");
    browser.expect_no_error();
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn an_alarm_is_shelved_and_comes_back() {
    let (_system, browser) = watch(&[]);
    browser.wait_for("#strip", "offboard");
    browser.click("[data-trouble=battery]");
    browser.wait_for("#response", "battery low. Home, down in 0:");
    browser.wait_for("#response", "The mission ends with it.");
    browser.wait_for("#alarm .alarm", "uav1 warning: battery low");
    let shelve =
        "const it = document.querySelector('#alarm select'); it.value = '5'; it.dispatchEvent(new Event('change'))";
    browser.run(shelve, vec![]);
    browser.wait_for("#unshelve", "1 shelved until");
    wait_for("the alarm to rest", || browser.text("#alarm .alarm").is_none().then_some(()));
    browser.picture("shelved");
    browser.click("#unshelve");
    browser.wait_for("#alarm .alarm", "uav1 warning: battery low");
    browser.fill("#journal-search", "battery");
    wait_for("the journal to be filtered", || {
        let lines =
            "return [...document.querySelectorAll('#timeline .log li')].map((it) => it.textContent.toLowerCase())";
        let lines = browser.run(lines, vec![]).as_array().cloned().unwrap_or_default();
        (!lines.is_empty() && lines.iter().all(|it| it.as_str().is_some_and(|it| it.contains("battery")))).then_some(())
    });
    browser.expect_no_error();
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn it_is_legible_on_a_tablet_by_day_and_by_night() {
    let (_system, browser) = watch(&[]);
    browser.wait_for("#strip", "offboard");
    browser.views("flight");
    browser.expect_no_error();
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn the_description_of_the_api_is_shown_to_its_end() {
    let (system, browser) = watch(&[]);
    let api = system.http().json("/openapi.json");
    let schemas = api["components"]["schemas"].as_object().expect("there are schemas");
    let problems =
        schemas["kittiwake.v1.Problem"]["properties"]["type"]["examples"].as_array().expect("there are kinds");
    let operations = api["paths"].as_object().into_iter().flatten().filter_map(|(_, it)| it.as_object());
    browser.visit(&format!("http://{}/docs", system.http().address));
    browser.wait_for("#schemas", "kittiwake.v1.Vehicle");
    browser.wait_for("#problems", "urn:kittiwake:problem:outcome-unknown");
    let expect = |selector: &str, count: usize| {
        let said = "return [...document.querySelectorAll(arguments[0])].filter((it) => it.textContent.trim()).length";
        assert_eq!(browser.run(said, vec![json!(selector)]), json!(count), "{selector}");
    };
    expect("#operations details", operations.map(|it| it.len()).sum());
    expect("#problems dt", problems.len());
    expect("#problems dd", problems.len());
    expect("#schemas details", schemas.len());
    browser.picture("docs");
    browser.expect_no_error();
}
