//! Airspace as text in OpenAir: a line for each fact, a zone from one `AC` to the next.
//!
//! The format is for gliders and knows no rule for drones: the classes in [`RULES`] are read by what a drone needs there. A class that
//! is not in it is a keep-out area. A line that cannot be read costs its zone, and the others are read.

use std::collections::BTreeMap;

use domain::geodesy::LatLon;

use crate::arcs::{Arc, MOST_PARTS, Piece, ring, seen_from};
use crate::content::{Content, Doubt, Height, Lost, Outline, Rule, Zone};
use crate::findings::{Findings, Wrong};
use crate::heights::Limit;
use crate::json::short;
use crate::shape;

mod values;

/// What a class (`AC`) or a type (`AY`) asks of a drone; `None`: nothing.
const RULES: [(&[&str], Option<Rule>); 3] = [
    (&["P", "PROHIBITED"], Some(Rule::KeepOut)),
    (
        &[
            "R",
            "RESTRICTED",
            "Q",
            "DANGER",
            "A",
            "B",
            "C",
            "D",
            "F",
            "CTR",
            "CTA",
            "TMA",
            "ATZ",
            "MATZ",
            "TMZ",
            "RMZ",
            "TIZ",
            "TIA",
            "ZRT",
            "TRA",
            "TSA",
            "TFR",
            "NSA",
            "ALERT",
            "MTA",
            "MTR",
            "HTZ",
            "LTA",
            "AWY",
            "MOA",
            "RAS",
            "UAS",
        ],
        Some(Rule::Permission),
    ),
    (
        &["E", "G", "W", "GP", "GSEC", "GLIDING", "UNC", "UNCLASSIFIED", "NONE", "FIR", "UIR", "FIS", "ASR", "VFRSEC"],
        None,
    ),
];
/// What limits no flight by itself: labels, frequencies, pens. `AA` has times: without them the area always applies.
const NOT_READ: [&str; 8] = ["AT", "AF", "AG", "AI", "AX", "AA", "SP", "SB"];
/// With these begins a drawing of the terrain.
const TERRAIN: [&str; 2] = ["TO", "TC"];
/// With these begins a text, or a zone in it.
const FIRST: [&str; 6] = ["AC", "AY", "AN", "AI", "SP", "TO"];

/// Whether a text is in the format: its first line that is not a comment is a record, and there is a class.
pub(crate) fn is_openair(text: &str) -> bool {
    let mut lines = text.lines().map(str::trim).filter(|it| !it.is_empty() && !it.starts_with(['*', '#']));
    let is_record = |it: &str| FIRST.contains(&record(it).0);
    lines.next().is_some_and(is_record) && text.lines().any(|it| record(it.trim()).0 == "AC")
}

/// The letters with which a line begins, and what follows them.
fn record(line: &str) -> (&str, &str) {
    let (key, rest) = line.split_once([' ', '\t']).unwrap_or((line, ""));
    (key, rest.trim())
}

/// Reads all zones of a text.
pub(crate) fn read(text: &str, findings: &mut Findings) -> Content {
    let mut content = Content::default();
    let mut not_read: BTreeMap<&str, usize> = BTreeMap::new();
    let mut block: Option<Block> = None;
    for (index, line) in text.lines().enumerate() {
        // Comments stand in lines of their own, and some behind a record.
        let line = line.split('*').next().unwrap_or_default().trim();
        let (key, value) = record(line);
        if key.is_empty() || key.starts_with('#') {
            continue;
        }
        if key == "AC" {
            finish(block.take(), &mut content, findings);
            if let Some(wrong) = content.too_many(|| format!("line {}", index + 1)) {
                findings.wrong(wrong);
                break;
            }
            block = Some(Block::new(index + 1, value));
            continue;
        }
        if TERRAIN.contains(&key) {
            finish(block.take(), &mut content, findings);
        }
        match (&mut block, NOT_READ.iter().find(|it| **it == key)) {
            (_, Some(known)) => *not_read.entry(known).or_default() += 1,
            (Some(block), None) => block.line(index + 1, key, value),
            (None, None) => *not_read.entry("lines outside of a zone").or_default() += 1,
        }
    }
    finish(block, &mut content, findings);
    for (key, count) in not_read {
        findings.note("", format!("{key}, {count} times: not read"));
    }
    content
}

fn finish(block: Option<Block>, content: &mut Content, findings: &mut Findings) {
    let Some(block) = block else { return };
    let place = block.place.clone();
    match block.zones(findings) {
        Ok(zones) if zones.is_empty() => {
            findings.note(&place, "its class asks nothing of a drone: left out");
        }
        Ok(zones) => content.zones.extend(zones),
        Err(lost) => content.lost.push(lost),
    }
}

/// The lines of one zone.
struct Block {
    place: String,
    class: String,
    kind: Option<String>,
    name: Option<String>,
    lower: Option<Height>,
    upper: Option<Height>,
    has_upper: bool,
    doubts: Vec<Doubt>,
    centre: Option<LatLon>,
    is_counterclockwise: bool,
    border: Vec<Piece>,
    circles: Vec<Outline>,
    wrong: Option<Wrong>,
}

impl Block {
    fn new(line: usize, class: &str) -> Block {
        Block {
            place: format!("line {line}"),
            class: class.to_ascii_uppercase(),
            kind: None,
            name: None,
            lower: None,
            upper: None,
            has_upper: false,
            doubts: Vec::new(),
            centre: None,
            is_counterclockwise: false,
            border: Vec::new(),
            circles: Vec::new(),
            wrong: None,
        }
    }

    fn line(&mut self, number: usize, key: &str, value: &str) {
        let place = format!("line {number}");
        let doubt = |message: String| Doubt { place: place.clone(), message };
        match key {
            "AN" => self.name = Some(value.to_owned()),
            "AY" => self.kind = Some(value.to_ascii_uppercase()),
            "AL" => match values::limit(value).and_then(Limit::as_lower) {
                Ok(lower) => self.lower = lower,
                Err(message) => self.doubts.push(doubt(message)),
            },
            "AH" => {
                self.has_upper = true;
                match values::limit(value).and_then(Limit::as_upper) {
                    Ok(upper) => self.upper = upper,
                    Err(message) => self.doubts.push(doubt(message)),
                }
            }
            _ => {
                let help = "correct the line, or leave the zone out";
                if let Err(message) = self.shape(key, value)
                    && self.wrong.is_none()
                {
                    self.wrong = Some(Wrong::at(place, message, help));
                }
            }
        }
    }

    /// A line that draws the border.
    fn shape(&mut self, key: &str, value: &str) -> Result<(), String> {
        if MOST_PARTS < self.border.len() {
            return Err(format!("a border of more than {MOST_PARTS} parts"));
        }
        let centre = || self.centre.ok_or_else(|| "no centre (V X=) before it".to_owned());
        match key {
            "V" => {
                let (variable, value) = value.split_once('=').ok_or("expected V X=.. or V D=..")?;
                match (variable.trim(), value.trim()) {
                    ("X" | "x", place) => self.centre = Some(values::place(place)?),
                    ("D" | "d", "+") => self.is_counterclockwise = false,
                    ("D" | "d", "-") => self.is_counterclockwise = true,
                    // The width of an airway, whose line is not read, and how near a map shows the zone.
                    ("W" | "w" | "Z" | "z", _) => {}
                    (other, _) => return Err(format!("the variable `{}` is not known", short(other))),
                }
            }
            "DP" => self.border.push(Piece::Corner(values::place(value)?)),
            "DC" => {
                let circle = shape::circle(centre()?, values::miles(value)?, "").map_err(|it| it.message)?;
                self.circles.push(circle);
            }
            "DA" => {
                let [radius, from, to] = values::list(value).ok_or("expected a radius and two angles")?;
                let radius_m = values::miles(radius)?;
                shape::circle(centre()?, radius_m, "").map_err(|it| it.message)?;
                let [from_deg, to_deg] = [values::degrees(from)?, values::degrees(to)?];
                let (centre, radii_m) = (centre()?, [radius_m; 2]);
                let sweep_deg = self.sweep_deg(from_deg, to_deg);
                self.border.push(Piece::Arc(Arc { centre, radii_m, from_deg, sweep_deg }));
            }
            "DB" => {
                let [from, to] = values::list(value).ok_or("expected two places, with a comma between them")?;
                let [from, to] = [values::place(from)?, values::place(to)?];
                let centre = centre()?;
                let ((first_m, from_deg), (last_m, to_deg)) = (seen_from(centre, from), seen_from(centre, to));
                shape::circle(centre, first_m.max(last_m), "").map_err(|it| it.message)?;
                let (radii_m, sweep_deg) = ([first_m, last_m], self.sweep_deg(from_deg, to_deg));
                self.border.push(Piece::Corner(from));
                self.border.push(Piece::Arc(Arc { centre, radii_m, from_deg, sweep_deg }));
                self.border.push(Piece::Corner(to));
            }
            other => return Err(format!("the record `{}` is not known", short(other))),
        }
        Ok(())
    }

    fn sweep_deg(&self, from_deg: f64, to_deg: f64) -> f64 {
        let clockwise = (to_deg - from_deg).rem_euclid(360.0);
        // From an angle to itself is the whole circle.
        match (clockwise == 0.0, self.is_counterclockwise) {
            (true, false) => 360.0,
            (true, true) => -360.0,
            (false, false) => clockwise,
            (false, true) => clockwise - 360.0,
        }
    }

    /// What the class and the type ask for together.
    fn rule(&mut self) -> Option<Rule> {
        let mut strictest = None;
        for said in std::iter::once(&self.class).chain(&self.kind) {
            match RULES.iter().find(|(names, _)| names.contains(&said.as_str())) {
                Some((_, Some(Rule::KeepOut))) => strictest = Some(Rule::KeepOut),
                Some((_, rule)) => strictest = strictest.or(*rule),
                None => {
                    let message = format!("the class `{}` is not known", short(said));
                    self.doubts.push(Doubt { place: self.place.clone(), message });
                    strictest = Some(Rule::KeepOut);
                }
            }
        }
        strictest
    }

    fn zones(mut self, findings: &mut Findings) -> Result<Vec<Zone>, Lost> {
        let Some(rule) = self.rule() else { return Ok(Vec::new()) };
        if !self.has_upper && self.wrong.is_none() {
            self.doubts.push(Doubt { place: self.place.clone(), message: "it has no upper limit (AH)".into() });
        }
        let corners = ring(&self.border);
        let circles =
            self.circles.iter().map(|it| if let Outline::Circle { centre, .. } = it { Some(*centre) } else { None });
        let places: Vec<LatLon> = corners.iter().copied().chain(circles.flatten()).chain(self.centre).collect();
        let lost = |wrong| Lost { wrong, places: places.clone() };
        if let Some(wrong) = self.wrong.take() {
            return Err(lost(wrong));
        }
        let mut outlines = std::mem::take(&mut self.circles);
        if !corners.is_empty() || outlines.is_empty() {
            // A ring that ends where it begins needs no word here.
            let mut corners = corners;
            if corners.len() > 1 && corners.first() == corners.last() {
                corners.pop();
            }
            outlines.push(Outline::polygon(shape::open_ring(corners, &self.place, findings).map_err(lost)?));
        }
        let name = self.name.unwrap_or_else(|| format!("{} in {}", self.class, self.place));
        let kind = self.kind.iter().map(|it| format!("Type: {it}"));
        let remarks: Vec<String> = std::iter::once(format!("Class: {}", self.class)).chain(kind).collect();
        let zone = |outline| Zone {
            lower: self.lower,
            upper: self.upper,
            remarks: remarks.clone(),
            doubts: self.doubts.clone(),
            ..Zone::always(name.clone(), rule, outline, self.place.clone())
        };
        Ok(outlines.into_iter().map(zone).collect())
    }
}
