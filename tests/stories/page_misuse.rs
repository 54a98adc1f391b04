//! What the page says when something between it and the vehicle is not as it should be.

use serde_json::json;

use crate::support::System;
use crate::support::browser::{Browser, watch};
use crate::support::http_proxy::{HttpProxy, Manner};

const GOOD: &str = "body:not(.stale) #strip[data-stale=false]";

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn a_page_behind_a_proxy_says_what_the_proxy_does_not_let_through_and_that_the_gateway_was_upgraded() {
    let browser = Browser::start();
    let system = System::up(&[], &[]);
    let http = system.http();
    let proxy = HttpProxy::before(http.address);
    browser.visit(&format!("http://{}/#token={}", proxy.address, http.token));
    browser.wait_for(GOOD, "");
    proxy.behave(Manner::Unreachable);
    browser.wait_for("#staleness", "answer 502, which is not the gateway's: a proxy on the way does not reach it");
    browser.picture("proxy-unreachable");
    proxy.behave(Manner::Buffering);
    browser.wait_for("#staleness", "A proxy on the way may hold them back");
    browser.picture("proxy-buffers");
    proxy.behave(Manner::Honest);
    browser.wait_for(GOOD, "");
    assert_eq!(browser.text("#outdated"), None, "it is the same gateway");
    proxy.behave(Manner::Upgraded);
    browser.wait_for("#outdated", "The gateway was upgraded after this page was loaded");
    browser.picture("outdated");
    browser.click("#reload");
    browser.wait_for(GOOD, "");
    assert_eq!(browser.text("#outdated"), None, "the page is that of the gateway");
    browser.expect_no_error();
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn a_token_that_is_gone_is_told_with_what_to_do() {
    let (system, browser) = watch(&[]);
    browser.wait_for(GOOD, "");
    let token = system.http().token;
    browser.visit("about:blank");
    browser.visit(&system.link().replace(&token, "of-yesterday"));
    browser.wait_for("#sign-in-why", "Refused: ");
    browser.wait_for("#sign-in", "a gateway that was started again");
    browser.picture("token-gone");
    browser.fill("#token", &token);
    browser.click("#sign-in button");
    browser.wait_for(GOOD, "");
    browser.expect_no_error();
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn a_vehicle_with_another_mission_under_the_same_name_is_told() {
    let (system, browser) = watch(&[]);
    browser.wait_for("#strip", "offboard");
    browser.wait_for("#headline", "Mission reference");
    browser.take_command();
    // Somebody else, with the same token.
    let mission = "name = \"another\"\n[[objective]]\nname = \"return\"\nnorth_m = 0.0\neast_m = 0.0\nheight_m = 0.0\nflying = false\n";
    let body = serde_json::json!({ "text": mission }).to_string();
    let http = system.http();
    let more = format!("Content-Type: application/json\r\nIdempotency-Key: k\r\nContent-Length: {}\r\n", body.len());
    let answer = http.send(&(http.head("PUT", "/api/v1/vehicles/uav1/mission", &more) + &body));
    assert_eq!(answer.status, 200, "{}", String::from_utf8_lossy(&answer.body));
    browser.wait_for("#said", "uav1 has another mission now: another in place of reference.");
    browser.wait_for("#headline", "Mission another");
    browser.picture("another-mission");
    browser.expect_no_error();
}

/// What arrives: its source, when it was written by the gateway's clock, when it arrived by the page's, and when it was asked for.
type Arrival = (&'static str, i64, i64, Option<i64>);

/// By how many milliseconds each of these documents arrives late, by what the page knows once it has arrived.
#[track_caller]
fn late(browser: &Browser, documents: &[Arrival]) -> Vec<i64> {
    let script = "const [documents] = arguments; \
        return import('/page/gateway-clock.js').then(({ NOTHING_HEARD, heard, latenessOf }) => { \
            let clock = NOTHING_HEARD; \
            return documents.map(([source, utc, at, asked]) => { \
                clock = heard(clock, source, utc, at, asked === null ? null : { asked, olderBy: 500 }); \
                return Math.round(latenessOf(clock, utc, at)); \
            }); \
        })";
    let late = browser.run(script, vec![json!(documents)]);
    late.as_array().into_iter().flatten().filter_map(|it| it.as_i64()).collect()
}

#[track_caller]
fn expect_late(browser: &Browser, documents: &[Arrival], expected: &[i64]) {
    assert_eq!(late(browser, documents), expected, "{documents:?}");
}

/// Milliseconds at a time in milliseconds.
type Curve = fn(i64) -> i64;

/// A quarter of an hour over a link, in which the gateway's clock and the queue on the way change with the time.
struct Way {
    /// How much the gateway's clock goes slow.
    slow: Curve,
    /// The queue that statuses wait in.
    queue: Curve,
    /// The queue that answers wait in.
    answers: Curve,
}

impl Way {
    /// What arrives, in order, beginning with what arrives in time: a status twice a second, and each second an answer, which may be made from
    /// what was known half a second before.
    fn arrivals(&self) -> Vec<Arrival> {
        let Way { slow, queue, answers } = self;
        let status = |at: i64| ("status", at - slow(at), at + 20 + queue(at), None);
        let fleet = |at: i64| ("fleet", at - at % 500 - slow(at), at + 40 + answers(at), Some(at - 20));
        let seconds = || (0..900).map(|it| it * 1000);
        let statuses = seconds().flat_map(|it| [it + 10, it + 510]).map(status);
        let mut all: Vec<Arrival> = statuses.chain(seconds().map(|it| fleet(it + 300 + it % 7))).collect();
        all.sort_by_key(|it| it.2);
        all
    }

    /// What the page makes of the lateness of each status, with the time of its arrival.
    #[track_caller]
    fn late(&self, browser: &Browser) -> Vec<(i64, i64)> {
        let arrivals = self.arrivals();
        let late = late(browser, &arrivals);
        assert_eq!(late.len(), arrivals.len());
        arrivals.iter().zip(late).filter(|(it, _)| it.0 == "status").map(|(it, late)| (it.2, late)).collect()
    }
}

/// From which lateness on the page calls a status old.
const OLD_MS: i64 = 850;
const NEVER: Curve = |_| 0;
/// Five seconds, from the first minute on.
const QUEUE_MS: i64 = 5000;
const QUEUE: Curve = |at| if at < 60_000 { 0 } else { QUEUE_MS };
/// As chrony slews 3 s away by default, and back.
const SLEWED: Curve = |at| ((at - 120_000) * 3 / 40).clamp(0, 3000);
const SLEWED_BACK: Curve = |at| -SLEWED(at);
/// Steps that are too small to be seen in the order of the statuses.
const STEPS: Curve = |at| 400 * (at / 60_000);
const LARGE_STEP: Curve = |at| if at < 300_000 { 0 } else { 3_600_000 };

/// Clocks that are not left alone make nothing old.
#[track_caller]
fn expect_in_time(browser: &Browser, what: &str, slow: Curve) {
    let late = Way { slow, queue: NEVER, answers: NEVER }.late(browser);
    let old: Vec<_> = late.iter().filter(|it| OLD_MS <= it.1).collect();
    assert!(old.is_empty(), "{what}: {old:?}");
}

/// The page shows a queue as soon as it is there and for as long as it lasts, whatever is done to the gateway's clock
/// meanwhile.
#[track_caller]
fn expect_queue(browser: &Browser, what: &str, slow: Curve, answers: Curve) {
    let late = Way { slow, queue: QUEUE, answers }.late(browser);
    let wrong = |(at, late): &&(i64, i64)| {
        let is_told = (QUEUE_MS - *late).abs() < OLD_MS;
        is_told != (60_000 + QUEUE_MS <= *at)
    };
    let wrong: Vec<_> = late.iter().filter(wrong).collect();
    assert!(wrong.is_empty(), "{what}: {wrong:?}");
}

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored stories::page"]
fn a_page_behind_a_link_that_is_too_narrow_says_how_old_everything_is() {
    let browser = Browser::start();
    let system = System::up(&[], &[]);
    let http = system.http();
    let proxy = HttpProxy::before(http.address);
    browser.visit(&format!("http://{}/#token={}", proxy.address, http.token));
    browser.wait_for(GOOD, "");
    proxy.behave(Manner::Late);
    browser.wait_for("#staleness", "old: events arrive late");
    browser.wait_for("body.stale #strip[data-stale=true]", "");
    browser.picture("late");
    // What is ordered need not be late.
    browser.take_command();
    browser.wait_for("#verb-abort:enabled", "");
    browser.wait_for("#staleness", "old: events arrive late");
    proxy.behave(Manner::Honest);
    browser.wait_for(GOOD, "");

    const HOUR: i64 = 3_600_000;
    let status = |utc, at| ("status", utc, at, None);
    expect_late(&browser, &[status(0, 900), status(500, 1400), status(1000, 1890)], &[0, 0, 0]);
    // A queue that grows, and is gone.
    expect_late(
        &browser,
        &[status(0, 900), status(500, 1500), status(1000, 2200), status(1500, 2400)],
        &[0, 100, 300, 0],
    );
    // The queue was there before the first status, and something else has not waited in it.
    expect_late(&browser, &[status(0, 9000), ("fleet", 8500, 9000, None), status(500, 9500)], &[0, 0, 8500]);
    // A clock that is set, one way and back, makes nothing old.
    expect_late(&browser, &[status(0, 900), status(HOUR + 500, 1400), status(HOUR + 1000, 1900)], &[0, 0, 0]);
    expect_late(
        &browser,
        &[status(HOUR, 900), status(500, 1400), status(1000, 1900), status(1500, 2500)],
        &[0, 0, 0, 100],
    );
    // Nor do clocks that do not run alike: this is 8 s in a day.
    expect_late(&browser, &[status(0, 900), status(24 * HOUR, 24 * HOUR + 8900)], &[0, 0]);
    // A queue does not end with a clock that is set back.
    expect_late(&browser, &[status(HOUR, 900), status(HOUR + 500, 4400), status(1000, 4900)], &[0, 2999, 2999]);
    // A gateway whose loop stands still answers the same again and again: that is old, and no clock.
    let answer = |utc, at| ("fleet", utc, at, Some(at - 20));
    expect_late(&browser, &[answer(0, 900), status(0, 900), answer(0, 9900), status(0, 10_000)], &[0, 0, 8998, 9098]);
    expect_in_time(&browser, "left alone", NEVER);
    expect_in_time(&browser, "slewed", SLEWED);
    expect_in_time(&browser, "slewed back", SLEWED_BACK);
    expect_in_time(&browser, "several small steps back", STEPS);
    expect_in_time(&browser, "a large step back", LARGE_STEP);
    expect_queue(&browser, "a queue", NEVER, NEVER);
    expect_queue(&browser, "a queue that answers wait in too", NEVER, QUEUE);
    expect_queue(&browser, "a queue and a clock that is slewed", SLEWED, NEVER);
    expect_queue(&browser, "a queue and a clock that is slewed back", SLEWED_BACK, NEVER);
    expect_queue(&browser, "a queue and small steps", STEPS, NEVER);
    browser.expect_no_error();
}
