//! Files of all formats with parts changed, left out and repeated: each is refused or read, without a panic and in bounded time.

use std::path::Path;

use super::recognised::zip;
use super::samples::{ED_269, ED_318, GEO_JSON, KML, PLAN};
use super::settings;
use formats::LeaveOut;
use formats::assemble::assemble;
use proptest::prelude::*;

const AIXM: &str = include_str!("samples/airspace_aixm.xml");
const OPEN_AIR: &str = include_str!("samples/airspace_openair.txt");
const SAMPLES: [&str; 7] = [PLAN, ED_269, ED_318, GEO_JSON, KML, AIXM, OPEN_AIR];
/// What the formats give a meaning to.
const WORDS: [&str; 40] = [
    "",
    "0",
    "-1",
    "1e308",
    "nan",
    "90",
    "180",
    "360",
    ",",
    " ",
    "\n",
    "\"",
    "'",
    "<",
    ">",
    "/>",
    "</",
    "<!--",
    "-->",
    "<![CDATA[",
    "]]>",
    "&amp;",
    "&x;",
    "{",
    "}",
    "[",
    "]",
    "null",
    "AC P\n",
    "DC 1\n",
    "DA 1,0,360\n",
    "V D=-\n",
    "FL",
    "UNL",
    "GND",
    "xlink:href='#uuid.1'",
    "é",
    "\0",
    "\u{feff}",
    "PK\u{3}\u{4}",
];

/// One change of a file.
#[derive(Debug, Clone)]
pub(super) enum Change {
    Replace(prop::sample::Index, usize, prop::sample::Index),
    Repeat(prop::sample::Index, usize, u8),
    Swap(prop::sample::Index, prop::sample::Index, usize),
    Byte(prop::sample::Index, u8),
    End(prop::sample::Index),
}

fn changes() -> impl Strategy<Value = Change> {
    let at = any::<prop::sample::Index>;
    prop_oneof![
        8 => (at(), 0_usize..40, at()).prop_map(|(a, length, word)| Change::Replace(a, length, word)),
        2 => (at(), 1_usize..400, 1_u8..20).prop_map(|(a, length, times)| Change::Repeat(a, length, times)),
        2 => (at(), at(), 1_usize..100).prop_map(|(a, b, length)| Change::Swap(a, b, length)),
        2 => (at(), any::<u8>()).prop_map(|(a, byte)| Change::Byte(a, byte)),
        1 => at().prop_map(Change::End),
    ]
}

fn apply(bytes: &mut Vec<u8>, change: &Change) {
    if bytes.is_empty() {
        return;
    }
    let part = |at: &prop::sample::Index, length: usize| {
        let begin = at.index(bytes.len());
        begin..(begin + length).min(bytes.len())
    };
    match change {
        Change::Replace(at, length, word) => {
            let range = part(at, *length);
            bytes.splice(range, WORDS[word.index(WORDS.len())].bytes());
        }
        Change::Repeat(at, length, times) => {
            let range = part(at, *length);
            let repeated = bytes[range.clone()].repeat(usize::from(*times));
            bytes.splice(range.end..range.end, repeated);
        }
        Change::Swap(a, b, length) => {
            let moved: Vec<u8> = bytes[part(a, *length)].to_vec();
            let range = part(b, *length);
            bytes.splice(range, moved);
        }
        Change::Byte(at, byte) => {
            let index = at.index(bytes.len());
            bytes[index] = *byte;
        }
        Change::End(at) => bytes.truncate(at.index(bytes.len())),
    }
}

fn files() -> impl Strategy<Value = Vec<u8>> {
    let archive = zip(&[("doc.kml", KML.as_bytes()), ("b/c.kml", KML.as_bytes())]);
    let samples: Vec<Vec<u8>> = SAMPLES.iter().map(|it| it.as_bytes().to_vec()).chain([archive]).collect();
    (0..samples.len(), prop::collection::vec(changes(), 1..8)).prop_map(move |(sample, changes)| {
        let mut bytes = samples[sample].clone();
        changes.iter().for_each(|it| apply(&mut bytes, it));
        bytes
    })
}

fn read(bytes: Vec<u8>) {
    let mission = formats::read_bytes(
        Path::new("m"),
        br#"{"type": "FeatureCollection", "features": []}"#.to_vec(),
        &LeaveOut::default(),
    )
    .unwrap();
    if let Ok(read) = formats::read_bytes(Path::new("f"), bytes, &LeaveOut::default()) {
        let _ = assemble(&mission, std::slice::from_ref(&read), &settings());
        let _ = assemble(&read, &[], &settings());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_changed_file_is_read_or_refused(file in files()) {
        read(file);
    }
}

/// For an hour by hand: `KITTIWAKE_FUZZ_S=3600 cargo test -p formats --test it mutated -- --ignored`. It prints what it has tried, and
/// the file on which something takes longer than ten seconds.
#[test]
#[ignore = "runs for a time that is given"]
#[expect(clippy::disallowed_methods, reason = "it runs for a time, and measures what each file takes")]
fn many_changed_files_are_read_or_refused() {
    use proptest::strategy::ValueTree as _;
    let seconds = std::env::var("KITTIWAKE_FUZZ_S").ok().and_then(|it| it.parse().ok()).unwrap_or(600);
    let begins = std::time::Instant::now();
    let mut runner = proptest::test_runner::TestRunner::default();
    let mut count = 0_u64;
    while begins.elapsed().as_secs() < seconds {
        let file = files().new_tree(&mut runner).unwrap().current();
        let before = std::time::Instant::now();
        let outcome = std::panic::catch_unwind(|| read(file.clone()));
        let took = before.elapsed();
        assert!(outcome.is_ok() && took.as_secs() < 10, "{took:?}: {:?}", String::from_utf8_lossy(&file));
        count += 1;
    }
    println!("{count} files in {seconds} s");
}
