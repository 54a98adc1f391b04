//! Hazardous orders in a browser: with the mouse on the map, and with the keyboard only.

use crate::support::browser::{ENTER, ESCAPE, watch};
use crate::support::wait_for;

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored"]
fn a_landing_place_is_clicked_on_the_map_and_confirmed() {
    let (_system, browser) = watch(&["--speed", "5"]);
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
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored"]
fn abort_needs_no_mouse() {
    let (_system, browser) = watch(&["--speed", "3"]);
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
