//! Missions and areas in the formats of other programs: plans of QGroundControl, GeoJSON, KML, ED-269 and ED-318.
//!
//! Each format has one file, which reads a text into [`content::Content`]; [`assemble`] makes one mission file of what was read,
//! and [`export`] writes a mission in another format. What has no counterpart, and what was repaired, becomes a [`Note`] with
//! its place; what cannot be read safely is a mistake, and then there is no mission. `docs/formats.md` has the tables.
//!
//! Nothing here opens a file: texts come in, texts go out.

use std::path::PathBuf;

use domain::file::{Mistake, Mistakes, Source};

use crate::content::Content;
use crate::findings::Findings;
use crate::json::Node;

mod applicability;
pub mod assemble;
mod clearance;
pub mod content;
mod ed269;
mod ed318;
pub mod export;
mod findings;
mod geojson;
mod heights;
mod json;
mod kml;
mod local;
mod mission_file;
mod qgc;
mod qgc_survey;
mod schedule;
mod shape;
mod terms;
mod zone_text;

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
    let document = json::parse(source)?;
    let document = Node::root(&document);
    let (format, content) = match format_of(&document).ok_or_else(|| unknown(source))? {
        Format::Plan => (Format::Plan, qgc::read(&document, &mut findings)),
        Format::Ed269 => (Format::Ed269, ed269::read(&document, &mut findings)),
        Format::Ed318 => (Format::Ed318, ed318::read(&document, &mut findings)),
        Format::GeoJson | Format::Kml => (Format::GeoJson, geojson::read(&document, &mut findings)),
    };
    import(source, format, content, findings)
}

fn import(source: &Source, format: Format, content: Content, findings: Findings) -> Result<Import, Mistakes> {
    let (content, notes) = findings.with(content)?;
    Ok(Import { path: source.path.clone(), format, content, notes })
}

/// By what only one of the formats has.
fn format_of(document: &Node<'_>) -> Option<Format> {
    let text = |key| document.value.get(key).and_then(|it| it.as_str());
    if text("fileType") == Some("Plan") {
        return Some(Format::Plan);
    }
    if document.get("UASZoneList").is_some() {
        return Some(Format::Ed269);
    }
    match text("type") {
        Some("FeatureCollection") => {
            // ED-318 asks for both in each feature.
            let is_zone = |it: &Node<'_>| {
                it.get("properties").is_some_and(|it| it.get("identifier").is_some() && it.get("variant").is_some())
            };
            let features = document.list("features").unwrap_or_default();
            Some(if features.iter().any(is_zone) { Format::Ed318 } else { Format::GeoJson })
        }
        Some("Feature") => Some(Format::GeoJson),
        _ => document.get("features").map(|_| Format::Ed269),
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
