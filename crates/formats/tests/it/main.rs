//! Files of other programs become missions, with a word about everything that has no counterpart.

mod airspace;
mod aixm;
mod bad_input;
mod golden;
mod ground;
mod kml;
mod mutated;
mod odd_values;
mod one_change;
mod openair;
mod plans;
mod recognised;
mod round_trips;
mod samples;
mod schedules;
mod shapes;

use std::path::Path;

use domain::file::{Mistakes, Source};
use domain::geodesy::{LatLon, Origin};
use domain::mission::Mission;
use formats::assemble::{Assembled, Settings, assemble};
use formats::{LeaveOut, Refused};

/// Where all samples are.
fn origin() -> Origin {
    Origin { place: LatLon::new(54.0, 6.6).unwrap(), altitude_m: Some(20.0) }
}

fn settings() -> Settings<'static> {
    Settings {
        name: "sample".into(),
        origin: Some(origin()),
        relief_m: None,
        ground: None,
        strict: false,
        allow_empty: false,
    }
}

fn source(name: &str, text: &str) -> Source {
    Source { path: name.into(), text: text.into() }
}

/// The text as a file of its own.
fn import(name: &str, text: &str, settings: &Settings<'_>) -> Result<Assembled, Refused> {
    assemble(&formats::read(&source(name, text))?, &[], settings)
}

/// What is made of bytes as a file of areas beside a mission: an area for each line, and the notes.
fn areas(bytes: &[u8], settings: &Settings) -> Result<(Vec<String>, String), Refused> {
    let areas = formats::read_bytes(Path::new("areas"), bytes.to_vec(), &LeaveOut::default())?;
    let mission = formats::read(&source("m", r#"{"type": "FeatureCollection", "features": []}"#))?;
    let assembled = assemble(&mission, &[areas], settings)?;
    Ok((samples::in_words(&self::mission(&assembled).areas), notes(&assembled)))
}

/// A file of areas is read to these areas, and these parts are noted; nothing is said if there are none.
#[track_caller]
fn check_areas(bytes: &[u8], expected: &[&str], said: &[&str]) {
    let (found, notes) = areas(bytes, &settings()).unwrap_or_else(|it| panic!("{it}"));
    assert_eq!(found, expected, "{notes}");
    assert!(said.iter().all(|it| notes.contains(it)), "expected {said:?}, got {notes}");
    assert!(!said.is_empty() || notes.is_empty(), "{notes}");
}

/// A file of areas is refused.
#[track_caller]
fn check_refused(bytes: &[u8], expected: &str) {
    match areas(bytes, &settings()) {
        Ok(read) => panic!("read to {read:?}, expected `{expected}`"),
        Err(mistakes) => assert!(mistakes.to_string().contains(expected), "expected `{expected}`, got {mistakes}"),
    }
}

/// What is written is a mission, but for objectives, which files of areas lack.
#[track_caller]
fn mission(assembled: &Assembled) -> Mission {
    try_mission(assembled).unwrap_or_else(|it| panic!("{it}"))
}

/// As [`mission`]; what the command `import` would refuse otherwise.
fn try_mission(assembled: &Assembled) -> Result<Mission, Mistakes> {
    let objective = "[[objective]]\nname = \"here\"\nnorth_m = 0.0\neast_m = 0.0\nheight_m = 20.0\nflying = true\n";
    let text =
        if assembled.objectives == 0 { format!("{}{objective}", assembled.text) } else { assembled.text.clone() };
    Mission::read(&Source { path: Path::new("m.toml").into(), text })
}

/// A line for each note.
fn notes(assembled: &Assembled) -> String {
    assembled.notes.iter().map(|it| format!("{}: {}\n", it.place, it.text)).collect()
}

/// Replaces `find` in a good text by `replace`, and checks that a mistake says `expected` where every zone must be understood.
#[track_caller]
fn check_mistake(name: &str, good: &str, find: &str, replace: &str, expected: &str) {
    assert!(good.contains(find), "the test's own text lacks `{find}`");
    match import(name, &good.replacen(find, replace, 1), &Settings { strict: true, ..settings() }) {
        Ok(read) => panic!("read without a mistake; expected `{expected}`\n{}", notes(&read)),
        Err(mistakes) => {
            let told = mistakes.to_string();
            assert!(told.starts_with(expected), "expected `{expected}`, got `{told}`");
        }
    }
}
