//! Missions and areas in the formats of other programs: plans of QGroundControl, `QGC WPL`, GeoJSON, KML, AIXM, OpenAir, ED-269 and
//! ED-318.
//!
//! The content of a file says which format it has; a file in another format is refused by the name of that format. Each format has one module,
//! which reads a text into [`content::Content`]; [`assemble`] makes one mission file of what was read,
//! [`export`] writes a mission in another format, [`inspect`] counts what a data set has, [`compare`] compares two of them, and [`replace`]
//! puts a new edition into a mission file. What was repaired becomes a [`Note`] with its place. What is not understood of
//! a zone is a [`content::Doubt`], and the zone bars more. What cannot be read safely is a mistake, and then there is no mission.
//! `docs/formats.md` has the tables.
//!
//! Nothing here opens a file: bytes and texts come in, texts go out.

use std::path::{Path, PathBuf};

use domain::feed::Feed;
use domain::file::Source;
use domain::mission::bounds::LONGEST_NAME;
use serde_json::Value;

use crate::content::{Content, Edition};
use crate::findings::Findings;
use crate::json::Node;
use crate::mission_file::one_line;
use crate::recognise::Kind;

mod applicability;
mod archive;
mod arcs;
pub mod assemble;
mod bytes;
mod clearance;
pub mod compare;
pub mod content;
mod edition;
pub mod export;
mod findings;
mod geojson;
mod heights;
pub mod inspect;
mod json;
mod leave_out;
mod limits;
mod local;
mod mission_file;
mod national;
mod openair;
mod plan;
mod recognise;
pub mod replace;
mod schedule;
mod shape;
mod sun;
mod terms;
mod xml;
mod zone_text;
mod zones;

pub use findings::{Note, Refused, Weight};
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
    /// A mission as lines of text, `QGC WPL 110`.
    Wpl,
    /// GeoJSON, RFC 7946.
    GeoJson,
    /// KML 2.2, also in an archive (KMZ).
    Kml,
    /// AIXM 5.1.
    Aixm,
    /// OpenAir.
    OpenAir,
    /// UAS geographical zones by ED-269.
    Ed269,
    /// UAS geographical zones by ED-318.
    Ed318,
}

/// The largest file that is read, in bytes: 1 GiB. The lists of zones of a country have some ten megabytes, those of a continent more.
pub const LARGEST_BYTES: u64 = 1 << 30;

/// Reads a file in whatever format and encoding it has, without what a person has decided to leave out.
///
/// # Errors
/// The mistakes, each with its place: a JSON pointer or a line. A file in no format that is read is refused by its name.
pub fn read_bytes(path: &Path, bytes: Vec<u8>, leave_out: &LeaveOut) -> Result<Import, Refused> {
    if bytes::is_archive(&bytes) {
        let mut findings = Findings::about(path).leaving_out(leave_out.clone());
        let files = archive::unpack(path, &bytes)?;
        let content = xml::read_inside(path, &files, &mut findings)?;
        return import(path, Format::Kml, content, findings);
    }
    read_without(&Source { path: path.to_owned(), text: bytes::text(path, bytes)? }, leave_out)
}

/// As [`read_bytes`], of a text.
///
/// # Errors
/// As [`read_bytes`].
pub fn read(source: &Source) -> Result<Import, Refused> {
    read_without(source, &LeaveOut::default())
}

/// The same, without what a person has decided to leave out.
///
/// # Errors
/// As [`read`].
pub fn read_without(source: &Source, leave_out: &LeaveOut) -> Result<Import, Refused> {
    // A feed may have half a gigabyte: only a text that begins with a mark is copied.
    let unmarked = source.text.strip_prefix('\u{feff}');
    let unmarked = unmarked.map(|text| Source { path: source.path.clone(), text: text.to_owned() });
    let source = unmarked.as_ref().unwrap_or(source);
    let mut findings = Findings::about(&source.path).leaving_out(leave_out.clone());
    match recognise::kind(source)? {
        Kind::Json => {}
        Kind::Xml => {
            let (format, content) = xml::read(source, &mut findings)?;
            return import(&source.path, format, content, findings);
        }
        Kind::OpenAir => {
            let content = openair::read(&source.text, &mut findings);
            return import(&source.path, Format::OpenAir, content, findings);
        }
        Kind::Wpl => {
            let content = plan::wpl::read(&source.text, &mut findings);
            return import(&source.path, Format::Wpl, content, findings);
        }
    }
    let mut content = Content::default();
    let mut format = None;
    let document = json::scan(source, &LISTS, |item| {
        let read = feature(item, &mut content, &mut findings);
        format.get_or_insert(read);
    });
    let document = document.map_err(|mistakes| recognise::json_lines(source).unwrap_or(mistakes))?;
    if recognise::foreign_json(&document).is_some() {
        return Err(recognise::unknown_json(source, &document).into());
    }
    let document = Node::root(&document);
    if plan::is_plan(&document) {
        let content = plan::read(&document, &mut findings);
        return import(&source.path, Format::Plan, content, findings);
    }
    let kind = document.value.get("type").and_then(Value::as_str);
    if kind == Some("Feature") {
        format = Some(feature(&document, &mut content, &mut findings));
    }
    let has_list = |it: &&str| document.value.get(it).is_some_and(Value::is_array);
    let empty = if kind == Some("FeatureCollection") { Format::GeoJson } else { Format::Ed269 };
    let format = format
        .or_else(|| LISTS.iter().any(has_list).then_some(empty))
        .ok_or_else(|| recognise::unknown_json(source, document.value))?;
    content.edition = edition::read(&document, &mut findings);
    import(&source.path, format, content, findings)
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

fn import(path: &Path, format: Format, content: Content, findings: Findings) -> Result<Import, Refused> {
    let leave_out = findings.leave_out().clone();
    let (content, notes) = findings.with(content)?;
    Ok(Import { path: path.to_owned(), format, content, notes, leave_out })
}

impl std::fmt::Display for Format {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Format::Plan => "a plan of QGroundControl",
            Format::Wpl => "QGC WPL",
            Format::GeoJson => "GeoJSON",
            Format::Kml => "KML",
            Format::Aixm => "AIXM",
            Format::OpenAir => "OpenAir",
            Format::Ed269 => "ED-269",
            Format::Ed318 => "ED-318",
        })
    }
}
