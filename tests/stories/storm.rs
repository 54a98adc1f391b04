//! Flags that rise and fall faster than anybody can respond.

use std::time::{Duration, Instant};

use crate::stories::bad_messages::{say_flag, stranger};
use crate::support::{System, shipped, wait_for};

/// A thousand events a second, in batches of this period, this many in all: each flag rises and falls again and again.
const PER_BATCH: usize = 10;
const PERIOD: Duration = Duration::from_millis(10);
const EVENTS: usize = 4500;

/// Flags that do not fall with what raised them, or end an objective.
const LASTING: [&str; 3] = ["area_breached", "somebody_else_flies", "frame_moved"];

/// The flags after which the mission goes on: all others end it. Not the breach of an area: five of them on one way give up its
/// objective, as they should; nor that somebody else flies or that the frame has moved, which an operator's order ends.
fn flags_that_resume() -> Vec<String> {
    let table = std::fs::read_to_string(shipped().join("contingencies.toml")).unwrap();
    let table: toml::Table = table.parse().unwrap();
    let rows = table["contingency"].as_array().expect("rows").iter();
    let rows = rows.filter(|it| it["then"].as_str() == Some("resume"));
    rows.map(|it| it["flag"].as_str().expect("a name").to_owned())
        .filter(|it| !LASTING.contains(&it.as_str()))
        .collect()
}

#[test]
fn after_a_storm_of_flags_none_stays_up_and_the_mission_is_flown_to_its_end() {
    let system = System::on_long_leg("5");
    let (flags, session) = (flags_that_resume(), stranger(&system.locator()));
    assert!(12 < flags.len(), "{flags:?}");
    let (begin, events) = (Instant::now(), EVENTS.next_multiple_of(2 * flags.len()));
    for number in 0..events {
        say_flag(&session, &flags[number % flags.len()], (number / flags.len()) % 2 == 0);
        if number % PER_BATCH == 0 {
            let due = begin + PERIOD * (number / PER_BATCH) as u32;
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
        }
    }
    eprintln!("{events} events in {:.1} s", begin.elapsed().as_secs_f64());
    wait_for("every flag to fall", || {
        let active = system.status()["contingencies"]["active"].as_array().map_or(0, Vec::len);
        (active == 0).then_some(())
    });
    let ending = system.end();
    let recorded = ending.story("contingency").len();
    eprintln!("{recorded} records");
    // What is said of a flag again and again is recorded a few times, and then counted.
    let most = 75 * flags.len();
    assert!(0 < recorded && recorded < most.min(events), "{recorded} records of {events} events");
    ending.expect(0, &["SUCCESS"]);
}
