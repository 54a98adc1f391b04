//! `kittiwake airspace`: data sets of zones are checked, compared, and put into a mission, also into one that is flown.
//!
//! Files are fetched by others: see `docs/airspace.md`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use domain::area::Area;
use domain::feed::Feed;
use domain::file::Mistakes;
use domain::mission::Mission;
use formats::assemble::Settings;
use formats::{Import, LeaveOut, Refused};
use serde_json::{Value, json};

use crate::airspace::args::{AirspaceArgs, AirspaceCommand, NewFeeds};
use crate::operate::failure::Failure;
use crate::operate::gateway::Gateway;
use crate::operate::report;
use crate::outcome::Outcome;
use crate::plan::now;

mod adopt;
pub mod args;
mod check;
mod diff;
mod import;
mod page;

/// `kittiwake airspace`.
pub fn airspace(args: &AirspaceArgs) -> Outcome {
    let gateway = &args.gateway;
    match &args.what {
        AirspaceCommand::Check(it) => check::check(it, gateway.json),
        AirspaceCommand::Diff(it) => report(gateway, diff::diff(it)),
        AirspaceCommand::Import(it) => report(gateway, import::import(it)),
        AirspaceCommand::Adopt(it) => report(gateway, adopt::adopt(it, gateway.json, || Gateway::find(gateway))),
    }
}

/// Reads data sets; the mistakes of all of them are reported at once.
fn read_all<'a>(paths: impl IntoIterator<Item = &'a PathBuf>) -> Result<Vec<Import>, Failure> {
    let (mut imports, mut mistakes) = (Vec::new(), Vec::new());
    for path in paths {
        match read(path) {
            Ok(import) => imports.push(import),
            Err(found) => mistakes.extend(found.mistakes.0),
        }
    }
    Mistakes(mistakes).or(imports).map_err(bad_input)
}

fn read(path: &Path) -> Result<Import, Refused> {
    crate::operate::convert::read(path, &LeaveOut::default())
}

fn bad_input(mistakes: Mistakes) -> Failure {
    Failure::bad_input(mistakes.to_string())
}

impl NewFeeds {
    /// How the files are converted.
    fn settings(&self) -> Settings<'static> {
        Settings {
            name: "airspace".into(),
            origin: None,
            relief_m: self.relief,
            ground: None,
            strict: self.strict,
            allow_empty: self.allow_empty,
        }
    }

    /// Whether each feed of the mission is replaced or dropped by name: else the areas of one that was forgotten would vanish.
    /// A file replaces the feed of its name or its provider; the only file replaces the only feed.
    fn replace_all(&self, feeds: &[Feed], imports: &[Import]) -> Result<(), Failure> {
        let new: Vec<Feed> = imports.iter().map(Import::feed).collect();
        let is_replaced = |old: &Feed| {
            (feeds.len() == 1 && new.len() == 1)
                || self.drop.contains(&old.name)
                || new.iter().any(|it| it.name == old.name || (it.provider.is_some() && it.provider == old.provider))
        };
        if let Some(unknown) = self.drop.iter().find(|it| feeds.iter().all(|feed| feed.name != **it)) {
            return Err(Failure::bad_input(format!("--drop {unknown}: the mission has no feed of this name")));
        }
        match feeds.iter().find(|it| !is_replaced(it)) {
            None => Ok(()),
            Some(it) => Err(Failure::bad_input(format!(
                "the {} areas of {} would vanish: give its file as well, the present edition if there is no new one, or --drop \"{}\"",
                it.areas.len(),
                it.in_words(),
                it.name
            ))),
        }
    }
}

/// The names of the areas that came from no feed.
fn own_areas(areas: &[Area], feeds: &[Feed]) -> Vec<String> {
    let of_feeds: BTreeSet<&String> = feeds.iter().flat_map(|it| &it.areas).collect();
    areas.iter().map(|it| &it.name).filter(|it| !of_feeds.contains(it)).cloned().collect()
}

/// A line for each feed of a mission.
fn feed_lines(feeds: &[Feed]) -> Vec<String> {
    feeds.iter().map(|it| format!("airspace: {}: {} areas", it.in_words(), it.areas.len())).collect()
}

/// A loud line for each feed that is out of date.
fn warnings(feeds: &[Feed]) -> Vec<String> {
    let utc_ms = now().utc_ms;
    feeds.iter().filter_map(|it| it.out_of_date(utc_ms)).map(|it| format!("WARNING: {it}")).collect()
}

/// What `kittiwake plan` says of where the areas of a mission come from.
pub fn lines_of(mission: &Mission) -> Vec<String> {
    feed_lines(&mission.feeds)
}

/// An edition for programs.
fn edition(feed: &Feed, utc_ms: i64) -> Value {
    let moment = |it: Option<i64>| it.map(domain::time::utc_text);
    json!({
        "name": feed.name,
        "provider": feed.provider,
        "issuedUtc": moment(feed.issued_utc_ms),
        "validFromUtc": moment(feed.valid_from_utc_ms),
        "validUntilUtc": moment(feed.valid_until_utc_ms),
        "outOfDate": feed.out_of_date(utc_ms),
    })
}

/// Numbers with their words: `4 keep-out, 1 permission`.
fn counts(counts: &BTreeMap<&'static str, usize>) -> String {
    counts.iter().map(|(words, count)| format!("{count} {words}")).collect::<Vec<_>>().join(", ")
}
