//! `kittiwake why`: an eventful flight, explained while it flies and from its recording.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::support::files::Files;
use crate::support::{System, kittiwake, wait_for};

/// What the command prints, if it succeeds.
fn told(args: &[&str]) -> Option<String> {
    let output = kittiwake(&[&["why"], args].concat());
    output.status.success().then(|| String::from_utf8(output.stdout).expect("it prints text"))
}

/// Whether these lines follow each other, each indented further than the one before. A line begins with the time of day.
fn stand_under_each_other(text: &str, parts: &[&str]) -> bool {
    let lines: Vec<&str> = text.lines().collect();
    let indent = |line: &str| line.find("  ").map(|at| line[at..].len() - line[at..].trim_start().len());
    lines.windows(parts.len()).any(|window| {
        let fit = window.iter().zip(parts).all(|(line, part)| line.contains(part));
        fit && window.windows(2).all(|pair| indent(pair[0]) < indent(pair[1]))
    })
}

/// The only recording in a folder.
#[track_caller]
fn recording(folder: &Path) -> PathBuf {
    let entries = std::fs::read_dir(folder).expect("the folder of the recordings");
    let files: Vec<PathBuf> = entries.map(|it| it.expect("an entry").path()).collect();
    assert_eq!(files.len(), 1, "{files:?}");
    files[0].clone()
}

const OBSTACLE: [&str; 3] = ["Flag `obstacle` raised: by hand.", "`obstacle`: stop.", "`obstacle` is over"];
const BATTERY: [&str; 3] = ["`battery_low`: ", "`battery_low`: divert.", " to land ("];

#[test]
fn a_flight_is_explained_while_it_flies_and_from_its_recording() {
    let files = Files::with_long_leg();
    let (config, folder) = (files.config(), tempfile::tempdir().unwrap());
    let recordings = folder.path().join("recordings");
    let [config, kept] = [&config, &recordings].map(|it| it.to_str().expect("a readable path"));
    let system = System::start(&["--config", config, "--speed", "5", "--recordings", kept]);
    system.wait_for_long_leg();
    assert!(system.inject(&["flag", "obstacle"]).status.success());
    system.wait_for("`obstacle` is over");
    let pid = system.pid().to_string();
    let pid = pid.as_str();
    let told_of = |parts: &[&str]| told(&["--pid", pid]).filter(|text| stand_under_each_other(text, parts));
    wait_for("the obstacle to be explained", || told_of(&OBSTACLE));
    assert_eq!(told(&["--pid", pid, "--last", "2"]).map(|it| it.lines().count()), Some(2));

    assert!(system.inject(&["fault", "battery", "0.2"]).status.success());
    system.wait_for("`battery_low`: divert");
    wait_for("the low battery to be explained", || told_of(&BATTERY));
    system.end();

    let file = recording(&recordings);
    let file = file.to_str().expect("a readable path");
    let text = told(&[file]).expect("the recording is explained");
    assert!(stand_under_each_other(&text, &OBSTACLE) && stand_under_each_other(&text, &BATTERY), "{text}");
    assert!(text.contains(" is below 25 %."), "{text}");
    let document: Value = serde_json::from_str(&told(&["--json", file]).expect("and as JSON")).unwrap();
    let decisions = document["decisions"].as_array().expect("a list");
    assert_eq!(decisions.len(), text.lines().count());
    let number = |it: &Value| it["record"]["sequence"].as_str().and_then(|it| it.parse::<u64>().ok());
    assert!(decisions.windows(2).all(|pair| number(&pair[0]) < number(&pair[1])), "numbers rise");
}

#[test]
fn a_file_that_is_no_recording_is_refused() {
    #[track_caller]
    fn check(file: &str, part: &str) {
        let output = kittiwake(&["why", file]);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        assert!(stderr.contains(file) && stderr.contains(part), "{stderr}");
    }
    let files = Files::shipped();
    check(files.config().to_str().unwrap(), "expected an MCAP file that a gateway has made");
    check("/nothing/here.mcap", "cannot be opened");
}
