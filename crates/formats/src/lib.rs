//! Missions and areas in the formats of other programs: plans of QGroundControl, `QGC WPL`, GeoJSON, KML, ED-269 and ED-318.
//!
//! Each format has one file, which reads a text into [`content::Content`]; [`assemble`] makes one mission file of what was read,
//! and [`export`] writes a mission in another format. What was repaired becomes a [`Note`] with its place. What is not understood of
//! a zone is a [`content::Doubt`], and the zone bars more. What cannot be read safely is a mistake, and then there is no mission.
//! `docs/formats.md` has the tables.
//!
//! Nothing here opens a file: texts come in, texts go out.

use std::path::PathBuf;

use domain::file::{Mistake, Mistakes, Source};
use serde_json::Value;

use crate::content::Content;
use crate::findings::Findings;
use crate::json::Node;

mod applicability;
pub mod assemble;
mod clearance;
pub mod content;
mod edition;
pub mod export;
mod findings;
mod geojson;
mod heights;
mod json;
mod kml;
mod leave_out;
mod limits;
mod local;
mod mission_file;
mod national;
mod plan;
mod schedule;
mod shape;
mod sun;
mod terms;
mod zone_text;
mod zones;

pub use findings::{Note, Weight};
pub use leave_out::LeaveOut;

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
    /// Which items are left out.
    pub leave_out: LeaveOut,
}

/// The formats that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// A plan of QGroundControl.
    Plan,
    /// A mission as lines of text, `QGC WPL 110`.
    Wpl,
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
    read_without(source, &LeaveOut::default())
}

/// The same, without what a person has decided to leave out.
///
/// # Errors
/// As [`read`].
pub fn read_without(source: &Source, leave_out: &LeaveOut) -> Result<Import, Mistakes> {
    // A feed may have half a gigabyte: only a text that begins with a mark is copied.
    let unmarked = source.text.strip_prefix('\u{feff}');
    let unmarked = unmarked.map(|text| Source { path: source.path.clone(), text: text.to_owned() });
    let source = unmarked.as_ref().unwrap_or(source);
    let mut findings = Findings::about(&source.path).leaving_out(leave_out.clone());
    if source.text.trim_start().starts_with('<') {
        let content = kml::read(source, &mut findings)?;
        return import(source, Format::Kml, content, findings);
    }
    if source.text.starts_with(plan::wpl::BEGINNING) {
        let content = plan::wpl::read(&source.text, &mut findings);
        return import(source, Format::Wpl, content, findings);
    }
    let mut content = Content::default();
    let mut format = None;
    let document = json::scan(source, &LISTS, |item| {
        let read = feature(item, &mut content, &mut findings);
        format.get_or_insert(read);
    })?;
    let document = Node::root(&document);
    if plan::is_plan(&document) {
        let content = plan::read(&document, &mut findings);
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
    if let Some(form) = national::form(item) {
        match national::read(form, item, index, findings) {
            Ok(zones) => content.zones.extend(zones),
            Err(lost) => content.lost.push(lost),
        }
        return Format::GeoJson;
    }
    let is_feature = item.get("type").is_some_and(|it| it.value == "Feature") || item.get("properties").is_some();
    if !is_feature || zones::is_zone(item) {
        match zones::read(item, index, findings) {
            Ok(zones) => content.zones.extend(zones),
            Err(lost) => content.lost.push(lost),
        }
        return if is_feature { Format::Ed318 } else { Format::Ed269 };
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
    let leave_out = findings.leave_out().clone();
    let (content, notes) = findings.with(content)?;
    Ok(Import { path: source.path.clone(), format, content, notes, leave_out })
}

impl std::fmt::Display for Format {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Format::Plan => "a plan of QGroundControl",
            Format::Wpl => "QGC WPL",
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
