//! `kittiwake check`: the files are read as `up` and the routers read them, and nothing is started. What it says about
//! mistakes in them is in `bad_input`.

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
    let (code, said, complaints) = check(&files, &[]);
    assert_eq!((code, complaints.as_str()), (Some(0), ""), "{said}");
    let rows = std::fs::read_to_string(shipped().join("contingencies.toml")).unwrap().matches("\nflag = ").count();
    let expected = [
        "kittiwake.toml: vehicle uav1".to_owned(),
        "missions/reference.toml: mission reference, objectives: 2, areas: 2".to_owned(),
        "trees: the mission's tree, a step's and those of the actions".to_owned(),
        format!("contingencies.toml: contingencies: {rows}"),
        "zenoh/link.toml: the link to ground-router".to_owned(),
    ];
    let expected: Vec<_> = expected.iter().map(|line| format!("ok: {folder}/{line}")).collect();
    assert_eq!(said.lines().collect::<Vec<_>>(), expected);
}

#[test]
fn another_mission_is_checked_in_place_of_the_configured_one() {
    let (files, harbour) = (Files::shipped(), shipped().join("missions/harbour.toml"));
    let (code, said, _) = check(&files, &["--mission", &harbour.to_string_lossy()]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("harbour.toml: mission harbour") && !said.contains("reference.toml"), "{said}");
}

#[test]
fn a_place_that_wind_brings_too_near_to_a_border_is_told_and_no_mistake() {
    let files = Files::shipped().with("missions/reference.toml", "east_m = 500.0", "east_m = 575.0");
    let (code, said, complaints) = check(&files, &[]);
    assert_eq!((code, complaints.as_str()), (Some(0), ""), "{said}");
    let told = "reference.toml: objective `deliver` lies 15.0 m from the border of area `B`: less than the 18 m that";
    assert!(said.lines().any(|line| line.starts_with("note: ") && line.contains(told)), "{said}");
}

#[test]
fn mistakes_in_the_link_table_are_told_together_with_those_in_other_files() {
    let files = Files::shipped().with("zenoh/link.toml", "direction = \"down\"", "direction = \"sideways\"").with(
        "missions/reference.toml",
        "height_m = 0.0",
        "height_m = -1.0",
    );
    let (code, said, complaints) = check(&files, &[]);
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
    let (code, said, _) = check(&files, &[]);
    assert!(code == Some(0) && !said.contains("link.toml"), "{said}");
    let (code, _, complaints) = check(&files, &["--link", &table.to_string_lossy()]);
    assert!(code == Some(2) && complaints.contains("link.toml: cannot be read"), "{complaints}");
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
