//! What a human got wrong is told with its place, before anything starts.

use crate::support::files::Files;
use crate::support::kittiwake;

/// Makes one mistake in the shipped files; `said` is what must be told about it.
#[track_caller]
fn check(file: &str, from: &str, to: &str, said: &[&str]) {
    let files = Files::shipped().with(file, from, to);
    let config = files.config();
    let output = kittiwake(&["up", "--exit-when-done", "--json", "--config", &config.to_string_lossy()]);
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{file}: {from} -> {to}\n{told}");
    assert!(output.stdout.is_empty(), "nothing is reported");
    for part in said {
        assert!(told.contains(part), "`{part}` is not said about {file}: {from} -> {to}\n{told}");
    }
}

#[test]
fn a_configuration_with_a_mistake() {
    let file = "kittiwake.toml";
    check(file, "speed = 1.0", "speed = 1000.0", &["kittiwake.toml:11:9:", "found speed 1000, expected", "0.1 to 100"]);
    check(file, "speed = 1.0", "speed = \"fast\"", &["kittiwake.toml:11:9:", "invalid type: string"]);
    check(file, "speed = 1.0", "pace = 1.0", &["kittiwake.toml:11:1:", "unknown field `pace`", "`speed`"]);
    check(file, "seed = 1\n", "", &["missing field `seed`"]);
    check(file, "vehicle = \"uav1\"", "vehicle = \"uav/1\"", &["kittiwake.toml:7:11:", "lower-case"]);
    check(file, "permissions = \"grant\"", "permissions = \"maybe\"", &["`maybe`", "`grant`, `delay`"]);
    check(file, "http = \"127.0.0.1:0\"", "http = \"here\"", &["invalid socket address"]);
    check(file, "speed = 1.0", "speed = 1.0 0", &["kittiwake.toml:11:"]);
    check(
        file,
        "mission = \"missions/reference.toml\"",
        "mission = \"nowhere.toml\"",
        &["nowhere.toml", "cannot be read"],
    );
}

#[test]
fn a_mission_with_a_mistake() {
    let file = "missions/reference.toml";
    check(file, "flying = false", "", &["reference.toml:", "missing field `flying`"]);
    check(file, "flying = false", "fling = false", &["unknown field `fling`"]);
    check(file, "height_m = 0.0", "height_m = -3.0", &["reference.toml:18:12:", "inside the ground"]);
    check(file, "height_m = 0.0", "height_m = nan", &["reference.toml:18:12:", "expected metres between"]);
    check(file, "[90.0, 290.0], [-90.0, 290.0]", "[-90.0, 290.0], [90.0, 290.0]", &["`A` crosses itself"]);
    check(file, "name = \"return\"", "name = \"deliver\"", &["reference.toml:22:", "deliver"]);
}

#[test]
fn a_contingency_table_with_a_mistake() {
    let file = "contingencies.toml";
    check(
        file,
        "actions = [\"land\"]",
        "actions = [\"lnad\"]",
        &["contingencies.toml:", "`lnad`", "did you mean `land`?"],
    );
    check(file, "threshold = 0.10", "threshold = 10.0", &["contingencies.toml:"]);
    check(file, "priority = 12", "priority = 10", &["contingencies.toml:", "priority"]);
    check(file, "flag = \"battery_low\"", "flag = \"battery_critical\"", &["contingencies.toml:", "battery_critical"]);
    check(file, "clears = \"never\"", "clears = \"sometimes\"", &["contingencies.toml:", "sometimes"]);
}

#[test]
fn trees_with_a_mistake() {
    let file = "trees/mission.xml";
    check(file, "<ReactiveFallback", "<ReactivFallback", &["mission.xml:", "ReactivFallback"]);
    check(file, "</root>", "", &["mission.xml:"]);
    check(file, "BTCPP_format=\"4\"", "BTCPP_format=\"3\"", &["mission.xml:"]);
}

#[test]
fn mistakes_in_several_files_are_told_at_once() {
    let files = Files::shipped().with("missions/reference.toml", "height_m = 0.0", "height_m = -1.0").with(
        "contingencies.toml",
        "actions = [\"land\"]",
        "actions = [\"lnad\"]",
    );
    let output = kittiwake(&["mcm", "--config", &files.config().to_string_lossy()]);
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{told}");
    assert!(told.contains("inside the ground") && told.contains("`lnad`"), "{told}");
}
