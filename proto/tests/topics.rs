//! The table of topics and services.

use std::collections::BTreeSet;

use kittiwake_proto::topics::{Message, Service, Topic};
use kittiwake_proto::v1;

#[test]
fn every_key_is_used_once() {
    let keys: Vec<_> = Topic::ALL.iter().map(|it| it.key()).chain(Service::ALL.iter().map(|it| it.key())).collect();
    let distinct: BTreeSet<_> = keys.iter().collect();
    assert_eq!(distinct.len(), keys.len(), "two entries share a key: {keys:?}");
}

#[test]
fn a_message_survives_the_wire_and_garbage_is_refused() {
    let message = Message::from(v1::FlagEvent { name: "battery_low".into(), raised: true, ..Default::default() });
    assert_eq!(Message::decode(message.topic(), &message.encode()), Ok(message));
    let refused = Message::decode(Topic::FlagEvent, &[0xff; 3]).unwrap_err();
    assert_eq!(refused.key, "monitor/flag");
}
