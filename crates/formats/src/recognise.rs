//! What a text is. One of a kind that is not read is refused by its name.

use domain::file::Mistakes;
use domain::file::{Mistake, Source};
use serde_json::Value;

use crate::bytes::refused;
use crate::openair;
use crate::plan::wpl;

/// The kinds of text that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Json,
    Xml,
    OpenAir,
    Wpl,
}

const DATA: &str = "download the data itself, not the page about it";
const FORMATS: &str = "docs/formats.md says which formats are read";
const EXPORT: &str = "export it as GeoJSON in WGS 84 from a program for maps";

/// The kind of a text.
///
/// # Errors
/// Its name, if it is not read.
pub(crate) fn kind(source: &Source) -> Result<Kind, Mistakes> {
    let text = source.text.trim_start();
    if text.is_empty() {
        return Err(wrong(source, "the file is empty", "was it downloaded or saved completely?"));
    }
    if let Some((name, help)) = foreign(text) {
        return Err(refused(&source.path, &name, help));
    }
    match text.as_bytes()[0] {
        b'<' => Ok(Kind::Xml),
        b'{' | b'[' => Ok(Kind::Json),
        _ if source.text.starts_with(wpl::BEGINNING) => Ok(Kind::Wpl),
        _ if openair::is_openair(text) => Ok(Kind::OpenAir),
        _ => Err(wrong(source, "this text is in none of the formats that are read", FORMATS)),
    }
}

/// The name of what a text is, and what to do, if it is known and not read.
pub(crate) fn foreign(text: &str) -> Option<(String, &'static str)> {
    let text = text.trim_start();
    let head: String = text.chars().take(1000).collect::<String>().to_ascii_lowercase();
    let named = |name: &str, help| Some((name.to_owned(), help));
    if head.starts_with('<') {
        let is_page = head.starts_with("<!doctype html") || head.contains("<html");
        return if is_page { named("a web page (HTML)", DATA) } else { None };
    }
    if head.starts_with('\u{1e}') {
        return named("a sequence of JSON texts (RFC 8142)", "make one FeatureCollection of its features");
    }
    if head.starts_with("multipolygon") || head.starts_with("polygon") || head.starts_with("geometrycollection") {
        return named("a geometry in WKT", EXPORT);
    }
    if is_toml(text) {
        return match toml::from_str::<toml::Table>(text) {
            Ok(table) if table.contains_key("objective") || table.contains_key("area") => {
                named("a mission file of Kittiwake", "it needs no import: give it to `kittiwake check --mission`")
            }
            _ => named("a file in TOML", FORMATS),
        };
    }
    if head.starts_with('[') && head.contains("\"document\"") {
        return named("CZML", EXPORT);
    }
    if head.starts_with('{') || head.starts_with('[') || openair::is_openair(text) {
        return None;
    }
    if is_yaml(text) {
        return named("a file in YAML", FORMATS);
    }
    if is_csv(text) { named("a table (CSV)", EXPORT) } else { None }
}

/// Whether the first line that is not a comment is a table or a key of TOML, and no list of JSON.
fn is_toml(text: &str) -> bool {
    let first = text.lines().map(str::trim).find(|it| !it.is_empty() && !it.starts_with('#')).unwrap_or_default();
    let is_key = |it: &str| {
        let it = it.trim();
        !it.is_empty() && it.chars().all(|it| it.is_alphanumeric() || "-_.\"'".contains(it))
    };
    if let Some(table) = first.strip_prefix('[') {
        let name = table.trim_start_matches('[').split(']').next().unwrap_or_default();
        return name.starts_with(|it: char| it.is_alphabetic())
            && is_key(name)
            && !["true", "false", "null"].contains(&name);
    }
    first.split_once('=').is_some_and(|(key, _)| is_key(key))
}

fn is_yaml(text: &str) -> bool {
    let first = text.lines().find(|it| !it.trim().is_empty() && !it.starts_with('#')).unwrap_or_default();
    let is_key = |it: &str| !it.is_empty() && it.chars().all(|it| it.is_alphanumeric() || "-_\"' ".contains(it));
    first.trim_end() == "---"
        || first.starts_with("%YAML")
        || first.split_once(':').is_some_and(|(key, rest)| is_key(key) && (rest.is_empty() || rest.starts_with(' ')))
}

/// Whether the first two lines have as many fields.
fn is_csv(text: &str) -> bool {
    let mut lines = text.lines();
    let (Some(first), Some(second)) = (lines.next(), lines.next()) else { return false };
    [',', ';', '\t'].iter().any(|separator| {
        let count = |line: &str| line.matches(*separator).count();
        0 < count(first) && count(first) <= count(second)
    })
}

/// Several JSON texts, one a line: what is said of them instead of where the second one begins.
pub(crate) fn json_lines(source: &Source) -> Option<Mistakes> {
    let mut lines = source.text.lines().filter(|it| !it.trim().is_empty());
    let is_object = |it: &str| serde_json::from_str::<serde::de::IgnoredAny>(it).is_ok() && it.trim().starts_with('{');
    let are_several = is_object(lines.next()?) && is_object(lines.next()?);
    let name = "a file with several JSON texts, one in each line (NDJSON)";
    are_several.then(|| refused(&source.path, name, "make one FeatureCollection of its features"))
}

/// A JSON document that is in none of the formats: by its name where it tells one.
pub(crate) fn unknown_json(source: &Source, document: &Value) -> Mistakes {
    let named = |name| refused(&source.path, name, EXPORT);
    if let Some(name) = foreign_json(document) {
        return named(name);
    }
    let help = "a plan has `fileType`, GeoJSON and ED-318 have `type`, ED-269 has `UASZoneList` or `features`";
    wrong(source, "this JSON is in none of the formats that are read", help)
}

/// The name of another format in JSON.
pub(crate) fn foreign_json(document: &Value) -> Option<&'static str> {
    let has = |key: &str| document.get(key).is_some();
    let text = |key: &str| document.get(key).and_then(Value::as_str).unwrap_or_default();
    if text("type") == "Topology" {
        return Some("TopoJSON");
    }
    if text("geometryType").starts_with("esriGeometry") || (has("spatialReference") && has("features")) {
        return Some("Esri JSON");
    }
    if has("osm3s") {
        return Some("a reply of the Overpass interface of OpenStreetMap");
    }
    None
}

fn wrong(source: &Source, message: &str, help: &str) -> Mistakes {
    let (message, help) = (message.to_owned(), help.to_owned());
    Mistakes(vec![Mistake { path: source.path.clone(), place: None, message, help }])
}
