//! What an operator sees and does in a browser.
//!
//! Pictures of each story are kept in `target/tmp/screenshots`.

use nix::sys::signal::Signal;
use serde_json::json;

use crate::support::System;
use crate::support::browser::Browser;

const AREA_A: &str = "[data-area=A]";
const BATTERY: &str = "[data-flag=battery_low]";

/// The page of a system; nothing where there is no browser.
fn watch(args: &[&str]) -> Option<(System, Browser)> {
    let system = System::up(args, &[]);
    let browser = Browser::open(&system.link())?;
    Some((system, browser))
}

fn take_command(browser: &Browser) {
    browser.click("#take-command");
    browser.wait_for("#take-command", "Release");
}

#[test]
fn an_area_turns_granted_and_the_mission_flies_to_its_end() {
    let Some((_system, browser)) = watch(&["--speed", "10", "--permissions", "delay"]) else { return };
    browser.wait_for("#phase", "nominal");
    browser.wait_for(AREA_A, "asked, undecided");
    browser.picture("area-asked");
    browser.wait_for(AREA_A, "granted");
    browser.wait_for("#timeline .log", "Area A: granted.");
    browser.wait_for("#strip", "offboard");
    browser.picture("flying");
    browser.wait_for("#phase", "over: success");
    browser.wait_for("#report", "2 of 2 objectives achieved");
    browser.picture("over");
    browser.expect_no_error();
}

#[test]
fn a_flag_is_raised_and_acknowledged() {
    let Some((system, browser)) = watch(&["--speed", "5"]) else { return };
    browser.wait_for("#strip", "offboard");
    assert!(system.inject(&["fault", "battery", "0.2"]).status.success());
    browser.wait_for(BATTERY, "acting");
    browser.wait_for("#fleet", "battery low");
    browser.picture("flag");
    take_command(&browser);
    browser.click(&format!("{BATTERY} button"));
    browser.wait_for(BATTERY, "Acknowledged by");
    browser.picture("flag-acknowledged");
    browser.expect_no_error();
}

#[test]
fn abort_takes_two_steps() {
    let Some((_system, browser)) = watch(&["--speed", "5"]) else { return };
    browser.wait_for("#strip", "offboard");
    take_command(&browser);
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
fn loss_of_the_gateway_is_shown_until_it_is_back() {
    let Some((system, browser)) = watch(&["--speed", "5"]) else { return };
    browser.wait_for("#strip", "offboard");
    assert_eq!(browser.text("#staleness"), None, "nothing is stale");
    let gateway = system.process("gateway");
    gateway.signal(Signal::SIGSTOP);
    browser.wait_for("#staleness", "Connection lost");
    browser.wait_for("#strip[data-stale=true]", "");
    browser.picture("stale");
    gateway.signal(Signal::SIGCONT);
    browser.wait_for("body:not(.stale) #strip[data-stale=false]", "");
    // Gone for good, with everything else.
    drop(system);
    browser.wait_for("#staleness", "Connection lost");
    browser.expect_no_error();
}

#[test]
fn it_is_legible_on_a_tablet_by_day_and_by_night() {
    let Some((_system, browser)) = watch(&["--speed", "5"]) else { return };
    browser.wait_for("#strip", "offboard");
    for theme in ["light", "dark"] {
        let choose = "const it = document.getElementById('theme'); it.value = arguments[0]; it.dispatchEvent(new Event('change'))";
        browser.run(choose, vec![json!(theme)]);
        for (name, width, height) in
            [("desktop", 1440, 900), ("tablet-lying", 1024, 768), ("tablet-standing", 820, 1180)]
        {
            browser.size(width, height);
            let overflow = browser.run("return document.documentElement.scrollWidth - innerWidth", vec![]);
            assert!(overflow.as_i64().is_some_and(|it| it <= 0), "{name}, {theme}: {overflow} pixels too wide");
            browser.picture(&format!("{name}-{theme}"));
        }
    }
    browser.expect_no_error();
}
