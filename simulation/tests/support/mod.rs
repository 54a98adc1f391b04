//! What the stories of whole flights share.

#![expect(unreachable_pub, reason = "no other crate uses a test: here `pub` means outside of the module")]

use std::hash::{BuildHasher as _, DefaultHasher, Hash as _, Hasher as _, RandomState};
use std::panic::Location;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use control_tower::policy::Policy;
use simulation::{Machine, Setup, Simulation};

pub mod story;

/// The rates at which a flight costs half as much. Rules ask for times and limits, not for a number of messages.
const RATES: [(&str, &str); 5] = [
    ("vehicle_attitude", "40.0"),
    ("vehicle_local_position", "40.0"),
    ("vehicle_global_position", "5.0"),
    ("battery_status", "5.0"),
    ("introspection_rate_hz", "25.0"),
];

/// The shipped configuration at [`RATES`]. `KITTIWAKE_SWEEP=all` flies at the shipped rates.
pub fn config() -> PathBuf {
    static SLOWER: LazyLock<PathBuf> = LazyLock::new(|| match *SEED {
        Some(_) => copy_with(&shipped(), "rates", &RATES),
        None => shipped(),
    });
    SLOWER.clone()
}

/// The shipped configuration, for a flight that counts on its rates.
pub fn shipped() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../config")
}

/// A copy of the shipped configuration in which keys of `kittiwake.toml` have other values.
#[track_caller]
pub fn config_with(name: &str, changes: &[(&str, &str)]) -> PathBuf {
    copy_with(&config(), name, changes)
}

#[track_caller]
fn copy_with(shipped: &Path, name: &str, changes: &[(&str, &str)]) -> PathBuf {
    let copy = own_path(name);
    for folder in ["trees", "missions", "skills"] {
        std::fs::create_dir_all(copy.join(folder)).unwrap();
        for file in std::fs::read_dir(shipped.join(folder)).unwrap() {
            let path = file.unwrap().path();
            std::fs::copy(&path, copy.join(folder).join(path.file_name().unwrap())).unwrap();
        }
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
    let program = std::env::current_exe().unwrap();
    let folder = program.ancestors().nth(2).unwrap().join("tmp");
    std::fs::create_dir_all(&folder).unwrap();
    folder.join(format!("{name}-{number}"))
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

/// The seeds that `KITTIWAKE_SEEDS` asks for, a number of them or a range, or else a sample of the first `few`.
#[track_caller]
pub(crate) fn seeds(few: u64) -> Vec<u64> {
    fn range(asked: &str) -> Option<std::ops::Range<u64>> {
        let (from, to) = asked.split_once("..").unwrap_or(("0", asked));
        Some(from.parse().ok()?..to.parse().ok()?)
    }
    let Ok(asked) = std::env::var("KITTIWAKE_SEEDS") else { return sample(0..few) };
    range(&asked).expect("KITTIWAKE_SEEDS is a number of seeds, or a range of them such as 798..799").collect()
}

/// Of this many cases of a sweep one is flown.
const SAMPLED: usize = 8;

/// The seed of the draws of this run; `None`: all is flown.
static SEED: LazyLock<Option<u64>> = LazyLock::new(|| match std::env::var("KITTIWAKE_SWEEP") {
    Ok(all) if all == "all" => None,
    Ok(seed) => Some(seed.parse().expect("KITTIWAKE_SWEEP is a seed, or `all`")),
    Err(_) => Some(RandomState::new().hash_one("a seed") % 1_000_000),
});

/// The cases of a sweep that are flown: one in eight and at least one, drawn by the seed `KITTIWAKE_SWEEP`, or by a random one. `KITTIWAKE_SWEEP=all` flies
/// all, as `.ci/long sweeps` does. A test that fails prints the seed.
#[track_caller]
pub(crate) fn sample<T>(cases: impl IntoIterator<Item = T>) -> Vec<T> {
    let cases = cases.into_iter();
    let Some(seed) = *SEED else { return cases.collect() };
    let place = Location::caller();
    println!(
        "{place}: one case in {SAMPLED} is flown; KITTIWAKE_SWEEP={seed} flies the same, KITTIWAKE_SWEEP=all flies all"
    );
    // Each sweep draws by itself. The hasher of this name is the same in every run.
    let draw = |group: usize| {
        let mut hasher = DefaultHasher::new();
        (seed, place.file(), place.line(), group).hash(&mut hasher);
        hasher.finish() as usize
    };
    let mut cases: Vec<Option<T>> = cases.map(Some).collect();
    let groups = cases.chunks_mut(SAMPLED).enumerate();
    groups.filter_map(|(number, group)| group[draw(number) % group.len()].take()).collect()
}

/// Every `first` with every `second`.
pub(crate) fn each<A: Clone, B>(
    firsts: impl IntoIterator<Item = A>,
    seconds: impl IntoIterator<Item = B> + Clone,
) -> Vec<(A, B)> {
    let pairs = |first: A| seconds.clone().into_iter().map(move |second| (first.clone(), second)).collect::<Vec<_>>();
    firsts.into_iter().flat_map(pairs).collect()
}
