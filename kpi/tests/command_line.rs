//! The program from outside, as far as nothing needs to fly.

use std::process::Command;

#[track_caller]
fn check(args: &[&str], code: i32, said: &str) {
    let config = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/kittiwake.toml");
    let mut program = Command::new(env!("CARGO_BIN_EXE_kittiwake-kpi"));
    let output = program.args(["--config", config]).args(args).output().expect("the program starts");
    let told = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
    assert_eq!(output.status.code(), Some(code), "{args:?}: {told}");
    assert!(told.contains(said), "expected `{said}`, got `{told}`");
}

#[test]
fn what_cannot_be_measured_is_no_success() {
    check(&["--link", "--program", "nowhere"], 1, "nowhere is missing: build it with `cargo build --release`");
    check(&["--link", "--operator"], 2, "cannot be used with");
}
