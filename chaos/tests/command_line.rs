//! The program from outside, as far as nothing needs to fly.

use std::process::Command;

#[track_caller]
fn check(args: &[&str], code: i32, said: &str) {
    let output = Command::new(env!("CARGO_BIN_EXE_kittiwake-chaos")).args(args).output().expect("the program starts");
    let told = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
    assert_eq!(output.status.code(), Some(code), "{args:?}: {told}");
    assert!(told.contains(said), "expected `{said}`, got `{told}`");
}

#[test]
fn a_campaign_that_cannot_be_flown_is_no_success_and_one_can_be_listed() {
    check(&["--runs", "1", "--program", "nowhere"], 1, "nowhere is missing: build it, or name another with --program");
    check(&["--soak", "1", "--program", "nowhere"], 1, "nowhere is missing");
    check(&["--list", "--runs", "2", "--seed", "7"], 0, "\nseed 8  [");
    check(&["--runs", "0"], 2, "--runs");
    check(&["--speed", "101"], 2, "0.1 to 100");
}
