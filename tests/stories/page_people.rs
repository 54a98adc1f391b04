//! Several people at their browsers: who has command, who decides about areas, who may inject.

use gateway::access::Role;
use serde_json::json;

use crate::support::browser::{Browser, ENTER};
use crate::support::files::Files;
use crate::support::people::People;
use crate::support::{System, wait_for};

const AREA_A: &str = "[data-area=A]";

/// A system for these people, and a browser for each of the names.
fn up<const N: usize>(people: &People, names: [&str; N], more: &[&str]) -> (System, [Browser; N]) {
    let browsers = names.map(|_| Browser::start());
    let system = System::up(&[&["--access", people.folder()], more].concat(), &[]);
    for (name, browser) in names.iter().zip(&browsers) {
        browser.visit(&system.link_for(name));
    }
    (system, browsers)
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn command_is_handed_over_from_one_operator_to_another() {
    let people = People::new(&[("anna", Role::Operator), ("ben", Role::Operator)]);
    let (_system, [anna, ben]) = up(&people, ["anna", "ben"], &[]);
    anna.wait_for("#strip", "offboard");
    anna.take_command();
    ben.wait_for("#holder", "Command: anna");
    assert!(ben.text("#take-command:enabled").is_none(), "anna has command");
    assert!(ben.text("#verb-abort:enabled").is_none(), "anna has command");
    anna.click("#offer-command");
    anna.fill("#offer-to", "ben");
    anna.picture("hand-over");
    anna.type_keys(ENTER);
    anna.wait_for("#said[data-tone=good]", "offered to ben");
    ben.wait_for("#take-command:enabled", "Take command from anna");
    assert!(anna.text("#verb-abort:enabled").is_some(), "the vehicle is never without a commander");
    ben.picture("offered");
    ben.take_command();
    anna.wait_for("#said[data-tone=bad]", "ben has command of uav1 now.");
    assert!(anna.text("#verb-abort:enabled").is_none());
    ben.click("#verb-pause");
    ben.wait_for("#said[data-tone=good]", "pause");
    // Everybody sees who gave which order.
    anna.wait_for("#timeline .log", "Ben: pause");
    ben.click("#take-command");
    anna.wait_for("#holder", "Command: nobody");
    anna.expect_no_error();
    ben.expect_no_error();
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn the_tower_grants_and_revokes_and_does_nothing_else() {
    let people = People::new(&[("tina", Role::Tower)]);
    let more = ["--permissions", "silent"];
    let (_system, [tina]) = up(&people, ["tina"], &more);
    tina.wait_for(AREA_A, "requested");
    tina.picture("tower-asked");
    tina.click(&format!("{AREA_A} [data-decision=DECISION_GRANT]"));
    tina.wait_for("#said[data-tone=good]", "area A: granted");
    tina.wait_for(AREA_A, "granted");
    // A revocation is hazardous: it takes two steps.
    tina.fill(&format!("{AREA_A} input"), "a helicopter is coming");
    tina.click(&format!("{AREA_A} [data-decision=DECISION_REVOKE]"));
    tina.wait_for("#question", "Revoke the permission for area A");
    tina.picture("tower-revoke");
    tina.click("#confirm");
    tina.wait_for("#timeline .log", "Area A is revoked: a helicopter is coming.");
    // The vehicle asks again, and the operator's decision stands.
    tina.wait_for(&format!("{AREA_A}:not([data-state=granted])"), "Grant");
    assert_eq!(tina.text("#take-command"), None, "she takes no command");
    assert_eq!(tina.text("#mission-edit"), None, "she changes no mission");
    assert_eq!(tina.text("#injection"), None, "she injects nothing");
    for verb in ["pause", "abort", "return", "replan"] {
        assert!(tina.text(&format!("#verb-{verb}:enabled")).is_none(), "{verb}");
    }
    tina.expect_no_error();
}

/// No decision reaches the gateway: each is answered with the problem `window.problem`.
const UNANSWERED: &str = "
    const passed = window.fetch;
    window.problem = arguments[0];
    window.fetch = (url, options) => !url.endsWith('/decision') ? passed(url, options) : Promise.resolve(
        Response.json({ type: `urn:kittiwake:problem:${window.problem}`, detail: 'the tower is slow' }, { status: 503 }));";

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn a_decision_that_may_have_been_made_is_not_offered_again() {
    let people = People::new(&[("tina", Role::Tower)]);
    let (_system, [tina]) = up(&people, ["tina"], &["--permissions", "silent"]);
    tina.wait_for(AREA_A, "requested");
    let grant = format!("{AREA_A} [data-decision=DECISION_GRANT]");
    // Somebody else may have decided otherwise since.
    tina.run(UNANSWERED, vec![json!("unavailable")]);
    // Who has made a mistake knows no more than who says so.
    for problem in ["outcome-unknown", "internal", "invalid-reply"] {
        tina.run("window.problem = arguments[0]", vec![json!(problem)]);
        tina.click(&grant);
        tina.wait_for("#said[data-tone=bad]", "uav1, grant area A: no answer, and nobody knows whether it was done.");
        assert_eq!(tina.text("#again"), None, "{problem}");
        tina.picture(&format!("tower-{problem}"));
        // A decision that was certainly not made is.
        tina.run("window.problem = 'unavailable'", vec![]);
        tina.click(&grant);
        tina.wait_for("#said[data-tone=bad]", "uav1, grant area A: refused: the tower is slow");
    }
    tina.wait_for("#again", "Try again: grant area A, uav1");
    tina.expect_no_error();
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn flags_and_faults_are_injected_by_the_roles_that_may() {
    let people = People::new(&[("sam", Role::Safety), ("olga", Role::Observer)]);
    let (_system, [sam, olga]) = up(&people, ["sam", "olga"], &[]);
    sam.wait_for("#strip", "offboard");
    sam.click("#injection summary");
    sam.wait_for("#inject-go:enabled", "");
    sam.fill("#inject-fault", "wind");
    sam.wait_for("#inject-effect", "the wind blows towards");
    sam.fill("#inject-args", "1000 0");
    sam.click("#inject-go");
    sam.wait_for("#said[data-tone=bad]", "NORTH");
    sam.fill("#inject-args", "5 2 0");
    sam.click("#inject-go");
    sam.wait_for("#said[data-tone=good]", "the wind blows towards north 5, east 2 m/s");
    // Another aircraft, once it is reported, shows in the strip and on the map.
    sam.fill("#inject-fault", "intruder");
    // So far away that the vehicle need not hold.
    sam.fill("#inject-args", "-800 200 40 0 2");
    sam.click("#inject-go");
    sam.wait_for("#strip", "Traffic");
    sam.wait_for("#strip", "40 m high");
    sam.wait_for("#plots", "Tick time, max");
    sam.fill("#inject-flag", "obstacle");
    sam.click("#inject-raise");
    sam.wait_for("[data-flag=obstacle]", "By hand, sam.");
    sam.picture("injected");
    sam.wait_for("#timeline .log", "Flag `obstacle` raised: by hand, sam");
    sam.expect_no_error();
    olga.wait_for("#strip", "offboard");
    assert_eq!(olga.text("#injection"), None, "an observer injects nothing");
    olga.expect_no_error();
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn nothing_is_injected_into_a_vehicle_that_is_not_simulated() {
    let files = Files::shipped().with("kittiwake.toml", "\nsimulation = true", "\nsimulation = false");
    let people = People::new(&[("sam", Role::Safety)]);
    let config = files.config();
    let more = ["--config", &config.to_string_lossy()];
    let (_system, [sam]) = up(&people, ["sam"], &more);
    sam.wait_for("#verb-abort:enabled", "");
    assert_eq!(sam.text("#injection"), None);
    let status = "return fetch('/api/v1/vehicles/uav1/simulation/flags', { method: 'POST', headers: { \
        Authorization: 'Bearer sam', 'Idempotency-Key': 'k' }, body: '{\"name\":\"obstacle\",\"raised\":true}' })\
        .then((it) => it.status)";
    let answer = wait_for("an answer", || sam.run(status, vec![]).as_u64());
    assert_eq!(answer, 404, "the route is not there");
}
