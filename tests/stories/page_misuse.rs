//! What the page says when something between it and the vehicle is not as it should be.

use crate::support::System;
use crate::support::browser::{Browser, watch};
use crate::support::http_proxy::{HttpProxy, Manner};

const GOOD: &str = "body:not(.stale) #strip[data-stale=false]";

#[test]
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored"]
fn a_page_behind_a_proxy_says_what_the_proxy_does_not_let_through_and_that_the_gateway_was_upgraded() {
    let browser = Browser::start();
    let system = System::up(&["--speed", "1"], &[]);
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
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored"]
fn a_token_that_is_gone_is_told_with_what_to_do() {
    let (system, browser) = watch(&["--speed", "1"]);
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
#[ignore = "needs chromium and chromedriver: cargo test --test stories -- --ignored"]
fn a_vehicle_with_another_mission_under_the_same_name_is_told() {
    let (system, browser) = watch(&["--speed", "2"]);
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
