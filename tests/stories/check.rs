//! `kittiwake check`: the files are read as `up` and the routers read them, nothing is started, and the table is proved in flights.
//! What it says about mistakes in the files is in `bad_input`.

use crate::support::files::Files;
use crate::support::{kittiwake, shipped};

/// What `kittiwake check` prints about `files`, and its exit code.
fn check(files: &Files, args: &[&str]) -> (Option<i32>, String, String) {
    let config = files.config();
    let output = kittiwake(&[&["check", "--config", &config.to_string_lossy()], args].concat());
    let text = |bytes| String::from_utf8(bytes).expect("it prints UTF-8");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[test]
fn each_file_that_was_read_is_named() {
    let files = Files::shipped();
    let folder = files.config().parent().expect("it lies in a folder").to_string_lossy().into_owned();
    let (code, said, complaints) = check(&files, &["--files-only"]);
    assert_eq!((code, complaints.as_str()), (Some(0), ""), "{said}");
    let rows = std::fs::read_to_string(shipped().join("contingencies.toml")).unwrap().matches("\nflag = ").count();
    let skills = std::fs::read_dir(shipped().join("skills")).unwrap().count();
    let expected = [
        "kittiwake.toml: vehicle uav1".to_owned(),
        "missions/reference.toml: mission reference, objectives: 2, areas: 2".to_owned(),
        "trees: the mission's tree, a step's and those of the actions".to_owned(),
        format!("contingencies.toml: contingencies: {rows}"),
        format!("skills: declared skills: {skills}"),
        "zenoh/link.toml: the link to ground-router".to_owned(),
    ];
    let expected: Vec<_> = expected.iter().map(|line| format!("ok: {folder}/{line}")).collect();
    assert_eq!(said.lines().collect::<Vec<_>>(), expected);
}

#[test]
fn another_mission_is_checked_in_place_of_the_configured_one() {
    let (files, harbour) = (Files::shipped(), shipped().join("missions/harbour.toml"));
    let (code, said, _) = check(&files, &["--files-only", "--mission", &harbour.to_string_lossy()]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("harbour.toml: mission harbour") && !said.contains("reference.toml"), "{said}");
}

#[test]
fn a_place_that_wind_brings_too_near_to_a_border_is_told_and_no_mistake() {
    let files = Files::shipped().with("missions/reference.toml", "east_m = 500.0", "east_m = 575.0");
    let (code, said, complaints) = check(&files, &["--files-only"]);
    assert_eq!((code, complaints.as_str()), (Some(0), ""), "{said}");
    let told = "reference.toml: objective `deliver` lies 15.0 m from the border of area `B`: less than the 18 m that";
    assert!(said.lines().any(|line| line.starts_with("note: ") && line.contains(told)), "{said}");
}

#[test]
fn mistakes_in_the_link_table_are_told_together_with_those_in_other_files() {
    let files = Files::shipped().with("zenoh/link.toml", "direction = \"down\"", "direction = \"sideways\"").with(
        "missions/reference.toml",
        "height_m = 0.0",
        "height_m = -120.0",
    );
    let (code, said, complaints) = check(&files, &["--files-only"]);
    assert_eq!((code, said.as_str()), (Some(2), ""));
    for part in ["link.toml:", "`sideways`", "reference.toml:", "inside the ground"] {
        assert!(complaints.contains(part), "`{part}` is not said:\n{complaints}");
    }
}

#[test]
fn a_link_table_need_not_be_there_unless_it_is_named() {
    let files = Files::shipped();
    let table = files.config().with_file_name("zenoh/link.toml");
    std::fs::remove_file(&table).unwrap();
    let (code, said, _) = check(&files, &["--files-only"]);
    assert!(code == Some(0) && !said.contains("link.toml"), "{said}");
    let (code, _, complaints) = check(&files, &["--link", &table.to_string_lossy()]);
    assert!(code == Some(2) && complaints.contains("link.toml: cannot be read"), "{complaints}");
}

#[test]
fn the_printed_contingencies_have_a_line_for_each_row() {
    let files = Files::shipped().with("contingencies.toml", "flag = \"obstacle\"", "flag = \"bird_strike\"");
    let rows = std::fs::read_to_string(shipped().join("contingencies.toml")).unwrap().matches("\nflag = ").count();
    let (code, said, complaints) = check(&files, &["--print-contingencies"]);
    assert_eq!((code, complaints.as_str()), (Some(0), ""), "{said}");
    // Then an empty line, and the order of the ten severities.
    assert_eq!(said.lines().count(), 2 + rows + 1 + 2 + 10, "{said}");
    assert!(said.starts_with("| flag | group | label | alarm | raised by |"), "{said}");
    assert!(said.contains("| divert | flies to the best place that can be reached and lands |"), "{said}");
    assert!(said.contains("| `bird_strike` | mission | safety | caution |") && !said.contains("`obstacle`"), "{said}");
    assert!(said.contains("`not known(wind.speed_m_s) or wind.speed_m_s < 9 m/s`"), "{said}");
}

#[test]
fn the_printed_tree_is_the_one_that_the_table_becomes() {
    let files = Files::shipped().with("contingencies.toml", "flag = \"obstacle\"", "flag = \"bird_strike\"");
    let (code, tree, complaints) = check(&files, &["--print-tree"]);
    assert_eq!((code, complaints.as_str()), (Some(0), ""), "{tree}");
    assert!(tree.starts_with("<?xml") && tree.contains("<root BTCPP_format=\"4\">"), "{tree}");
    assert!(tree.trim_end().ends_with("</root>"), "{tree}");
    assert!(
        tree.contains("\"bird_strike\"") && !tree.contains("\"obstacle\""),
        "a row's flag is a node's input:\n{tree}"
    );
    // An action is a subtree in the place that the row gives it.
    assert!(tree.contains("<BehaviorTree ID=\"contingencies\">") && tree.contains("\"return_home\""), "{tree}");
}

#[test]
fn the_shipped_table_is_proved_and_its_pairs_are_drawn() {
    let (files, folder) = (Files::shipped(), tempfile::tempdir().expect("a temporary folder can be made"));
    let picture = folder.path().join("pairs.svg");
    let (code, said, complaints) = check(&files, &["--quick", "--html", &picture.to_string_lossy()]);
    // On a crowded machine it says once a minute how far it is.
    let complains = complaints.lines().any(|it| !it.ends_with(" flights"));
    assert_eq!((code, complains), (Some(0), false), "{said}{complaints}");
    for part in [
        "pairs (line: first flag; column: second)",
        " 0 faults of rows or hazards without an answer",
        "waived: battery-voltage-low (battery.voltage_v 16.00 V) ",
        " 0 answered against the order",
        ", 0 with a breach; with faults: ",
    ] {
        assert!(said.contains(part), "`{part}` is not said:\n{said}");
    }
    // The mission's part: each leg with its energy, and the areas on the way.
    assert!(said.contains("deliver") && said.contains(" Wh"), "{said}");
    let drawn = std::fs::read_to_string(&picture).expect("the picture is written");
    let rows = std::fs::read_to_string(shipped().join("contingencies.toml")).unwrap().matches("\nflag = ").count();
    assert!(drawn.starts_with("<svg") && rows * rows == drawn.matches("h-11z").count(), "a square for each pair");
}

/// The shipped files with `from` replaced by `to` in the row of `flag`.
#[track_caller]
fn row_with(files: Files, flag: &str, from: &str, to: &str) -> Files {
    let text =
        std::fs::read_to_string(files.config().with_file_name("contingencies.toml")).expect("the table is there");
    let rows: Vec<&str> = text.split("[[contingency]]").collect();
    let row = rows.iter().find(|it| it.contains(&format!("\nflag = \"{flag}\"\n"))).expect("there is such a row");
    assert!(row.contains(from), "`{from}` is not in the row of {flag}");
    files.with("contingencies.toml", row, &row.replacen(from, to, 1))
}

#[test]
fn each_of_twenty_changed_tables_and_trees_is_refused_and_the_place_is_said() {
    let row = |flag: &str, from: &str, to: &str| row_with(Files::shipped(), flag, from, to);
    let tree = |from: &str, to: &str| Files::shipped().with("trees/actions.xml", from, to);
    let twin = "emergency = \"stop\"\nclears = \"with-condition\"\nthen = \"resume\"\n\n[[contingency]]\nflag = \"battery_quiet\"\n\
                priority = 300\nwhen = \"battery.silent_s >= 2 s\"\n\
                actions = [\"stop\", \"hold_position\"]\nemergency = \"stop\"\nclears = \"with-condition\"\n";
    let lands = "<BehaviorTree ID=\"land_now\">\n    <Land/>";
    let returns = "<FlyHome/>\n      <Land/>";
    let mutations: [(Files, i32, &str); 21] = [
        (row("battery_low", "actions = [\"divert\", \"land_elsewhere\"]\n", ""), 2, "missing field `actions`"),
        (row("obstacle", "emergency = \"stop\"\n", ""), 2, "missing field `emergency`"),
        (row("link_lost", "clears = \"with-condition\"\n", ""), 2, "missing field `clears`"),
        (
            row("battery_stale", "emergency = \"stop\"\nclears = \"with-condition\"\n", twin),
            1,
            "`battery_quiet` and `battery_stale` are alike",
        ),
        (row("obstacle", "flag = \"obstacle\"", "flag = \"link_lost\""), 2, "two rows for the flag `link_lost`"),
        (row("obstacle", "priority = 70", "priority = 60"), 2, "priority 60 is already that of"),
        (
            row("local_position_stale", "actions = [\"stop\"]", "actions = [\"hold_position\"]"),
            1,
            "its action `hold_position` needs it",
        ),
        (
            row("obstacle", "clears = \"after-action\"", "clears = \"never\""),
            1,
            "`obstacle` holds, and its flag falls on the ground alone",
        ),
        (row("battery_low", "for_s = 1.0", "for_s = 0.0"), 1, "`battery_low` is raised by the first sample"),
        (row("battery_low", "percent >= 30 %", "percent >= 10 %"), 2, "this rule would clear while it still holds"),
        (row("obstacle", "actions = [\"stop\"", "actions = [\"stopp\""), 2, "there is no action `stopp`"),
        (row("link_lost", "\"cruise\"", "\"cruising\""), 2, "unknown variant `cruising`"),
        (row("wind_high", "> 10 m/s", "> 10 degC"), 2, "contingencies.toml:"),
        (row("battery_emergency", "< 5 %", "< 500 %"), 2, "contingencies.toml:"),
        (
            row("transition_failed", "flag = \"transition_failed\"", "flag = \"failed\""),
            2,
            "no row for the flag `transition_failed`",
        ),
        (
            row("ended_in_air", "emergency = \"land\"", "emergency = \"stop\""),
            2,
            "`ended_in_air` brings the vehicle down",
        ),
        (row("operator_abort", "then = \"end-mission\"", "then = \"resume\""), 2, "and the mission would continue"),
        (
            row(
                "wind_too_strong",
                "phases = [\"takeoff\", \"cruise\", \"waiting\", \"inside-area\"]",
                "phases = [\"on-ground\"]",
            ),
            1,
            "raised while flying, and counts on the ground alone",
        ),
        (
            tree("<BehaviorTree ID=\"stop\">\n    <Stop/>", "<BehaviorTree ID=\"stop\">\n    <Land/>"),
            1,
            "holds by the table, and the vehicle has come down",
        ),
        (tree(lands, &lands.replace("<Land/>", "<Stop/>")), 1, "is to come down, and the vehicle is in the air"),
        (tree(returns, "<FlyHome/>"), 1, "is to come down, and the vehicle is in the air"),
    ];
    for (files, expected, told) in mutations {
        let (code, said, complaints) = check(&files, &["--quick"]);
        assert_eq!(code, Some(expected), "{told}: {said}{complaints}");
        assert!(complaints.contains(told), "`{told}` is not said:\n{complaints:.3000}");
        let place =
            if expected == 2 || said.contains("flights: 0") { "contingencies.toml:" } else { "contingencies.toml: `" };
        assert!(complaints.contains(place), "{told}: no place is said:\n{complaints:.3000}");
    }
}
