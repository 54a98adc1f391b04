//! Files of other programs become missions, with a word about everything that has no counterpart.

mod airspace;
mod bad_input;
mod round_trips;
mod samples;
mod schedules;
mod shapes;

use std::path::Path;

use domain::file::{Mistakes, Source};
use domain::geodesy::{LatLon, Origin};
use domain::mission::Mission;
use formats::assemble::{Assembled, Settings, assemble};

/// Where all samples are.
fn origin() -> Origin {
    Origin { place: LatLon::new(54.0, 6.6).unwrap(), altitude_m: Some(20.0) }
}

fn settings() -> Settings {
    Settings { name: "sample".into(), origin: Some(origin()), relief_m: None, strict: false, allow_empty: false }
}

fn source(name: &str, text: &str) -> Source {
    Source { path: name.into(), text: text.into() }
}

/// The text as a file of its own.
fn import(name: &str, text: &str, settings: &Settings) -> Result<Assembled, Mistakes> {
    assemble(&formats::read(&source(name, text))?, &[], settings)
}

/// What is written is a mission, but for objectives, which files of areas lack.
#[track_caller]
fn mission(assembled: &Assembled) -> Mission {
    let objective = "[[objective]]\nname = \"here\"\nnorth_m = 0.0\neast_m = 0.0\nheight_m = 20.0\nflying = true\n";
    let text =
        if assembled.objectives == 0 { format!("{}{objective}", assembled.text) } else { assembled.text.clone() };
    Mission::read(&Source { path: Path::new("m.toml").into(), text }).unwrap_or_else(|it| panic!("{it}"))
}

/// A line for each note.
fn notes(assembled: &Assembled) -> String {
    assembled.notes.iter().map(|it| format!("{}: {}\n", it.place, it.text)).collect()
}

/// Replaces `find` in a good text by `replace`, and checks that a mistake says `expected`.
#[track_caller]
fn check_mistake(name: &str, good: &str, find: &str, replace: &str, expected: &str) {
    assert!(good.contains(find), "the test's own text lacks `{find}`");
    match import(name, &good.replacen(find, replace, 1), &settings()) {
        Ok(read) => panic!("read without a mistake; expected `{expected}`\n{}", notes(&read)),
        Err(mistakes) => {
            let told = mistakes.to_string();
            assert!(told.starts_with(expected), "expected `{expected}`, got `{told}`");
        }
    }
}
