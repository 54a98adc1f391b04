//! Bytes of a real PX4, and what other tools read in them.

use px4_bridge::cdr::{Definitions, Record, Value};
use px4_bridge::keys;

use crate::stories::data;

fn is_same(found: Value, expected: &serde_json::Value) -> bool {
    let text = expected.as_str();
    match found {
        Value::Bool(it) => expected.as_bool() == Some(it),
        Value::Unsigned(it) => expected.as_u64() == Some(it),
        Value::Signed(it) => expected.as_i64() == Some(it),
        Value::Single(it) if it.is_nan() => text == Some("nan"),
        Value::Double(it) if it.is_nan() => text == Some("nan"),
        Value::Single(it) if it.is_infinite() => text == Some(if it < 0.0 { "-inf" } else { "inf" }),
        Value::Double(it) if it.is_infinite() => text == Some(if it < 0.0 { "-inf" } else { "inf" }),
        // What reads the text may round its last digit otherwise.
        Value::Single(it) => expected.as_f64().map(|it| it as f32) == Some(it),
        Value::Double(it) => expected.as_f64().is_some_and(|other| (it - other).abs() <= 4.0 * f64::EPSILON * it.abs()),
    }
}

/// Compares the values of a message, and those of messages within it.
fn compare(record: &Record<'_>, prefix: &str, expected: &serde_json::Map<String, serde_json::Value>) -> usize {
    let mut compared = 0;
    for (name, value) in expected {
        let name = format!("{prefix}{name}");
        if let Some(inner) = value.as_object() {
            compared += compare(record, &format!("{name}."), inner);
            continue;
        }
        let found = record.values(&name).unwrap_or_else(|it| panic!("{it}"));
        let expected = value.as_array().map_or(std::slice::from_ref(value), |it| it.as_slice());
        assert_eq!(found.len(), expected.len(), "{name}");
        for (found, expected) in found.iter().zip(expected) {
            assert!(is_same(*found, expected), "{name}: {found:?}, expected {expected}");
        }
        compared += 1;
    }
    compared
}

#[test]
fn every_sample_decodes_to_its_values() {
    let definitions = Definitions::known();
    let samples = data::samples();
    assert_eq!(samples.len(), 35);
    for sample in samples {
        let definition = definitions.iter().find(|it| it.type_name == sample.type_name);
        let definition = definition.unwrap_or_else(|| panic!("{} is not in the table", sample.type_name));
        let record = Record::decode(definition, &sample.payload).unwrap_or_else(|it| panic!("{it}"));
        let compared = compare(&record, "", &sample.values);
        assert_eq!(compared, definition.fields.len(), "{}: every field has a value", sample.type_name);
    }
}

#[test]
fn every_captured_message_encodes_to_its_bytes() {
    let definitions = Definitions::known();
    let mut inbound = 0;
    for sample in data::flight().samples {
        let key = keys::read(&sample.key, 0).unwrap_or_else(|| panic!("{} is not a key of PX4", sample.key));
        let definition = definitions.of(key.topic, key.hash).expect("a version of the table");
        let record = Record::decode(definition, &sample.payload).unwrap_or_else(|it| panic!("{it}"));
        let encoded = record.encode();
        if key.is_output {
            // Between fields PX4 leaves what was in its memory, and behind the message too.
            assert!(encoded.len() <= sample.payload.len(), "{}", key.topic);
            assert_eq!(Record::decode(definition, &encoded).map(|it| it.encode()), Ok(encoded), "{}", key.topic);
        } else {
            assert_eq!(encoded, sample.payload, "{}", key.topic);
            assert_eq!(keys::input(0, key.topic, key.type_name, key.hash), sample.key);
            inbound += 1;
        }
    }
    assert_eq!(inbound, 886);
}
