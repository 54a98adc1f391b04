//! What the stories of whole flights share.

#![expect(unreachable_pub, reason = "no other crate uses a test: here `pub` means outside of the module")]

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use control_tower::policy::Policy;
use simulation::{Machine, Setup, Simulation};

pub mod story;

/// The shipped configuration.
pub fn config() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../config")
}

/// A copy of the shipped configuration in which keys of `kittiwake.toml` have other values.
#[track_caller]
pub fn config_with(name: &str, changes: &[(&str, &str)]) -> PathBuf {
    let (shipped, copy) = (config(), own_path(name));
    std::fs::create_dir_all(copy.join("trees")).unwrap();
    for file in std::fs::read_dir(shipped.join("trees")).unwrap() {
        let path = file.unwrap().path();
        std::fs::copy(&path, copy.join("trees").join(path.file_name().unwrap())).unwrap();
    }
    std::fs::copy(shipped.join("contingencies.toml"), copy.join("contingencies.toml")).unwrap();
    let mut text = std::fs::read_to_string(shipped.join("kittiwake.toml")).unwrap();
    for (key, value) in changes {
        let line = text.lines().find(|it| it.starts_with(&format!("{key} = "))).expect(key).to_owned();
        text = text.replacen(&line, &format!("{key} = {value}"), 1);
    }
    std::fs::write(copy.join("kittiwake.toml"), text).unwrap();
    copy
}

/// A copy of the shipped configuration with these rows after those of the contingency table.
#[track_caller]
pub fn config_with_rows(name: &str, rows: &str) -> PathBuf {
    let copy = config_with(name, &[]);
    let table = copy.join("contingencies.toml");
    let text = std::fs::read_to_string(&table).unwrap();
    std::fs::write(&table, format!("{text}\n{rows}")).unwrap();
    copy
}

/// A path that no other test uses.
fn own_path(name: &str) -> PathBuf {
    static NUMBER: AtomicUsize = AtomicUsize::new(0);
    let number = NUMBER.fetch_add(1, Ordering::Relaxed);
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{number}"))
}

/// A mission of this text, in a file of its own.
pub fn mission_file(name: &str, text: &str) -> PathBuf {
    let path = own_path(name).with_extension("toml");
    std::fs::write(&path, text).unwrap();
    path
}

/// The shipped system with this mission, the reference mission if there is none.
#[track_caller]
pub fn simulation(mission: Option<&Path>, permissions: Policy) -> Simulation<'static> {
    simulation_of(&config(), mission, permissions)
}

/// The system of this configuration with this mission, the configured one if there is none.
#[track_caller]
pub fn simulation_of(config: &Path, mission: Option<&Path>, permissions: Policy) -> Simulation<'static> {
    let setup = Setup { config, mission, permissions, seed: 1, machine: Machine::Ideal };
    Simulation::new(&setup).unwrap_or_else(|mistakes| panic!("{mistakes}"))
}

/// The seeds that `KITTIWAKE_SEEDS` asks for, a number of them or a range, or else the first `few`.
#[track_caller]
pub(crate) fn seeds(few: u64) -> std::ops::Range<u64> {
    fn range(asked: &str) -> Option<std::ops::Range<u64>> {
        let (from, to) = asked.split_once("..").unwrap_or(("0", asked));
        Some(from.parse().ok()?..to.parse().ok()?)
    }
    let Ok(asked) = std::env::var("KITTIWAKE_SEEDS") else { return 0..few };
    range(&asked).expect("KITTIWAKE_SEEDS is a number of seeds, or a range of them such as 798..799")
}
