//! Arbitrary bytes, and captured ones that were damaged: an error or a message, never a panic.

use proptest::collection::vec;
use proptest::prelude::*;
use px4_bridge::cdr::{Definitions, Record};
use px4_bridge::keys;
use px4_bridge::port::Arrival;

use super::data;
use super::rig::Rig;

fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

#[test]
fn any_bytes_decode_or_are_refused() {
    let definitions = Definitions::known();
    proptest!(cases(50_000), |(bytes in vec(any::<u8>(), 0..=512))| {
        for definition in definitions.iter() {
            let whole = [&[0, 1, 0, 0], bytes.as_slice()].concat();
            if let Ok(record) = Record::decode(definition, &whole) {
                // What was read is written as it was, but for what lies between fields: it reads the same again.
                let encoded = record.encode();
                prop_assert_eq!(Record::decode(definition, &encoded).map(|it| it.encode()), Ok(encoded));
            }
            prop_assert!(bytes.starts_with(&[0, 1, 0, 0]) || Record::decode(definition, &bytes).is_err());
        }
    });
}

#[test]
fn any_key_is_read_or_is_none() {
    proptest!(cases(50_000), |(key in vec(any::<char>(), 0..=64))| {
        let key = String::from_iter(key);
        let _ = (keys::read(&key, 0), keys::read_token(&key, 0));
    });
}

#[test]
fn a_damaged_flight_panics_nothing_and_brings_no_number_that_is_none() {
    let flight = data::flight();
    let few: Vec<_> = flight.samples.iter().step_by(40).collect();
    // Which samples are damaged, where, and what stands there then.
    let damage = vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), any::<u8>()), 0..=64);
    proptest!(cases(300), |(damage in damage)| {
        let mut rig = Rig::new();
        rig.listens();
        for (index, sample) in few.iter().enumerate() {
            let mut payload = sample.payload.clone();
            for (_, at, byte) in damage.iter().filter(|(which, ..)| which.index(few.len()) == index) {
                let at = at.index(payload.len());
                payload[at] = *byte;
            }
            let arrival = Arrival::Sample { key: sample.key.clone(), payload };
            for message in rig.at_ms(sample.at_us / 1000).arrives(arrival) {
                let json = message.to_json().to_string();
                prop_assert!(!json.contains("NaN") && !json.contains("Infinity"), "{json}");
            }
        }
    });
}
