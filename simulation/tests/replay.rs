//! Recorded flights are replayed, decision by decision; those in `tests/flights/` are. A recording that is copied there is a test.
//!
//! They are flights of the configuration in them, so they stay what they were when the shipped one changes. Where a change of the
//! program is meant to change a decision, or a section of the configuration has another key, `KITTIWAKE_WRITE_FLIGHTS=1` flies and
//! records those that are made here again; others are recorded again by hand.

use std::path::{Path, PathBuf};
use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::Decision;
use simulation::chaos::fly::fly_recorded;
use simulation::chaos::script::{Choice, Script};
use simulation::chaos::trouble::Trouble;
use simulation::recording::file::{Writer, read};
use simulation::recording::replay::replay;
use simulation::recording::{Entry, Header};
use simulation::{Machine, Memory};

/// As seldom as the services allow, so that the files are small.
const RATES: [(&str, &str); 8] = [
    ("vehicle_attitude = 240.0", "vehicle_attitude = 10.0"),
    ("vehicle_local_position = 123.0", "vehicle_local_position = 10.0"),
    ("vehicle_global_position = 123.0", "vehicle_global_position = 2.0"),
    ("battery_status = 99.0", "battery_status = 4.0"),
    ("introspection_rate_hz = 100.0", "introspection_rate_hz = 5.0"),
    ("setpoint_rate_hz = 20.0", "setpoint_rate_hz = 5.0"),
    ("feedback_rate_hz = 10.0", "feedback_rate_hz = 1.0"),
    ("tick_period_ms = 10.0", "tick_period_ms = 200.0"),
];
const MISSION: &str = "name = \"short\"
[[objective]]\nname = \"there\"\nnorth_m = 0\neast_m = 130\nheight_m = 0\nflying = false
[[objective]]\nname = \"back\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false
[[area]]\nname = \"gate\"\nkind = \"permission\"\ncorners_m = [[-40, 50], [40, 50], [40, 90], [-40, 90]]\n";

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The shipped configuration with those rates, in a folder of its own.
fn seldom(folder: &Path) -> PathBuf {
    let config = repository().join("config");
    let read = |name: &str| std::fs::read_to_string(config.join(name)).unwrap();
    let text = RATES.iter().fold(read("kittiwake.toml"), |text, (from, to)| {
        assert!(text.contains(from), "`{from}` is not in the configuration");
        text.replacen(from, to, 1)
    });
    std::fs::create_dir_all(folder.join("trees")).unwrap();
    std::fs::create_dir_all(folder.join("missions")).unwrap();
    std::fs::write(folder.join("kittiwake.toml"), text).unwrap();
    std::fs::create_dir_all(folder.join("skills")).unwrap();
    for name in [
        "contingencies.toml",
        "missions/reference.toml",
        "trees/mission.xml",
        "trees/step.xml",
        "trees/actions.xml",
        "skills/winch_down.toml",
    ] {
        std::fs::write(folder.join(name), read(name)).unwrap();
    }
    folder.to_owned()
}

/// The flights that are recorded here: an obstacle and a low battery inside an area, an area that is closed on the way, and both
/// recorded processes killed.
fn scripts() -> [(&'static str, Script); 3] {
    let seconds = Duration::from_secs;
    let mission = || Choice::Drawn(MISSION.to_owned());
    let script = |seed, troubles| Script::new(seed, mission(), Policy::Grant, Machine::Ideal, troubles);
    let kill = |at_s, process: &str| {
        let time = Duration::from_millis(300);
        (seconds(at_s), Trouble::Kill { process: process.to_owned(), time, memory: Memory::Restored })
    };
    let battery = Trouble::Fault { name: "battery".into(), args: vec!["0.2".into()] };
    let revoked = Trouble::Decide { area: "gate".into(), decision: Decision::Revoke, valid_for_s: None };
    let granted = Trouble::Decide { area: "gate".into(), decision: Decision::Grant, valid_for_s: None };
    [
        (
            "battery_low_behind_an_obstacle",
            script(7, vec![(seconds(14), Trouble::Flag("obstacle".into())), (seconds(18), battery)]),
        ),
        ("area_closed_on_the_way", script(8, vec![(seconds(17), revoked), (seconds(40), granted)])),
        ("planner_and_manager_killed", script(9, vec![kill(14, "planner"), kill(18, "mcm"), kill(40, "mcm")])),
    ]
}

fn write(path: &Path, header: &Header, entries: &[Entry]) {
    let mut writer = Writer::begin(std::fs::File::create(path).unwrap(), header).unwrap();
    entries.iter().for_each(|it| writer.write(it).unwrap());
    writer.end().unwrap();
}

fn temporary(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("kittiwake-replay-test-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

#[test]
fn every_recorded_flight_is_decided_as_it_was() {
    let flights = repository().join("tests/flights");
    if std::env::var_os("KITTIWAKE_WRITE_FLIGHTS").is_some() {
        let folder = temporary("write");
        for (name, script) in scripts() {
            let (flight, header, entries) = fly_recorded(&script, &seldom(&folder)).unwrap();
            assert_eq!(flight.findings, [], "{name}");
            write(&flights.join(name).with_extension("inputs"), &header, &entries);
        }
        std::fs::remove_dir_all(folder).unwrap();
    }
    let mut replayed = 0;
    for entry in std::fs::read_dir(&flights).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|it| it == "inputs") {
            let found = replay(&path).unwrap_or_else(|refusal| panic!("{refusal}"));
            assert_eq!(found.difference.as_ref().map(ToString::to_string), None, "{}", path.display());
            assert!(20 < found.same, "{}: hardly anything was decided", path.display());
            replayed += 1;
        }
    }
    assert!(2 <= replayed, "{replayed} flights in {}", flights.display());
}

#[test]
fn a_recording_is_replayed_and_one_that_was_changed_cut_off_or_is_foreign_is_told() {
    let folder = temporary("changed");
    let (_, script) = scripts().into_iter().next().unwrap();
    let (_, header, entries) = fly_recorded(&script, &seldom(&folder)).unwrap();
    let path = folder.join("flight.inputs");
    write(&path, &header, &entries);
    let (read_header, read_entries) = read(&path).unwrap();
    assert_eq!((&read_header, &read_entries), (&header, &entries), "it survives the file");
    assert_eq!(replay(&path).unwrap().difference, None);

    // Another decision than the one that was made.
    let mut changed = entries.clone();
    let at = changed.iter().position(|it| matches!(it, Entry::Did { what, .. } if what.contains("obstacle"))).unwrap();
    changed[at] = Entry::Did { node: 0, what: "decides contingency: to go on".into() };
    write(&path, &header, &changed);
    let difference = replay(&path).unwrap().difference.unwrap();
    assert_eq!(difference.recorded.as_deref(), Some("decides contingency: to go on"));
    assert!(difference.replayed.as_ref().is_some_and(|it| it.contains("obstacle")), "{difference}");
    // An event that was not given.
    let mut without = entries.clone();
    let is_listed = |it: &Entry| format!("{it:?}").contains("name: \"obstacle\"");
    without.retain(|it| !is_listed(it));
    write(&path, &header, &without);
    assert!(replay(&path).unwrap().difference.is_some());

    #[track_caller]
    fn refused(path: &Path, bytes: &[u8], expected: &str) {
        std::fs::write(path, bytes).unwrap();
        let told = replay(path).unwrap_err().to_string();
        assert!(told.contains(expected) && told.contains("flight.inputs"), "{told}");
    }
    write(&path, &header, &entries);
    let whole = std::fs::read(&path).unwrap();
    refused(&path, &whole[..whole.len() / 2], "it is cut off after entry ");
    refused(&path, &whole[..whole.len() - 16], "it is cut off");
    refused(&path, &whole[..40], "it is cut off in its header");
    refused(&path, b"\x89MCAP0\r\n", "no recording of inputs");
    refused(&path, b"", "no recording of inputs");
    let other =
        [b"kittiwake-inputs 1\n".as_slice(), &whole[whole.iter().position(|it| *it == b'\n').unwrap() + 1..]].concat();
    refused(&path, &other, "a recording of format 1, expected 3");
    std::fs::remove_dir_all(folder).unwrap();
}
