//! A human's mistakes are reported with their place, before anything starts.

use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::support::files::Files;
use crate::support::{KITTIWAKE, kittiwake, shipped};

/// Makes one mistake in a shipped file: `from` becomes `to`. Both `kittiwake check` and `kittiwake up` must report it at
/// the place of `at`, with all of `said`.
#[track_caller]
fn check(file: &str, from: &str, to: &str, at: &str, said: &[&str]) {
    let files = Files::shipped().with(file, from, to);
    let config = files.config();
    let place = place(file, from, to, at);
    for command in [&["check"][..], &["up", "--exit-when-done", "--json"]] {
        let output = kittiwake(&[command, &["--config", &config.to_string_lossy()]].concat());
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{command:?}: {file}: {from} -> {to}\n{told}");
        assert!(output.stdout.is_empty(), "nothing is reported");
        for part in said.iter().copied().chain([place.as_str()]) {
            assert!(told.contains(part), "{command:?} does not say `{part}` about {file}: {from} -> {to}\n{told}");
        }
    }
}

/// As a message names it: file, line and column.
fn place(file: &str, from: &str, to: &str, at: &str) -> String {
    let text = std::fs::read_to_string(shipped().join(file)).unwrap();
    let before = text.split(from).next().unwrap().to_owned() + to.split(at).next().unwrap();
    let line = before.lines().count().max(1) + usize::from(before.ends_with('\n'));
    let column = before.rsplit('\n').next().unwrap().chars().count() + 1;
    let name = Path::new(file).file_name().unwrap().to_string_lossy();
    format!("{name}:{line}:{column}: ")
}

#[test]
fn a_configuration_with_a_mistake() {
    let file = "kittiwake.toml";
    check(file, "speed = 1.0", "speed = 1000.0", "1000", &["found speed 1000, expected a number from 0.1 to 100"]);
    check(file, "speed = 1.0", "speed = \"fast\"", "\"fast", &["invalid type: string", "expected a number"]);
    check(file, "speed = 1.0", "pace = 1.0", "pace", &["unknown field `pace`", "`speed`"]);
    check(file, "vehicle = \"uav1\"", "vehicle = \"uav/1\"", "\"uav", &["`uav/1`", "lower-case"]);
    check(file, "permissions = \"grant\"", "permissions = \"maybe\"", "\"maybe", &["`maybe`", "`grant`, `delay`"]);
    check(file, "http = \"127.0.0.1:0\"", "http = \"here\"", "\"here", &["invalid socket address"]);
    check(file, "random_denial = 0.5", "random_denial = 1.5", "1.5", &["found 1.5, expected a fraction from 0 to 1"]);
}

#[test]
fn a_configuration_that_is_not_complete() {
    for (from, to, said) in [
        ("seed = 1\n", "", "missing field `seed`"),
        ("speed = 1.0", "speed = = 1.0", "kittiwake.toml:9:9: "),
        ("mission = \"missions/reference.toml\"", "mission = \"nowhere.toml\"", "nowhere.toml: cannot be read"),
    ] {
        let config = Files::shipped().with("kittiwake.toml", from, to);
        let output = kittiwake(&["up", "--config", &config.config().to_string_lossy()]);
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(told.contains(said), "`{said}` is not said:\n{told}");
    }
}

/// To read a pipe is to wait for somebody at its other end, and a device may never end.
#[test]
fn a_file_that_is_a_pipe_or_a_device() {
    #[track_caller]
    fn check(args: &[&str], what: &str) {
        let output = Command::new("timeout").args(["60", KITTIWAKE]).args(args).stdin(Stdio::null()).output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {told}");
        assert!(told.contains(&format!("it is a {what}, not a regular file")), "{args:?}: {told}");
    }
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe").to_str().unwrap().to_owned();
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let mission = shipped().join("missions/reference.toml").to_str().unwrap().to_owned();
    for (file, what) in [(pipe.as_str(), "pipe"), ("/dev/zero", "device")] {
        for args in [
            &["up", "--config", file][..],
            &["up", "--mission", file],
            &["check", "--files-only", "--link", file],
            &["plan", file],
            &["plan", &mission, "--html", file],
            &["px4-check", "--listen-s", "0", "--params", file],
            &["replay", file],
            &["simulate", "--mission", file],
            &["mission", "validate", file],
            &["mission", "show", "--url", "http://127.0.0.1:1", "--token-file", file],
            &["mission", "show", "--url", "http://127.0.0.1:1", "--ca", file],
            &["mission", "import", file, "--out", "never-written.toml"],
            &["why", file],
            &["pictures", file, "--format", "csv"],
            &["audit", "verify", file],
        ] {
            check(args, what);
        }
    }
    let files = Files::shipped().with("kittiwake.toml", "missions/reference.toml", &pipe);
    check(&["up", "--config", files.config().to_str().unwrap()], "pipe");
}

#[test]
fn an_access_folder_without_tokens() {
    let folder = tempfile::tempdir().unwrap();
    for access in [folder.path(), &folder.path().join("absent")] {
        let access = access.to_string_lossy();
        let output = kittiwake(&["up", "--access", &access]);
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0), "{told}");
        for part in [format!("{access}/tokens.toml: "), format!("`kittiwake access {access} --secret FILE`")] {
            assert!(told.contains(&part), "`{part}` is not said:\n{told}");
        }
    }
}

#[test]
fn a_port_that_is_in_use() {
    let other = TcpListener::bind("127.0.0.1:0").unwrap();
    let http = other.local_addr().unwrap().to_string();
    let output = kittiwake(&["up", "--exit-when-done", "--json", "--http", &http]);
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0), "{told}");
    let expected = format!("the gateway cannot listen on {http}, which is in use: name another port with `--http`");
    assert_eq!(told.trim(), expected);
}

#[test]
fn a_mission_with_a_mistake() {
    let file = "missions/reference.toml";
    check(file, "flying = false", "flying = 0", "0", &["invalid type: integer", "expected a boolean"]);
    check(file, "flying = false", "fling = false", "fling", &["unknown field `fling`", "`flying`"]);
    check(file, "height_m = 0.0", "height_m = -120.0", "-120", &["`deliver` is inside the ground"]);
    check(file, "height_m = 0.0", "height_m = nan", "nan", &["expected metres between"]);
    let corners = "[[-90.0, 110.0], [90.0, 110.0], [90.0, 290.0], [-90.0, 290.0]]";
    let crossed = "[[-90.0, 110.0], [90.0, 110.0], [-90.0, 290.0], [90.0, 290.0]]";
    check(file, corners, crossed, "[[", &["`A` crosses itself"]);
    check(file, "name = \"return\"", "name = \"deliver\"", "\"deliver", &["`deliver`"]);
    let unknown = ["the control tower knows no site `wt21`", "did you mean `wt12`?"];
    check(file, "flying = false", "flying = false\nready = { site = \"wt21\" }", "\"wt21", &unknown);
}

#[test]
fn a_contingency_table_with_a_mistake() {
    let file = "contingencies.toml";
    check(
        file,
        "[\"leave_area\", \"land\"]",
        "[\"leave_aera\", \"land\"]",
        "\"leave_aera",
        &["`leave_aera`", "did you mean `leave_area`?"],
    );
    check(file, "severity = \"hold\"", "severity = \"wait\"", "\"wait", &["`wait`", "`hold`, `leave`"]);
    check(file, "clears = \"never\"", "clears = \"sometimes\"", "\"sometimes", &["`sometimes`", "`never`"]);
    check(file, "priority = 12", "priority = 10", "10", &["10"]);
    check(file, "flag = \"battery_low\"", "flag = \"battery_critical\"", "\"battery", &["battery_critical"]);
    check(file, "group = \"vehicle\"", "group = \"vehcle\"", "\"vehcle", &["unknown variant `vehcle`", "`vehicle`"]);
    check(file, "narrows = [\"slow\"]", "narrows = [\"slwo\"]", "\"slwo", &["unknown variant `slwo`", "`no-new-area`"]);
    check(
        file,
        "[\"divert\", \"land_elsewhere\"]\nemergency = \"land\"",
        "[\"divert\", \"land_elsewhere\"]\nemergency = \"return_home\"",
        "\"return_home",
        &["`energy_short` brings the vehicle down, and its emergency action `return_home` may be refused"],
    );
    let rule = "when = \"planner.silent_s >= 60 s\"\n";
    let former = "raise = { fact = \"stale\", source = \"planner\", after_s = 60.0, during = \"flying\" }\n";
    let expected = ["`raise` is the former form of a row", "write in its place: when = \"planner.silent_s >= 60 s\""];
    check(file, rule, former, "{ fact", &expected);
    let (rule, wrong) = ("\"clock.step_s > 1 s\"", "\"clock.step_s > 1 m\"");
    check(file, rule, wrong, "clock.step_s > 1 m", &["s and m are compared, expected two values of one unit"]);
    let wrong = "\"clock.stpe_s > 1 s\"";
    check(file, rule, wrong, "clock.stpe_s", &["there is no field `clock.stpe_s`", "did you mean `clock.step_s`?"]);
    check(file, "tilt_deg > 60 deg", "tilt_deg > 600 deg", "600 deg", &["600 deg is beyond the range", "0 to 180 deg"]);
}

#[test]
fn trees_with_a_mistake() {
    let file = "trees/mission.xml";
    check(file, "<Replan/>", "<Replann/>", "<Replann", &["unknown node `Replann`", "`Replan`"]);
    check(file, "<Replan/>", "<Replan speed=\"1\"/>", "speed", &["`speed`"]);
    check(file, "name=\"re-plan\"", "name=\"exec plan\"", "name=", &["two nodes are called `exec plan`"]);
    check(file, "failure_count=\"1\"", "failure_count=\"one\"", "failure_count", &["\"one\""]);
    check(file, "</Parallel>\n  </B", "\n  </B", "</B", &["not well-formed XML"]);
    check(file, "<root BTCPP_format=\"4\"", "<root BTCPP_format=\"3\"", "<root", &["BTCPP_format=\"4\""]);
}

#[test]
fn mistakes_in_several_files_are_reported_at_once() {
    let files = Files::shipped().with("missions/reference.toml", "height_m = 0.0", "height_m = -120.0").with(
        "contingencies.toml",
        "actions = [\"leave_area\", \"land\"]",
        "actions = [\"lnad\"]",
    );
    let output = kittiwake(&["run", "mcm", "--config", &files.config().to_string_lossy()]);
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{told}");
    assert!(told.contains("inside the ground") && told.contains("`lnad`"), "{told}");
}
