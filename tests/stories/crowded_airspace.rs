//! Missions as large as a harbour, and files that are larger than any mission.

use std::time::{Duration, Instant};

use crate::support::files::Files;
use crate::support::{System, kittiwake};

/// How long a file that is refused by its size may take on a busy machine.
const AT_ONCE: Duration = Duration::from_secs(10);

/// This many of twelve corners and 40 m about their middles, which stand 120 m apart in rows of 32; each fifth needs a permission.
/// The 17th row lies on the straight way of [`MISSION`].
fn areas(count: usize) -> String {
    let area = |number: usize| {
        let (north_m, east_m) = (120.0 * (number / 32) as f64 - 1_920.0, 120.0 * (number % 32) as f64 + 60.0);
        let corner = |index: u32| {
            let (east, north) = (std::f64::consts::TAU * f64::from(index) / 12.0).sin_cos();
            format!("[{:.1}, {:.1}]", north_m + 40.0 * north, east_m + 40.0 * east)
        };
        let corners = (0..12).map(corner).collect::<Vec<_>>().join(", ");
        let kind = if number.is_multiple_of(5) { "permission" } else { "keep-out" };
        format!("[[area]]\nname = \"zone {number}\"\nkind = \"{kind}\"\ncorners_m = [{corners}]\n")
    };
    (0..count).map(area).collect()
}

/// To a berth between two areas, and home.
const MISSION: &str = "\
name = \"harbour\"
[[objective]]
name = \"berth\"
north_m = 0.0
east_m = 1200.0
height_m = 0.0
flying = false
[[objective]]
name = \"home\"
north_m = 0.0
east_m = 0.0
height_m = 0.0
flying = false
";

#[test]
fn a_mission_among_a_thousand_areas_is_flown() {
    let files = Files::shipped().flying(&format!("{MISSION}{}", areas(1_000)));
    let config = files.config();
    let config = config.to_str().expect("a readable path");
    let ending = System::start(&["--config", config, "--speed", "5"]).end();
    ending.expect(0, &["SUCCESS", "SUCCESS"]);
    let round = ending.story("step").into_iter().filter(|it| it.contains("fly to")).count();
    assert!(2 < round, "round the areas, not straight; it said:\n{}", ending.lines.join("\n"));
}

#[test]
fn a_mission_of_too_many_areas_is_refused() {
    let files = Files::shipped().flying(&format!("{MISSION}{}", areas(2_001)));
    let output = kittiwake(&["check", "--config", &files.config().to_string_lossy()]);
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{told:.1000}");
    assert!(told.contains("the mission has 2001 areas, at most 2000 are allowed"), "{told:.1000}");
}

#[test]
fn a_file_of_fifty_megabytes_is_refused_at_once() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let file = folder.path().join("large.toml");
    // A hole, which takes no room on the disk.
    std::fs::File::create(&file).and_then(|it| it.set_len(51 << 20)).expect("the file can be made");
    let out = folder.path().join("out.toml");
    let (file, out) = (file.to_string_lossy(), out.to_string_lossy());
    let too_large = "the file has 51 MiB; at most 32 MiB are read";
    for (command, expected) in [
        (&["check", "--mission", &file][..], too_large),
        (&["up", "--exit-when-done", "--mission", &file], too_large),
        (&["plan", &file], too_large),
        // A data set may have as much, but is not empty.
        (&["mission", "import", &file, "--out", &out], "this is a binary file of an unknown kind, which is not read"),
        (&["mission", "export", &file, "--format", "geojson"], too_large),
    ] {
        let began = Instant::now();
        let output = kittiwake(command);
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{command:?}: {told}");
        assert!(told.contains(&format!("large.toml: {expected}")), "{command:?}: {told}");
        assert!(began.elapsed() < AT_ONCE, "{command:?} took {:?}", began.elapsed());
    }
}
