//! Floods: events of flags as fast as their rate says. Unknown ones, which nobody expects, and known ones that rise and fall.

use std::path::Path;
use std::time::Duration;

use bus::{Process, Stop};
use domain::contingency::{SOMEBODY_ELSE_FLIES, Then};
use kittiwake::check_inputs;
use kittiwake::flood::{Flood, PERIOD, per_batch};
use kittiwake::settings::Settings;
use kittiwake_proto::v1::FlagEvent;
use rand::SeedableRng;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;

use crate::system::link;
use crate::trouble::Order;
use crate::trouble::ranges::{STORM_FLAGS, STORM_HZ};

/// What the unknown flags are called, with a number.
pub(crate) const FLAG: &str = "unheard_of";
/// The reason of known flags.
pub(crate) const STORM: &str = "chaos storm";

/// Publishes `rate_hz` events of unknown flags a second for `time`, at the router at `locator`.
pub(crate) fn of_unknown(locator: &str, rate_hz: u32, time: Duration) {
    let per_batch = per_batch(rate_hz);
    let event = |number: u64| (format!("{FLAG}_{}", number % per_batch), true);
    send(locator, rate_hz, per_batch * batches(time), event);
}

/// These flags rise one after the other, and fall one after the other, again and again for `time`; in the end all have fallen.
pub(crate) fn storm(locator: &str, flags: Vec<String>, time: Duration) {
    let count = flags.len().max(1) as u64;
    // Whole rounds, the last of which lowers every flag.
    let rounds = (batches(time) * per_batch(STORM_HZ)).div_ceil(2 * count);
    let event = move |number: u64| (flags[(number % count) as usize].clone(), (number / count).is_multiple_of(2));
    send(locator, STORM_HZ, 2 * count * rounds, event);
}

/// Flags of the contingency table, drawn by `draw`. Not those by which an order is carried out, which an operator gives and
/// nobody else, nor a crash, after which there is nothing to be seen, nor that somebody else flies, which only an order ends.
pub(crate) fn known_flags(config: &Path, draw: u64) -> Result<Vec<String>, String> {
    let inputs = check_inputs::read(&Settings::of_file(config)).map_err(|it| it.to_string())?;
    let is_order = |flag: &str| [Order::Abort, Order::Return].iter().any(|it| it.flag() == flag);
    let rows = inputs
        .contingencies
        .rows()
        .iter()
        .filter(|it| it.then != Then::Crashed && !is_order(&it.flag) && it.flag != SOMEBODY_ELSE_FLIES);
    let flags: Vec<String> = rows.map(|it| it.flag.clone()).collect();
    let mut chance = ChaCha8Rng::seed_from_u64(draw);
    Ok(flags.choose_multiple(&mut chance, STORM_FLAGS).cloned().collect())
}

fn batches(time: Duration) -> u64 {
    (time.as_secs_f64() / PERIOD.as_secs_f64()) as u64
}

/// Sends `total` events, `rate_hz` of them a second: each is the name of a flag, and whether it is raised.
fn send(locator: &str, rate_hz: u32, total: u64, event: impl Fn(u64) -> (String, bool)) {
    let event = |number| {
        let (name, raised) = event(number);
        FlagEvent { name, raised, reason: STORM.into(), ..Default::default() }
    };
    let mut flood = Flood::new(rate_hz, total, event);
    if let Err(cause) = Process::of(&mut flood, &link(locator)).run(&Stop::new()) {
        tracing::warn!(%cause, "no flood");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_storm_is_of_sixteen_flags_of_the_table_which_all_fall_in_the_end() {
        let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/kittiwake.toml");
        let flags = known_flags(&config, 7).unwrap();
        assert_eq!((flags.len(), &flags), (STORM_FLAGS, &known_flags(&config, 7).unwrap()));
        assert!(!flags.iter().any(|it| it == "crashed" || it == "operator_abort"), "{flags:?}");
        let other = (8..20).any(|draw| known_flags(&config, draw).unwrap() != flags);
        assert!(other, "another draw is another storm");
    }
}
