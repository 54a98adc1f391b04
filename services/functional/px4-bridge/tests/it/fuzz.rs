//! Arbitrary bytes, and captured ones that were damaged: an error or a message, never a panic.

use px4_bridge::cdr::{Definitions, Record};
use px4_bridge::keys;
use px4_bridge::port::Arrival;

use crate::data;
use crate::rig::Rig;

#[test]
fn any_bytes_decode_or_are_refused() {
    let definitions = Definitions::known();
    bolero::check!().with_iterations(50_000).with_max_len(512).with_type::<Vec<u8>>().for_each(|bytes| {
        for definition in definitions.iter() {
            let whole = [&[0, 1, 0, 0], bytes.as_slice()].concat();
            if let Ok(record) = Record::decode(definition, &whole) {
                // What was read is written as it was, but for what lies between fields: it reads the same again.
                let encoded = record.encode();
                assert_eq!(Record::decode(definition, &encoded).map(|it| it.encode()), Ok(encoded));
            }
            assert!(bytes.starts_with(&[0, 1, 0, 0]) || Record::decode(definition, bytes).is_err());
        }
    });
}

#[test]
fn any_key_is_read_or_is_none() {
    bolero::check!().with_iterations(50_000).with_max_len(128).with_type::<String>().for_each(|key| {
        let _ = (keys::read(key, 0), keys::read_token(key, 0));
    });
}

#[test]
fn a_damaged_flight_panics_nothing_and_brings_no_number_that_is_none() {
    let flight = data::flight();
    let few: Vec<_> = flight.samples.iter().step_by(40).collect();
    let (iterations, length) = (300, 64);
    bolero::check!().with_iterations(iterations).with_max_len(length).with_type::<Vec<(u16, u16, u8)>>().for_each(
        |damage| {
            let mut rig = Rig::new();
            rig.listens();
            for (index, sample) in few.iter().enumerate() {
                let mut payload = sample.payload.clone();
                for (_, at, byte) in damage.iter().filter(|(which, ..)| usize::from(*which) % few.len() == index) {
                    let length = payload.len();
                    payload[usize::from(*at) % length] = *byte;
                }
                let arrival = Arrival::Sample { key: sample.key.clone(), payload };
                for message in rig.at_ms(sample.at_us / 1000).arrives(arrival) {
                    let json = message.to_json().to_string();
                    assert!(!json.contains("NaN") && !json.contains("Infinity"), "{json}");
                }
            }
        },
    );
}
