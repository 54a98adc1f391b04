//! Flags that rise and fall faster than anybody can respond.

use std::time::{Duration, Instant};

use kittiwake_proto::topics::Topic;
use kittiwake_proto::v1::FlagEvent;
use prost::Message;
use zenoh::Wait;
use zenoh::qos::CongestionControl;

use crate::bad_messages::stranger;
use crate::support::{System, shipped, wait_for};

/// A thousand events a second, in batches of this period, for so many rounds in which each flag rises and falls.
const PER_BATCH: usize = 10;
const PERIOD: Duration = Duration::from_millis(10);
const ROUNDS: usize = 170;

/// The flags after which the mission goes on: all others end it.
fn flags_that_resume() -> Vec<String> {
    let table = std::fs::read_to_string(shipped().join("contingencies.toml")).unwrap();
    let table: toml::Table = table.parse().unwrap();
    let rows = table["contingency"].as_array().expect("rows").iter();
    let rows = rows.filter(|it| it["then"].as_str() == Some("resume"));
    rows.map(|it| it["flag"].as_str().expect("a name").to_owned()).collect()
}

#[test]
fn after_a_storm_of_flags_none_stays_up_and_the_mission_is_flown_to_its_end() {
    let system = System::on_long_leg("5");
    let (flags, session) = (flags_that_resume(), stranger(&system.locator()));
    assert!(12 < flags.len(), "{flags:?}");
    let (begin, events) = (Instant::now(), 2 * ROUNDS * flags.len());
    for number in 0..events {
        let (name, raised) = (flags[number % flags.len()].clone(), (number / flags.len()) % 2 == 0);
        let event = FlagEvent { name, raised, source: "storm".into(), reason: "storm".into(), ..Default::default() };
        let key = format!("kw/uav1/{}", Topic::FlagEvent.key());
        session.put(key, event.encode_to_vec()).congestion_control(CongestionControl::Block).wait().unwrap();
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
    assert!(0 < recorded && recorded < events / 4, "{recorded} records of {events} events");
    ending.expect(0, &["SUCCESS"]);
}
