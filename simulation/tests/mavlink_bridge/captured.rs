//! Traffic of real autopilots, replayed. `data/` has raw frames of both ways, each after its time in microseconds since 1970, big-endian.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;
use std::time::Duration;

use kittiwake_proto::v1::FlightMode;
use mavlink_bridge::MavlinkBridge;
use mavlink_bridge::frame::{Found, Frame, Framer};
use mavlink_bridge::heard::{Heard, heard};
use mavlink_bridge::link::Link;
use node::Node;

use crate::stories::mavlink_bridge::rig::{Published, at, config};

/// The frames of a log with their times since its beginning.
pub(crate) fn log(name: &str) -> Vec<(Duration, Frame)> {
    let records = records(name);
    let start = records[0].0;
    records.into_iter().map(|(time, frame)| (time - start, frame)).collect()
}

/// When its first record was made.
pub(crate) fn start(name: &str) -> Duration {
    records(name)[0].0
}

fn records(name: &str) -> Vec<(Duration, Frame)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mavlink_bridge/data").join(name);
    let mut bytes = Vec::new();
    flate2::read::GzDecoder::new(std::fs::File::open(path).unwrap()).read_to_end(&mut bytes).unwrap();
    let mut records = Vec::new();
    let mut rest = &bytes[..];
    while !rest.is_empty() {
        let time_us = u64::from_be_bytes(rest[..8].try_into().unwrap());
        let signature = if rest[10] & 1 != 0 { 13 } else { 0 };
        let length = 12 + usize::from(rest[9]) + signature;
        let found = Framer::datagram(&rest[8..8 + length]);
        let [Found::Frame(frame)] = &found[..] else { panic!("record {}: {found:?}", records.len()) };
        records.push((Duration::from_micros(time_us), frame.clone()));
        rest = &rest[8 + length..];
    }
    records
}

#[test]
fn the_raw_logs_are_read_to_the_last_frame() {
    #[track_caller]
    fn check(name: &str, expected: usize, autopilot: u8) {
        let log = log(name);
        assert_eq!(log.len(), expected);
        let unknown = log.iter().filter(|(_, it)| !it.is_known()).map(|(_, it)| it.id()).collect::<Vec<_>>();
        assert!(unknown.is_empty(), "ids that the dialect lacks: {unknown:?}");
        let mut kinds = BTreeMap::new();
        for (_, frame) in &log {
            let name = heard(frame)
                .map(|it| format!("{it:?}").chars().take_while(char::is_ascii_alphanumeric).collect::<String>());
            *kinds.entry(name).or_insert(0) += 1;
            if let Some(Heard::Heartbeat(it)) = heard(frame)
                && frame.component() == 1
            {
                assert_eq!((it.autopilot, it.kind), (autopilot, 2));
            }
        }
        for wanted in ["Heartbeat", "Ack", "LocalPosition", "GlobalPosition", "Landed", "Battery", "Health"] {
            assert!(0 < *kinds.get(&Some(wanted.to_owned())).unwrap_or(&0), "{wanted}: {kinds:?}");
        }
    }
    check("ap_short.tlog.gz", 2_965, 3);
    check("px4_short.tlog.gz", 5_950, 12);
}

/// What was recorded arrives when it did.
#[derive(Debug)]
pub(crate) struct Recorded(pub(crate) Vec<(Duration, Frame)>);

impl Link for Recorded {
    fn receive(&mut self, now: domain::time::Time) -> Option<Vec<u8>> {
        let is_due = self.0.first().is_some_and(|(time, _)| *time <= now.since_start());
        is_due.then(|| self.0.remove(0).1.bytes().to_vec())
    }

    fn send(&mut self, _frame: &[u8], _now: domain::time::Time) {}

    fn is_datagram(&self) -> bool {
        true
    }
}

/// The actual modes and the armed state, as they changed.
fn story(name: &str) -> Vec<(bool, FlightMode)> {
    let received = log(name).into_iter().filter(|(_, it)| it.component() == 1).collect::<Vec<_>>();
    let times = received.iter().map(|(time, _)| *time).collect::<Vec<_>>();
    let mut bridge = MavlinkBridge::new(&config(), Recorded(received));
    let mut published = Published::default();
    for time in times {
        let mut effects = Vec::new();
        bridge.act(at(time), &mut effects);
        published.take_in(effects, time);
    }
    let mut story = Vec::new();
    for (_, it) in &published.statuses {
        let state = (it.armed, it.actual_mode());
        if story.last() != Some(&state) {
            story.push(state);
        }
    }
    story
}

#[test]
fn the_flight_of_a_real_px4_is_told_as_it_was() {
    use FlightMode::{Land, Loiter, Offboard, Return, Takeoff};
    let story = story("px4_short.tlog.gz");
    let flown = story.iter().filter(|(armed, _)| *armed).map(|(_, mode)| *mode).collect::<Vec<_>>();
    let mut rest = flown.iter();
    for wanted in [Takeoff, Loiter, Offboard, Return, Land] {
        assert!(rest.any(|it| *it == wanted), "{wanted:?} in {flown:?}");
    }
    assert_eq!(story.last().map(|(armed, _)| *armed), Some(false), "{story:?}");
}

#[test]
fn the_flight_of_a_real_ardupilot_is_told_as_it_was() {
    use FlightMode::{Land, Loiter};
    let story = story("ap_short.tlog.gz");
    let flown = story.iter().filter(|(armed, _)| *armed).map(|(_, mode)| *mode).collect::<Vec<_>>();
    // It was commanded by another process than this one: all that this one knows of GUIDED is that it is held.
    let mut rest = flown.iter();
    for wanted in [Loiter, Land] {
        assert!(rest.any(|it| *it == wanted), "{wanted:?} in {flown:?}");
    }
    assert_eq!(story.last().map(|(armed, _)| *armed), Some(false), "{story:?}");
}
