//! Missions and areas in the formats of other programs: plans of QGroundControl, GeoJSON, KML, ED-269 and ED-318.
//!
//! Each format has one file, which reads a text into [`content::Content`]; [`assemble`] makes one mission file of what was read,
//! [`export`] writes a mission in another format, [`inspect`] counts what a data set has, [`compare`] compares two of them, and [`replace`]
//! puts a new edition into a mission file. What was repaired becomes a [`Note`] with its place. What is not understood of
//! a zone is a [`content::Doubt`], and the zone bars more. What cannot be read safely is a mistake, and then there is no mission.
//! `docs/formats.md` has the tables.
//!
//! Nothing here opens a file: texts come in, texts go out.

use std::path::PathBuf;

use domain::feed::Feed;
use domain::file::{Mistake, Mistakes, Source};
use domain::mission::bounds::LONGEST_NAME;
use serde_json::Value;

use crate::content::{Content, Edition};
use crate::findings::Findings;
use crate::json::Node;
use crate::mission_file::one_line;

mod applicability;
pub mod assemble;
pub mod compare;
pub mod content;
mod edition;
pub mod export;
mod findings;
mod geojson;
mod heights;
pub mod inspect;
mod json;
mod kml;
mod local;
mod mission_file;
mod qgc;
mod qgc_survey;
pub mod replace;
mod schedule;
mod shape;
mod sun;
mod terms;
mod zone_text;
mod zones;

pub use findings::Note;

/// A file that was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Import {
    /// The file.
    pub path: PathBuf,
    /// Which format it has.
    pub format: Format,
    /// What it says.
    pub content: Content,
    /// What has no counterpart, and what was repaired.
    pub notes: Vec<Note>,
}

impl Import {
    /// The edition of the data set that the file is, without areas. Texts are cut to what a mission file may have.
    pub fn feed(&self) -> Feed {
        let Edition { provider, issued_utc_ms, valid } = &self.content.edition;
        let name = self.path.file_name().unwrap_or(self.path.as_os_str()).to_string_lossy();
        let text = |it: &str| Some(one_line(it, LONGEST_NAME)).filter(|it| !it.is_empty());
        Feed {
            name: text(&name).unwrap_or_else(|| "feed".into()),
            provider: provider.as_deref().and_then(text),
            issued_utc_ms: *issued_utc_ms,
            valid_from_utc_ms: valid.from_utc_ms,
            valid_until_utc_ms: valid.until_utc_ms,
            areas: Vec::new(),
        }
    }
}

/// The formats that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// A plan of QGroundControl.
    Plan,
    /// GeoJSON, RFC 7946.
    GeoJson,
    /// KML 2.2.
    Kml,
    /// UAS geographical zones by ED-269.
    Ed269,
    /// UAS geographical zones by ED-318.
    Ed318,
}

/// Reads a file in whatever format it has.
///
/// # Errors
/// The mistakes, each with its place: a JSON pointer or a line.
pub fn read(source: &Source) -> Result<Import, Mistakes> {
    let text = source.text.strip_prefix('\u{feff}').unwrap_or(&source.text);
    let source = &Source { path: source.path.clone(), text: text.to_owned() };
    let mut findings = Findings::about(&source.path);
    if text.trim_start().starts_with('<') {
        let content = kml::read(source, &mut findings)?;
        return import(source, Format::Kml, content, findings);
    }
    let mut content = Content::default();
    let mut format = None;
    let document = json::scan(source, &LISTS, |item| {
        let read = feature(item, &mut content, &mut findings);
        format.get_or_insert(read);
    })?;
    let document = Node::root(&document);
    if document.value.get("fileType").and_then(Value::as_str) == Some("Plan") {
        let content = qgc::read(&document, &mut findings);
        return import(source, Format::Plan, content, findings);
    }
    let kind = document.value.get("type").and_then(Value::as_str);
    if kind == Some("Feature") {
        format = Some(feature(&document, &mut content, &mut findings));
    }
    let has_list = |it: &&str| document.value.get(it).is_some_and(Value::is_array);
    let empty = if kind == Some("FeatureCollection") { Format::GeoJson } else { Format::Ed269 };
    let format = format.or_else(|| LISTS.iter().any(has_list).then_some(empty)).ok_or_else(|| unknown(source))?;
    content.edition = edition::read(&document, &mut findings);
    import(source, format, content, findings)
}

/// The lists that may be as long as a country has zones.
const LISTS: [&str; 2] = ["features", "UASZoneList"];

/// Reads an item of such a list, in the format that it has itself.
fn feature(item: &Node<'_>, content: &mut Content, findings: &mut Findings) -> Format {
    let index = item.place.rsplit('/').next().and_then(|it| it.parse().ok()).unwrap_or_default();
    if zones::is_zone(item) {
        match zones::read(item, index, findings) {
            Ok(zones) => content.zones.extend(zones),
            Err(lost) => content.lost.push(lost),
        }
        return if item.get("properties").is_some() { Format::Ed318 } else { Format::Ed269 };
    }
    let read = geojson::read(item, index, content, findings);
    match read {
        Err(wrong) if geojson::is_area(item) => content.lost.push(zones::lost(item, wrong)),
        Err(wrong) => findings.wrong(wrong),
        Ok(()) => {}
    }
    Format::GeoJson
}

fn import(source: &Source, format: Format, content: Content, findings: Findings) -> Result<Import, Mistakes> {
    let (content, notes) = findings.with(content)?;
    Ok(Import { path: source.path.clone(), format, content, notes })
}

impl std::fmt::Display for Format {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Format::Plan => "a plan of QGroundControl",
            Format::GeoJson => "GeoJSON",
            Format::Kml => "KML",
            Format::Ed269 => "ED-269",
            Format::Ed318 => "ED-318",
        })
    }
}

fn unknown(source: &Source) -> Mistakes {
    Mistakes(vec![Mistake {
        path: source.path.clone(),
        place: None,
        message: "this JSON is in none of the formats that are read".into(),
        help: "a plan has `fileType`, GeoJSON and ED-318 have `type`, ED-269 has `UASZoneList` or `features`".into(),
    }])
}
