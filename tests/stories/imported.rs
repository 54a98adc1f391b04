//! A plan of another program, from `kittiwake mission import` over `check` to the end of `up`.

use std::path::Path;

use crate::support::files::Files;
use crate::support::{System, kittiwake};

/// A plan of QGroundControl, far from where the simulated vehicle is configured to stand: a look at a place on the other side of the
/// antimeridian, and back.
const REEF: &str = r#"{"fileType": "Plan", "mission": {"plannedHomePosition": [-16.5, 179.998, 5], "items": [
    {"type": "SimpleItem", "command": 22, "frame": 3, "params": [0, 0, 0, null, -16.5, 179.998, 20]},
    {"type": "SimpleItem", "command": 16, "frame": 3, "params": [0, 0, 0, null, -16.499, -179.998, 20]},
    {"type": "SimpleItem", "command": 20, "frame": 3, "params": [0, 0, 0, null, 0, 0, 0]}
]}}"#;

/// The mission file that the import makes.
#[track_caller]
fn imported(folder: &Path) -> String {
    let path = |name: &str| folder.join(name).to_str().expect("a readable path").to_owned();
    let (plan, mission) = (path("reef.plan"), path("reef.toml"));
    std::fs::write(&plan, REEF).expect("the file can be written");
    let output = kittiwake(&["mission", "import", &plan, "--out", &mission]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    mission
}

#[test]
fn an_imported_mission_is_flown_where_it_belongs() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let mission = imported(folder.path());
    let ending = System::start(&["--mission", &mission]).end();
    ending.expect(0, &["SUCCESS", "SUCCESS"]);
    ending.expect_in_order(&["fly to (111, 427, 20)", "fly to (0, 0, 10)"]);
}

#[test]
fn a_vehicle_that_is_to_stand_elsewhere_is_told_before_anything_starts() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let mission = imported(folder.path());
    let files = Files::shipped().with("kittiwake.toml", "at_mission_origin = true", "at_mission_origin = false");
    let config = files.config().to_str().expect("a readable path").to_owned();
    for command in ["check", "up"] {
        let output = kittiwake(&[command, "--config", &config, "--mission", &mission]);
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{command}: {told}");
        for part in ["reef.toml: its origin lies ", "expected at most 5 m", "`at_mission_origin = true`"] {
            assert!(told.contains(part), "{command}: `{part}` is not said:\n{told}");
        }
    }
}
