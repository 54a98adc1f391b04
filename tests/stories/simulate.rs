//! `kittiwake simulate`: flights in virtual time, judged, and the same on every run. Its mistakes in the command line are in
//! `src/cli.rs`.

use serde_json::Value;

use crate::support::files::Files;
use crate::support::{kittiwake, shipped};

/// What `kittiwake simulate` prints about the shipped configuration, and its exit code.
fn simulate(args: &[&str]) -> (Option<i32>, String, String) {
    let config = shipped().join("kittiwake.toml");
    let output = kittiwake(&[&["simulate", "--config", &config.to_string_lossy()], args].concat());
    let text = |bytes| String::from_utf8(bytes).expect("it prints UTF-8");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

/// The result as JSON, and the exit code.
#[track_caller]
fn result(args: &[&str]) -> (Option<i32>, Value) {
    let (code, said, complaints) = simulate(&[args, &["--json"]].concat());
    (code, serde_json::from_str(&said).unwrap_or_else(|cause| panic!("{cause}: {said}{complaints}")))
}

#[test]
fn a_seed_is_the_same_flight_in_another_process_and_thread_and_another_seed_is_another_flight() {
    let (code, both) = result(&["--busy", "--seed", "4", "--runs", "2", "--jobs", "2"]);
    assert_eq!(code, Some(0), "{both:#}");
    let (code, second) = result(&["--busy", "--seed", "5"]);
    assert_eq!(code, Some(0), "{second:#}");
    let hash = |result: &Value, run: usize| result["runs"][run]["sha256"].as_str().expect("a hash").to_owned();
    assert_eq!(hash(&both, 0).len(), 64);
    assert_ne!(hash(&both, 0), hash(&both, 1));
    assert_eq!(hash(&both, 1), hash(&second, 0));
    assert_ne!(both["sha256"], second["sha256"], "that of both runs is another one");
    assert!(1.0 < second["timesRealTime"].as_f64().expect("a number"), "{second:#}");
}

#[test]
fn one_flight_is_told_as_a_story() {
    let (code, said, complaints) = simulate(&["--flag", "obstacle@40"]);
    assert_eq!((code, complaints.as_str()), (Some(0), ""), "{said}");
    let expected = [
        "trouble: flag obstacle",
        "seed 1  ok  over: success, on the ground at ",
        "1 runs, 0 with a breach, ",
        "x real time",
        "mission done",
        "sha256 of all decision logs: ",
    ];
    let mut rest = said.as_str();
    for part in expected {
        let at = rest.find(part).unwrap_or_else(|| panic!("`{part}` is not said, or too early:\n{said}"));
        rest = &rest[at + part.len()..];
    }
}

#[test]
fn a_breach_is_told_with_its_decisions_and_the_command_that_flies_it_again() {
    let empty = "battery@40:0";
    let (code, said, _) = simulate(&["--fault", empty]);
    assert_eq!(code, Some(1), "{said}");
    for part in [
        "seed 1  BREACH",
        "trouble: fault battery 0",
        "breach: seed 1, ",
        "the vehicle crashed",
        "decided before:",
        "again: kittiwake simulate --seed 1 --config ",
        "--fault 'battery@40:0'",
        "1 runs, 1 with a breach",
    ] {
        assert!(said.contains(part), "`{part}` is not said:\n{said}");
    }
    let (code, json) = result(&["--fault", empty]);
    assert_eq!(code, Some(1), "{json:#}");
    let breaches = json["runs"][0]["breaches"].as_array().expect("a list");
    let end = breaches.iter().find(|it| it["rule"] == "end").unwrap_or_else(|| panic!("{json:#}"));
    assert!(!end["decisions"].as_array().expect("a list").is_empty(), "{json:#}");
}

#[test]
fn a_seed_without_a_breach_is_not_shrunk() {
    let (code, said, complaints) = simulate(&["--shrink", "8"]);
    assert_eq!((code, complaints.as_str()), (Some(0), ""), "{said}");
    assert!(said.starts_with("seed 8 has no breach: there is nothing to shrink"), "{said}");
}

#[test]
fn bad_input_is_told_and_nothing_is_flown() {
    #[track_caller]
    fn check(args: &[&str], said: &str) {
        let output = kittiwake(&[&["simulate"], args].concat());
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {told}");
        assert!(output.stdout.is_empty(), "{args:?}: nothing is flown");
        assert!(told.contains(said), "{args:?} does not say `{said}`:\n{told}");
    }
    let config = shipped().join("kittiwake.toml");
    let config = config.to_string_lossy();
    check(&["--config", "nowhere.toml"], "nowhere.toml: cannot be read");
    check(&["--config", &config, "--mission", "nowhere.toml"], "nowhere.toml: cannot be read");
    check(&["--config", &config, "--flag", "obstcle@40"], "unknown flag `obstcle`: did you mean `obstacle`?");
    check(&["--fault", "batery@60:0.2"], "there is no fault `batery`; did you mean `battery`?");
    check(&["--fault", "battery@-60:0.2"], "found time `-60`, expected seconds after the start");
    check(&["--runs", "0"], "--runs");
    let broken = Files::shipped().with("missions/reference.toml", "height_m = 0.0", "height_m = -120.0");
    check(&["--config", &broken.config().to_string_lossy(), "--chaos"], "`deliver` is inside the ground");
}
