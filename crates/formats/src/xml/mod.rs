//! Files in XML: which format it is stands in the root element.

use std::path::Path;

use domain::file::{Mistake, Mistakes, Source};
use roxmltree::{Document, Error, Node, ParsingOptions};

use crate::Format;
use crate::bytes::refused;
use crate::content::Content;
use crate::findings::Findings;
use crate::json::short;

mod airspace_types;
mod aixm;
mod bounds;
mod gml;
pub(crate) mod kml;
mod limits;
mod timesheet;

/// The most elements and texts of a document: one needs some hundred bytes of memory.
const MOST_NODES: u32 = 10_000_000;
const FORMATS: &str = "docs/formats.md says which formats are read";

/// Root elements of formats that are not read.
const FOREIGN: [(&str, &str, &str); 11] = [
    ("gpx", "GPX", "it has ways and places without a rule: draw areas in GeoJSON, and a mission as a plan"),
    ("svg", "a drawing (SVG)", FORMATS),
    ("html", "a web page (HTML)", "download the data itself, not the page about it"),
    (
        "ExceptionReport",
        "an error report of a map server (WFS)",
        "ask the server again; what it says stands in the file",
    ),
    (
        "ServiceExceptionReport",
        "an error report of a map server (WFS)",
        "ask the server again; what it says stands in the file",
    ),
    ("WFS_Capabilities", "a list of what a map server has (WFS)", "download one of its layers, as GeoJSON in WGS 84"),
    ("AIXM-Snapshot", "AIXM 4.5", "ask for AIXM 5.1, ED-269 or ED-318"),
    ("AIXM-update", "AIXM 4.5", "ask for AIXM 5.1, ED-269 or ED-318"),
    ("osm", "a map of OpenStreetMap", FORMATS),
    ("FeatureCollection", "GML", "export it as GeoJSON in WGS 84 from a program for maps"),
    ("TrainingCenterDatabase", "a track (TCX)", FORMATS),
];

/// Reads a document.
///
/// # Errors
/// If it is not XML, or in a format that is not read.
pub(crate) fn read(source: &Source, findings: &mut Findings) -> Result<(Format, Content), Mistakes> {
    let document = parse(&source.path, &source.text)?;
    let lines = Lines::of(&source.text, None);
    let root = document.root_element();
    let mut content = Content::default();
    if kml::is_root(root) {
        kml::read(&document, &lines, &[], &mut content, findings);
        return Ok((Format::Kml, content));
    }
    let name = root.tag_name().name();
    if name == "AIXMBasicMessage" || document.descendants().any(|it| it.has_tag_name_of("Airspace")) {
        aixm::read(&document, &lines, &mut content, findings);
        return Ok((Format::Aixm, content));
    }
    Err(match FOREIGN.iter().find(|it| it.0 == name) {
        Some((_, name, help)) => refused(&source.path, name, help),
        None => refused(&source.path, &format!("XML with the root element `{}`", short(name)), FORMATS),
    })
}

/// The KML files of an archive. Those that a link names are there.
///
/// # Errors
/// If one is not KML.
pub(crate) fn read_inside(
    path: &Path,
    files: &[crate::archive::Inside],
    findings: &mut Findings,
) -> Result<Content, Mistakes> {
    let mut content = Content::default();
    let names: Vec<&str> = files.iter().map(|it| it.name.as_str()).collect();
    for file in files {
        let place = path.join(file.name.replace('/', "_"));
        let document = parse(&place, file.text.trim_start_matches('\u{feff}'))?;
        if !kml::is_root(document.root_element()) {
            let name = document.root_element().tag_name().name();
            return Err(refused(&place, &format!("XML with the root element `{}`", short(name)), "expected `kml`"));
        }
        let lines = Lines::of(document.input_text(), Some(&file.name).filter(|_| 1 < files.len()).cloned());
        kml::read(&document, &lines, &names, &mut content, findings);
    }
    Ok(content)
}

/// Parses a document. Entities and document type definitions are refused: they may multiply a text, or name another file.
fn parse<'a>(path: &Path, text: &'a str) -> Result<Document<'a>, Mistakes> {
    if !bounds::is_bounded(text) {
        let message =
            "an element has more than 200 attributes, or the file more than 200 prefixes of namespaces".into();
        let help = FORMATS.into();
        return Err(Mistakes(vec![Mistake { path: path.to_owned(), place: None, message, help }]));
    }
    let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    Document::parse_with_options(text, options).map_err(|error| {
        let (message, help) = match error {
            Error::DtdDetected => (
                "it has a document type definition (`<!DOCTYPE`), which is not read".into(),
                "remove it; the formats that are read need none",
            ),
            Error::UnknownEntityReference(name, at) => (
                format!("line {} column {}: the entity `&{};` is not known", at.row, at.col, short(&name)),
                "write the character itself",
            ),
            Error::NodesLimitReached => (format!("it has more than {MOST_NODES} elements and texts"), "cut it down"),
            other => (format!("no valid XML: {other}"), "was it downloaded or saved completely?"),
        };
        Mistakes(vec![Mistake { path: path.to_owned(), place: None, message, help: help.into() }])
    })
}

/// Where lines begin: a node's line is searched for, not counted from the start for each.
struct Lines {
    starts: Vec<usize>,
    /// The file in an archive of several.
    file: Option<String>,
}

impl Lines {
    fn of(text: &str, file: Option<String>) -> Lines {
        let starts = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        Lines { starts, file }
    }

    fn place(&self, node: Node<'_, '_>) -> String {
        self.place_at(node.range().start)
    }

    fn place_at(&self, at: usize) -> String {
        let line = self.starts.partition_point(|start| *start <= at);
        let column = at - self.starts[line - 1] + 1;
        let file = self.file.as_ref().map(|it| format!("{it}: ")).unwrap_or_default();
        format!("{file}line {line} column {column}")
    }
}

/// The children of this name.
fn all<'a, 'd>(node: Node<'a, 'd>, name: &'static str) -> impl Iterator<Item = Node<'a, 'd>> {
    node.children().filter(move |it| it.has_tag_name_of(name))
}

/// Names of elements in any edition of a format: publishers use several namespaces, or none.
trait LocalName<'a, 'd> {
    fn has_tag_name_of(&self, name: &str) -> bool;
    fn child(&self, name: &str) -> Option<Node<'a, 'd>>;
    fn words(&self) -> String;
    fn child_words(&self, name: &str) -> Option<String>;
    fn attribute_of(&self, name: &str) -> Option<&'a str>;
}

impl<'a, 'd> LocalName<'a, 'd> for Node<'a, 'd> {
    fn has_tag_name_of(&self, name: &str) -> bool {
        self.is_element() && self.tag_name().name() == name
    }

    fn child(&self, name: &str) -> Option<Node<'a, 'd>> {
        self.children().find(|it| it.has_tag_name_of(name))
    }

    /// All text straight in it: comments and CDATA divide a text into several.
    fn words(&self) -> String {
        let text: String = self.children().filter(Node::is_text).filter_map(|it| it.text()).collect();
        text.trim().to_owned()
    }

    /// The text of a child; an empty one is not there.
    fn child_words(&self, name: &str) -> Option<String> {
        self.child(name).map(|it| it.words()).filter(|it| !it.is_empty())
    }

    /// An attribute in any namespace.
    fn attribute_of(&self, name: &str) -> Option<&'a str> {
        self.attributes().find(|it| it.name() == name).map(|it| it.value())
    }
}
