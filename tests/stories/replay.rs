//! `kittiwake replay`: what was recorded, in a simulated flight or by the processes of a real one, is decided again as it was.

use crate::support::files::Files;
use crate::support::{System, kittiwake, shipped};

/// Replays a file: exit code, and what is said.
fn replay(file: &std::path::Path) -> (Option<i32>, String) {
    let output = kittiwake(&["replay", &file.to_string_lossy()]);
    let said = [output.stdout, output.stderr].map(|it| String::from_utf8_lossy(&it).into_owned()).concat();
    (output.status.code(), said)
}

#[test]
fn a_recorded_seed_is_replayed_and_half_a_recording_is_told() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let (file, config) = (folder.path().join("flight.inputs"), shipped().join("kittiwake.toml"));
    let (told, config) = (file.to_string_lossy(), config.to_string_lossy());
    let flown = kittiwake(&["simulate", "--config", &config, "--flag", "obstacle@20", "--record", &told]);
    assert_eq!(flown.status.code(), Some(0), "{}", String::from_utf8_lossy(&flown.stderr));
    let (code, said) = replay(&file);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains(" decisions, calls and answers, all the same"), "{said}");
    let whole = std::fs::read(&file).expect("it was written");
    std::fs::write(&file, &whole[..whole.len() / 2]).expect("it can be written");
    let (code, said) = replay(&file);
    assert!(code == Some(2) && said.contains("it is cut off after entry "), "{said}");
}

#[test]
fn what_the_processes_of_a_flight_were_given_is_decided_again_as_it_was() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let files = Files::shipped().flying(
        "name = \"hop\"\n[[objective]]\nname = \"there\"\nnorth_m = 0\neast_m = 40\nheight_m = 0\nflying = false\n",
    );
    let (config, into) = (files.config(), folder.path().to_string_lossy().into_owned());
    let config = config.to_string_lossy();
    System::start(&["--config", &config, "--record-inputs", &into]).end().expect(0, &["SUCCESS"]);
    let recorded: Vec<_> =
        std::fs::read_dir(folder.path()).expect("it is made").map(|it| it.expect("a file").path()).collect();
    for service in ["mcm", "planner"] {
        let is_of = |it: &&std::path::PathBuf| it.to_string_lossy().contains(&format!("uav1-{service}-"));
        let file = recorded.iter().find(is_of).unwrap_or_else(|| panic!("no recording of {service} in {recorded:?}"));
        let (code, said) = replay(file);
        assert_eq!(code, Some(0), "{service}: {said}");
    }
}
