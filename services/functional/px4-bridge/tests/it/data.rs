//! The captured traffic: a copy of one flight, thinned, and the samples that were decoded by other means.

use std::io::Read;

use flate2::read::GzDecoder;

/// One sample of the flight.
pub(crate) struct Captured {
    pub(crate) at_us: u64,
    pub(crate) key: String,
    pub(crate) payload: Vec<u8>,
}

/// The flight: the tokens that PX4 declared, and what was sent both ways.
pub(crate) struct Flight {
    pub(crate) tokens: Vec<String>,
    pub(crate) samples: Vec<Captured>,
}

/// A sample with its values.
pub(crate) struct Decoded {
    pub(crate) type_name: String,
    pub(crate) payload: Vec<u8>,
    pub(crate) values: serde_json::Map<String, serde_json::Value>,
}

fn unpacked(bytes: &[u8]) -> String {
    let mut text = String::new();
    GzDecoder::new(bytes).read_to_string(&mut text).expect("a whole file");
    text
}

fn bytes(hex: &str) -> Vec<u8> {
    let digit = |it: u8| char::from(it).to_digit(16).expect("a hexadecimal digit") as u8;
    hex.as_bytes().chunks(2).map(|it| digit(it[0]) << 4 | digit(it[1])).collect()
}

pub(crate) fn flight() -> Flight {
    let text = unpacked(include_bytes!("data/flight.tsv.gz"));
    let (mut keys, mut tokens, mut samples, mut part) = (Vec::new(), Vec::new(), Vec::new(), "");
    for line in text.lines() {
        match (line.strip_prefix("# "), part) {
            (Some(title), _) => part = title.split(':').next().unwrap_or_default(),
            (None, "keys") => keys.push(line.to_owned()),
            (None, "tokens") => tokens.push(line.to_owned()),
            (None, _) => {
                let fields: Vec<_> = line.split('\t').collect();
                let (at_us, key) = (fields[0].parse().expect("a time"), fields[1].parse::<usize>().expect("an index"));
                samples.push(Captured { at_us, key: keys[key].clone(), payload: bytes(fields[2]) });
            }
        }
    }
    Flight { tokens, samples }
}

pub(crate) fn samples() -> Vec<Decoded> {
    let text = unpacked(include_bytes!("data/samples.json.gz"));
    let all: Vec<serde_json::Value> = serde_json::from_str(&text).expect("JSON");
    let one = |it: serde_json::Value| Decoded {
        type_name: it["type"].as_str().expect("a type").to_owned(),
        payload: bytes(it["payload_hex"].as_str().expect("bytes")),
        values: it["decoded"].as_object().expect("values").clone(),
    };
    all.into_iter().map(one).collect()
}
