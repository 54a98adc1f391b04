//! Airspace from AIXM 5.1. It is made for aircraft with pilots: `airspace_types` has what a type asks of a drone.
//!
//! A time slice is one version of an airspace and becomes zones of its own. Nothing takes the place of anything: a change adds to what
//! it changes, so that no order of versions can open an area too early. A change that draws nothing makes all of the airspace doubtful.

use std::collections::{BTreeMap, HashMap};

use roxmltree::{Document, Node};

use super::{Lines, LocalName as _, airspace_types, all, gml, limits};
use crate::applicability::{Side, bound_of, checked};
use crate::content::{Content, Doubt, Lost, Outline, Rule, Unused, Window, Zone};
use crate::findings::{Findings, Wrong};
use crate::heights::Limit;
use crate::json::short;
use crate::xml::timesheet::Active;

/// Airspace that is drawn by other airspace, which is drawn by other airspace.
const MOST_LINKS: usize = 8;
/// The most links from one airspace to another that are followed in a file.
const MOST_FOLLOWED: usize = 10_000;

/// Reads a document.
pub(super) fn read(document: &Document<'_>, lines: &Lines, content: &mut Content, findings: &mut Findings) {
    let mut features = Vec::new();
    let mut others: BTreeMap<&str, usize> = BTreeMap::new();
    let mut read_until = 0;
    for node in document.descendants().filter(Node::is_element) {
        let range = node.range();
        let is_feature = node.parent().is_some_and(|it| it.tag_name().name().ends_with("ember"));
        let name = node.tag_name().name();
        if range.start < read_until || !(is_feature || name == "Airspace") {
            continue;
        }
        read_until = range.end;
        match name {
            "Airspace" => features.push(node),
            // Masts and towers limit a flight, and are not areas.
            "VerticalStructure" => content.unused.push(Unused { what: name.into(), source: lines.place(node) }),
            _ => *others.entry(name).or_default() += 1,
        }
    }
    for (name, count) in others {
        findings.note("", format!("{}, {count} times: not read", short(name)));
    }
    let mut reader =
        Reader { lines, left: MOST_FOLLOWED, named: features.iter().flat_map(|it| names(*it)).collect(), findings };
    for feature in features {
        reader.airspace(feature, content);
        if let Some(wrong) = content.too_many(|| lines.place(feature)) {
            reader.findings.wrong(wrong);
            break;
        }
    }
}

/// By which a link may name an airspace.
fn names<'a>(feature: Node<'a, 'a>) -> impl Iterator<Item = (String, Node<'a, 'a>)> {
    let identifier = feature.child_words("identifier");
    let id = feature.attribute_of("id").map(str::to_owned);
    identifier.into_iter().chain(id).map(move |it| (it, feature))
}

fn slices<'a>(feature: Node<'a, 'a>) -> Vec<Node<'a, 'a>> {
    let slices: Vec<_> = all(feature, "timeSlice").flat_map(|it| all(it, "AirspaceTimeSlice")).collect();
    // Some publishers write the airspace without its versions.
    if slices.is_empty() { vec![feature] } else { slices }
}

struct Reader<'a> {
    lines: &'a Lines,
    named: HashMap<String, Node<'a, 'a>>,
    /// Links that may still be followed.
    left: usize,
    findings: &'a mut Findings,
}

/// What is the same in all parts of a time slice.
struct Head {
    name: String,
    rule: Rule,
    remarks: Vec<String>,
    doubts: Vec<Doubt>,
}

impl<'a> Reader<'a> {
    fn airspace(&mut self, feature: Node<'a, 'a>, content: &mut Content) {
        let slices = slices(feature);
        // A change has only what changes: the rest is in another version.
        let known: BTreeMap<&str, String> = ["type", "designator", "name", "localType"]
            .into_iter()
            .filter_map(|name| Some((name, slices.iter().find_map(|it| it.child_words(name))?)))
            .collect();
        let any = |slice: Node<'a, 'a>, name| slice.child_words(name).or_else(|| known.get(name).cloned());
        let lost_at_first = content.lost.len();
        let mut zones = Vec::new();
        let mut changes = Vec::new();
        for slice in &slices {
            let Some(head) = self.head(*slice, |name| any(*slice, name)) else { return };
            let (before, lost_before) = (zones.len(), content.lost.len());
            self.slice(*slice, &head, &mut zones, &mut content.lost);
            if zones.len() == before && content.lost.len() == lost_before {
                let place = self.lines.place(*slice);
                let interpretation = slice.child_words("interpretation").unwrap_or_default();
                let message =
                    format!("a version ({}) of `{}` without a shape", short(&interpretation), short(&head.name));
                changes.push(Doubt { place, message });
            }
        }
        // One of the changes stands for all.
        if let Some(change) = changes.into_iter().next() {
            if zones.is_empty() && content.lost.len() == lost_at_first {
                let wrong = Wrong::at(&change.place, &change.message, "leave the airspace out");
                content.lost.push(Lost { wrong, places: Vec::new() });
            }
            for zone in &mut zones {
                (zone.lower, zone.upper, zone.periods) = (None, None, vec![Default::default()]);
                zone.doubts.push(change.clone());
            }
        }
        content.zones.extend(zones);
    }

    /// `None`: it asks nothing of a drone.
    fn head(&mut self, slice: Node<'a, 'a>, any: impl Fn(&'static str) -> Option<String>) -> Option<Head> {
        let place = self.lines.place(slice);
        let kind = any("type");
        let mut doubts = Vec::new();
        let rule = airspace_types::rule(kind.as_deref()).unwrap_or_else(|message| {
            doubts.push(Doubt { place: place.clone(), message });
            Some(Rule::KeepOut)
        });
        let Some(rule) = rule else {
            let text =
                format!("airspace of type {} limits no flight by itself: left out", short(&kind.unwrap_or_default()));
            self.findings.note(&place, text);
            return None;
        };
        let name = any("designator").or_else(|| any("name")).unwrap_or_else(|| format!("airspace in {place}"));
        let remark = |(title, value): (&str, Option<String>)| value.map(|it| format!("{title}: {it}"));
        let all = [("Name", any("name")), ("Type", kind), ("Local type", any("localType"))];
        Some(Head { name, rule, remarks: all.into_iter().filter_map(remark).collect(), doubts })
    }

    fn slice(&mut self, slice: Node<'a, 'a>, head: &Head, zones: &mut Vec<Zone>, lost: &mut Vec<Lost>) {
        let mut doubts = head.doubts.clone();
        let window = self.window(slice).unwrap_or_else(|wrong| {
            doubts.push(Doubt { place: wrong.place, message: wrong.message });
            Window::default()
        });
        let mut drawn: Vec<Zone> = Vec::new();
        for volume in self.volumes(slice) {
            let mut doubts = doubts.clone();
            let [lower, upper] = self.limits(volume, &mut doubts);
            for shape in self.shapes(volume, MOST_LINKS, lost) {
                let gml::Shape { outline, source } = shape;
                let (remarks, doubts) = (head.remarks.clone(), doubts.clone());
                drawn.push(Zone {
                    lower,
                    upper,
                    remarks,
                    doubts,
                    ..Zone::always(&head.name, head.rule, outline, source)
                });
            }
        }
        let outlines: Vec<Outline> = drawn.iter().map(|it| it.outline.clone()).collect();
        let (mut remarks, mut doubts) = (Vec::new(), Vec::new());
        let active = Active { slice, window, outlines };
        let periods = active.periods(self.lines, &mut remarks, &mut doubts, self.findings);
        for zone in &mut drawn {
            zone.periods.clone_from(&periods);
            zone.remarks.extend(remarks.iter().cloned());
            zone.doubts.extend(doubts.iter().cloned());
        }
        zones.extend(drawn);
    }

    /// The volumes that an airspace is put together of.
    fn volumes(&mut self, slice: Node<'a, 'a>) -> Vec<Node<'a, 'a>> {
        let components: Vec<_> =
            all(slice, "geometryComponent").flat_map(|it| all(it, "AirspaceGeometryComponent")).collect();
        if components.is_empty() {
            return vec![slice];
        }
        let mut volumes = Vec::new();
        for component in components {
            let operation = component.child_words("operation");
            if let Some(operation @ ("SUBTR" | "INTERS")) = operation.as_deref() {
                let text = format!(
                    "a volume that makes the airspace smaller ({operation}): not read, the area is the larger one"
                );
                self.findings.note(&self.lines.place(component), text);
                continue;
            }
            volumes.extend(all(component, "theAirspaceVolume").flat_map(|it| all(it, "AirspaceVolume")));
        }
        volumes
    }

    fn limits(&self, volume: Node<'a, 'a>, doubts: &mut Vec<Doubt>) -> [Option<crate::content::Height>; 2] {
        // With a second limit the one that counts depends on the place.
        let limit = |name: &str, second: &str| {
            if volume.child_words(second).is_some() { Ok(None) } else { limits::read(volume, name) }
        };
        let lower = limit("lowerLimit", "minimumLimit").and_then(|it| it.map_or(Ok(None), Limit::as_lower));
        let upper = limit("upperLimit", "maximumLimit").and_then(|it| it.map_or(Ok(None), Limit::as_upper));
        [lower, upper].map(|it| {
            it.unwrap_or_else(|message| {
                doubts.push(Doubt { place: self.lines.place(volume), message });
                None
            })
        })
    }

    /// The shapes of a volume, or of the airspace that it takes its shape from.
    fn shapes(&mut self, volume: Node<'a, 'a>, links: usize, lost: &mut Vec<Lost>) -> Vec<gml::Shape> {
        let before = lost.len();
        let mut shapes = gml::shapes(volume, self.lines, lost, self.findings);
        let parts = all(volume, "contributorAirspace").flat_map(|it| all(it, "AirspaceVolumeDependency"));
        for part in parts.flat_map(|it| all(it, "theAirspace")) {
            let place = self.lines.place(part);
            let link = part.attribute_of("href").unwrap_or_default();
            let name = link.trim_start_matches("urn:uuid:").trim_start_matches('#').trim_start_matches("uuid.");
            let found = self.named.get(name).or_else(|| self.named.get(link.trim_start_matches('#'))).copied();
            let (Some(feature), true, true) = (found, 0 < links, 0 < self.left) else {
                let message = format!("its shape is that of the airspace `{}`, which is not in the file", short(link));
                lost.push(Lost { wrong: Wrong::at(place, message, "leave the zone out"), places: Vec::new() });
                continue;
            };
            self.left -= 1;
            for slice in slices(feature) {
                for volume in self.volumes(slice) {
                    shapes.extend(self.shapes(volume, links - 1, lost));
                }
            }
        }
        let has_line = volume.child("centreline").is_some();
        if shapes.is_empty() && lost.len() == before && has_line {
            let message = "a corridor along a line is not read";
            lost.push(Lost {
                wrong: Wrong::at(self.lines.place(volume), message, "leave the zone out"),
                places: Vec::new(),
            });
        }
        shapes
    }

    /// When a time slice is valid.
    fn window(&self, slice: Node<'a, 'a>) -> Result<Window, Wrong> {
        let Some(valid) = slice.child("validTime") else { return Ok(Window::default()) };
        let place = self.lines.place(valid);
        let Some(period) = valid.child("TimePeriod") else { return Ok(Window::default()) };
        let bound = |name, side| {
            let text = period.child_words(name);
            let read = text.map(|it| bound_of(&it, side)).transpose();
            read.map_err(|message| Wrong::at(&place, message, "write it like 2026-05-01T08:00:00Z"))
        };
        let window = Window {
            from_utc_ms: bound("beginPosition", Side::From)?,
            until_utc_ms: bound("endPosition", Side::Until)?,
        };
        checked(window, &place)
    }
}
