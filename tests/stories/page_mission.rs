//! Changing the mission, and approving plans, in a browser.

use crate::support::browser::{Browser, watch};
use crate::support::files::Files;
use crate::support::{System, wait_for};

const OUTCOME: &str = "#what-if-outcome";

/// A mission beside the areas of the reference one.
const SURVEY: &str = r#"
name = "survey"
[[objective]]
name = "mast"
north_m = 160.0
east_m = 60.0
height_m = 20.0
flying = true
[[objective]]
name = "back"
north_m = 0.0
east_m = 0.0
height_m = 0.0
flying = false
land_on_target = true
[origin]
latitude_deg = 54.0
longitude_deg = 6.6
altitude_m = 20.0
[[area]]
name = "all but the quay"
kind = "keep-out"
corners_m = [[-3000.0, -3000.0], [3000.0, -3000.0], [3000.0, 3000.0], [-3000.0, 3000.0]]
holes_m = [[[-900.0, -900.0], [900.0, -900.0], [900.0, 900.0], [-900.0, 900.0]]]
[[area]]
name = "bay"
kind = "no-landing"
ground = "water"
corners_m = [[-600.0, 400.0], [-600.0, 600.0], [-400.0, 600.0]]
"#;

/// The page of a system in the air.
fn in_flight() -> (System, Browser) {
    let (system, browser) = watch(&[]);
    browser.wait_for("#strip", "offboard");
    browser.take_command();
    browser.click("#mission-edit");
    (system, browser)
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn another_mission_is_tried_out_and_uploaded_in_flight() {
    let (_system, browser) = in_flight();
    let shown = wait_for("the mission's text", || Some(browser.value("#mission-text")).filter(|it| !it.is_empty()));
    assert!(shown.contains("name = \"deliver\"") && shown.contains("corners_m = [[-90.0, 110.0]"), "{shown}");
    // The present mission can be flown from here.
    browser.click("#what-if");
    browser.wait_for(OUTCOME, "Every objective of `reference` can be reached.");
    browser.wait_for("#upload:enabled", "Upload");
    // A change disables the upload again, and a mistake is shown with its place.
    browser.fill("#mission-text", &SURVEY.replace("north_m = 160.0", "north_m = far"));
    browser.wait_for("#upload:disabled", "Upload");
    browser.click("#what-if");
    browser.wait_for(OUTCOME, "line 5");
    browser.picture("mission-mistake");
    browser.fill("#mission-text", &SURVEY.replace("160.0", "160000.0"));
    browser.click("#what-if");
    browser.wait_for(&format!("{OUTCOME} .said[data-tone=bad]"), "");
    browser.fill("#mission-text", SURVEY);
    browser.click("#what-if");
    browser.wait_for(OUTCOME, "Every objective of `survey` can be reached.");
    browser.wait_for("[data-objective=mast][data-tone=good]", "m");
    // What it leaves in the battery.
    browser.wait_for("[data-objective=mast][data-tone=good]", "%");
    browser.views("what-if");
    assert_eq!(browser.document("uav1")["mission"]["name"], "reference", "nothing was changed");
    browser.click("#upload");
    browser.wait_for("#question", "in the air");
    browser.click("#confirm");
    browser.wait_for("#said[data-tone=good]", "`survey` takes the place of `reference`");
    browser.wait_for("#headline", "Mission survey");
    wait_for("the editor to close", || browser.text("#editor").is_none().then_some(()));
    // The text of the new mission has its origin.
    browser.click("#mission-edit");
    let origin = "[origin]\nlatitude_deg = 54.0\nlongitude_deg = 6.6\naltitude_m = 20.0\n";
    wait_for("the mission's origin", || browser.value("#mission-text").contains(origin).then_some(()));
    let hole = "holes_m = [[[-900.0, -900.0], [900.0, -900.0], [900.0, 900.0], [-900.0, 900.0]]]";
    let bay = "name = \"bay\"\nkind = \"no-landing\"\nground = \"water\"\ncorners_m";
    let text = browser.value("#mission-text");
    assert!([hole, bay, "land_on_target = true"].iter().all(|it| text.contains(it)), "{text}");
    browser.click("#editor-close");
    browser.wait_for("#phase", "over: success");
    assert_eq!(browser.document("uav1")["report"]["objectives"][0]["name"], "mast");
    browser.expect_no_error();
}

/// North and east under the pointer at this offset from the middle of the map, in metres.
fn under_pointer(browser: &Browser, at: (f64, f64)) -> Option<(f64, f64)> {
    browser.drag("#map canvas", at, at);
    let shown = browser.text("#map .map-readout")?.replace(['\u{2212}'], "-").replace(['\u{202f}', '\u{a0}', ','], "");
    let mut words = shown.split_whitespace().filter_map(|it| it.parse().ok());
    Some((words.next()?, words.next()?))
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn an_objective_is_dragged_on_the_map_and_the_text_follows() {
    let (_system, browser) = in_flight();
    wait_for("the mission's text", || Some(browser.value("#mission-text")).filter(|it| !it.is_empty()));
    browser.fill("#mission-text", SURVEY);
    browser.click("#what-if");
    browser.wait_for(OUTCOME, "Every objective of `survey` can be reached.");
    // The map does not move by itself, so that pixels can be reckoned from two places on it.
    let (north, east) = wait_for("the middle of the map", || under_pointer(&browser, (0.0, 0.0)));
    let (_, farther) =
        wait_for("a place beside it", || under_pointer(&browser, (200.0, 0.0)).filter(|it| it.1 != east));
    let pixels = 200.0 / (farther - east);
    let at = |to_north: f64, to_east: f64| ((to_east - east) * pixels, (north - to_north) * pixels);
    browser.drag("#map canvas", at(160.0, 60.0), at(100.0, -40.0));
    let moved = wait_for("the objective to be elsewhere", || {
        Some(browser.value("#mission-text")).filter(|it| !it.contains("north_m = 160.0\neast_m = 60.0\n"))
    });
    let number = |key: &str| -> f64 {
        let line = moved.lines().find_map(|it| it.strip_prefix(key)).expect("the key is there");
        line.trim().parse().expect("a number")
    };
    let (north_m, east_m) = (number("north_m ="), number("east_m ="));
    assert!((north_m - 100.0).abs() < 5.0 && (east_m + 40.0).abs() < 5.0, "({north_m}, {east_m})\n{moved}");
    // It has to be tried out again.
    browser.wait_for("#upload:disabled", "Upload");
    browser.picture("dragged");
    browser.click("#what-if");
    browser.wait_for(OUTCOME, "Every objective of `survey` can be reached.");
    browser.expect_no_error();
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn objectives_are_inserted_removed_and_skipped_in_flight() {
    let (_system, browser) = in_flight();
    // So that no objective is settled but by the operator.
    browser.click("#verb-pause");
    browser.wait_for("[data-flag=operator_pause]", "acting");
    browser.wait_for("[data-flag=operator_pause][data-tone=accent]", "acting");
    assert_eq!(browser.text("#alarm"), None, "one's own order is not an alarm");
    browser.fill("#insert-name", "mast");
    browser.click("#insert-pick");
    // North of the areas.
    browser.click_off("#map canvas", 0, -130);
    let north: f64 = wait_for("the place", || browser.value("#insert-north").parse().ok().filter(|it| *it > 100.0));
    browser.fill("#insert-height", "30");
    browser.click("#insert-flying");
    browser.fill("#insert-before", "1");
    browser.picture("insert");
    browser.click("#insert");
    browser.wait_for("#said[data-tone=good]", "objective `mast` inserted at 1");
    browser.wait_for("[data-objective=mast]", "30 m high");
    let objectives = browser.document("uav1")["mission"]["objectives"].clone();
    assert_eq!(objectives[1]["name"], "mast");
    assert!((objectives[1]["position"]["northM"].as_f64().unwrap_or(0.0) - north).abs() < 0.1, "{objectives}");
    browser.click("[data-objective=mast] [data-part=remove]");
    browser.wait_for("#question", "Remove objective mast");
    browser.click("#confirm");
    browser.wait_for("#said[data-tone=good]", "objective `mast` removed");
    browser.click("[data-objective=deliver] [data-part=skip]");
    browser.wait_for("#question", "Skip objective deliver");
    browser.click("#confirm");
    browser.wait_for("[data-objective=deliver]", "Skipped by demo.");
    // A settled objective has no buttons.
    wait_for("no buttons", || browser.text("[data-objective=deliver] [data-part=skip]").is_none().then_some(()));
    browser.click("#verb-resume");
    browser.wait_for("#phase", "over: failure");
    browser.expect_no_error();
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn a_plan_waits_for_approval_and_the_page_shows_for_how_long() {
    let files = Files::shipped()
        .with("kittiwake.toml", "plan_approval = \"none\"", "plan_approval = \"each-plan\"")
        .with("kittiwake.toml", "plan_approval_limit_s = 60.0", "plan_approval_limit_s = 600.0");
    let config = files.config();
    let (_system, browser) = watch(&["--config", &config.to_string_lossy()]);
    let asked = browser.wait_for("#approval", "waits for approval");
    assert!(asked.contains("rejected by default") && asked.contains("asking A"), "{asked}");
    assert!(browser.text("#approve:enabled").is_none(), "a decision needs command");
    browser.take_command();
    // The bar shows how much time is left.
    let left = || browser.run("return document.querySelector('#approval progress').value", vec![]).as_f64();
    let first = wait_for("the time that is left", left);
    wait_for("less time", || left().filter(|it| *it < first));
    browser.views("approval");
    browser.click("#reject");
    browser.wait_for("#said[data-tone=good]", "reject plan");
    browser.wait_for("[data-flag=operator_pause]", "acting");
    browser.click("#verb-resume");
    browser.wait_for("#approval", "waits for approval");
    browser.click("#approve");
    browser.wait_for("#said[data-tone=good]", "approve plan");
    wait_for("no question", || browser.text("#approval").is_none().then_some(()));
    browser.wait_for("#strip", "offboard");
    browser.expect_no_error();
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn a_plan_without_a_decision_is_flown_where_that_is_the_default() {
    let files = Files::shipped()
        .with("kittiwake.toml", "plan_approval = \"none\"", "plan_approval = \"each-plan\"")
        .with("kittiwake.toml", "plan_approval_default = \"refuse\"", "plan_approval_default = \"approve\"");
    let config = files.config();
    let (_system, browser) = watch(&["--config", &config.to_string_lossy()]);
    let asked = browser.wait_for("#approval", "waits for approval");
    assert!(asked.contains("approved by default"), "{asked}");
    browser.wait_for("#strip", "offboard");
    assert_eq!(browser.text("#approval"), None, "the question is gone");
    browser.wait_for("#timeline .log", "approved: nobody has decided in time");
    browser.expect_no_error();
}
