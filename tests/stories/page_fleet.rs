//! Two vehicles on one page.

use std::collections::BTreeSet;
use std::process::{Child, Command, Stdio};

use serde_json::Value;

use crate::support::browser::watch;
use crate::support::{KITTIWAKE, System, kittiwake, wait_for};

const UAV1: &str = "#fleet [data-key=uav1] button";
const UAV2: &str = "#fleet [data-key=uav2] button";

/// A second vehicle beside the system's own: five services on the same router, with the same ground.
struct Vehicle(Vec<Child>);

impl Vehicle {
    fn start(name: &str, system: &System) -> Vehicle {
        let start = |service: &str| {
            Command::new(KITTIWAKE)
                .args(["run", service, "--vehicle", name, "--connect", &system.locator(), "--exit-with-parent"])
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
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn of_two_vehicles_the_one_in_trouble_comes_first() {
    let (system, browser) = watch(&[]);
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
    browser.click(UAV2);
    browser.wait_for("#headline", "uav2");
    browser.wait_for("[data-flag=battery_low]", "acting");
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

/// The first track of uav2 is refused. Its stream tells, over and over, its state, then who has command `now`, and then an event from long
/// before, which the others have overtaken.
const OVERTAKEN: &str = "
    const passed = window.fetch;
    const event = (type, data) => `event: ${type}\\ndata: ${data}\\n\\n`;
    const holds = (holder, year) => event('command', JSON.stringify({ holder, missionTimeS: 1, utc: `${year}-01-01T00:00:00.000Z` }));
    window.tracks = 0;
    window.fetch = async (url, options) => {
        if (url.endsWith('/uav2/track') && ++window.tracks === 1) return Response.json({ detail: 'too many' }, { status: 429 });
        if (!url.endsWith('/uav2/events')) return passed(url, options);
        const state = await passed(url.replace('/events', ''), { headers: options.headers });
        return new Response(event('status', await state.text()) + holds('now', 2100) + holds('before', 2020));
    };";

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn an_event_that_a_status_has_overtaken_changes_nothing_and_a_track_that_was_refused_is_asked_for_again() {
    let (system, browser) = watch(&[]);
    let _uav2 = Vehicle::start("uav2", &system);
    browser.wait_for(UAV2, "in the air");
    browser.run(OVERTAKEN, vec![]);
    browser.click(UAV2);
    browser.wait_for("#headline", "uav2");
    browser.wait_for("#holder", "Command: now");
    wait_for("the track to be asked for again", || {
        browser.run("return 1 < window.tracks", vec![]).as_bool().filter(|it| *it)
    });
    browser.wait_for("#holder", "Command: now");
    browser.expect_no_error();
}

/// Notes every order of the page in `ordered`, leaves those to hold without an answer, and keeps that about the mission of uav1 back until
/// `answer` is called.
const SPY: &str = "
    const passed = window.fetch;
    window.ordered = [];
    window.fetch = (url, options) => {
        if ((options?.method ?? 'GET') !== 'GET') window.ordered.push(url);
        if (url.endsWith('/pause')) return Promise.reject(new TypeError('no answer'));
        const answer = passed(url, options);
        if (!url.endsWith('/uav1/mission')) return answer;
        return answer.then((it) => it.json()).then((mission) => new Promise((done) => {
            window.answer = () => done({ ok: true, json: async () => mission });
        }));
    };";

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn what_was_asked_of_one_vehicle_is_never_ordered_of_another() {
    let (system, browser) = watch(&[]);
    let _uav2 = Vehicle::start("uav2", &system);
    browser.wait_for("#strip", "offboard");
    browser.wait_for(UAV2, "in the air");
    browser.run(SPY, vec![]);
    // A question is about its vehicle, and goes with it.
    browser.take_command();
    browser.click("#verb-abort");
    browser.wait_for("#question", "uav1: End the mission now and land?");
    browser.wait_for("#confirm", "Confirm for uav1: Abort");
    browser.picture("fleet-asked");
    browser.click(UAV2);
    browser.wait_for("#headline", "uav2");
    assert_eq!(browser.text("#question"), None, "the question is withdrawn");
    // So is a place that is being chosen.
    browser.take_command();
    browser.click("#verb-land-at");
    browser.wait_for("#said", "uav2: Choose the place on the map");
    browser.wait_for("#map.picking", "");
    browser.click(UAV1);
    browser.wait_for("#headline", "uav1");
    assert_eq!(browser.text("#map.picking"), None, "nothing is chosen any more");
    // An order without an answer is offered again while its vehicle is selected.
    browser.click("#verb-pause");
    browser.wait_for("#said[data-tone=bad]", "uav1, pause: no answer");
    browser.wait_for("#again", "Try again: pause, uav1");
    browser.click(UAV2);
    browser.wait_for("#headline", "uav2");
    browser.wait_for("#said", "uav1, pause");
    assert_eq!(browser.text("#again"), None, "that was an order to uav1");
    browser.click(UAV1);
    browser.wait_for("#again", "Try again: pause, uav1");
    // An answer that comes late fills no other vehicle's editor.
    browser.click("#mission-edit");
    wait_for("the answer to be held back", || {
        browser.run("return 'answer' in window", vec![]).as_bool().filter(|it| *it)
    });
    assert_eq!(browser.value("#mission-text"), "", "it is not here yet");
    browser.click(UAV2);
    browser.wait_for("#headline", "uav2");
    browser.click("#mission-edit");
    browser.wait_for("#editor", "Another mission for uav2");
    wait_for("its mission", || Some(browser.value("#mission-text")).filter(|it| !it.is_empty()));
    browser.fill("#mission-text", "of uav2");
    browser.run("window.answer(); return new Promise((done) => setTimeout(done))", vec![]);
    assert_eq!(browser.value("#mission-text"), "of uav2");
    let Value::Array(ordered) = browser.run("return window.ordered", vec![]) else { panic!("a list was kept") };
    let ordered: BTreeSet<_> = ordered.iter().filter_map(Value::as_str).collect();
    let expected = ["uav1/command/take", "uav1/pause", "uav2/command/take"].map(|it| format!("/api/v1/vehicles/{it}"));
    assert_eq!(ordered, expected.iter().map(String::as_str).collect());
    browser.expect_no_error();
}
