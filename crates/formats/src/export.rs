//! A mission on the Earth, for the formats that it is written in.

use std::time::{Duration, UNIX_EPOCH};

use domain::area::{Area, AreaKind};
use domain::file::Source;
use domain::geodesy::{LatLon, LocalFrame, Origin};
use domain::mission::terms::{Order, Terms};
use domain::mission::{Mission, Objective};

use crate::findings::{Findings, Note};

/// A mission whose places are known in WGS 84.
pub(crate) struct Geographic<'a> {
    pub(crate) name: &'a str,
    pub(crate) origin: Origin,
    pub(crate) objectives: Vec<(&'a Objective, LatLon)>,
    pub(crate) areas: Vec<(&'a Area, Vec<LatLon>)>,
}

/// What a mission can be written as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// GeoJSON, RFC 7946.
    GeoJson,
    /// A plan of QGroundControl.
    Plan,
}

/// The mission of `source` in another format, and what that format cannot say; the place of a note is a name in the mission.
pub fn export(source: &Source, mission: &Mission, origin: Origin, target: Target) -> (String, Vec<Note>) {
    let frame = LocalFrame::at(origin.place);
    let geographic = Geographic {
        name: &mission.name,
        origin,
        objectives: mission.objectives.iter().map(|it| (it, frame.lat_lon(it.position))).collect(),
        areas: mission
            .areas
            .iter()
            .map(|it| (it, it.corners.iter().map(|corner| frame.lat_lon(*corner)).collect()))
            .collect(),
    };
    let mut findings = Findings::about(&source.path);
    if mission.order != Order::Given {
        findings.note("order", "that the order is free has no counterpart: it becomes the order of the file");
    }
    for objective in mission.objectives.iter().filter(|it| it.terms != Terms::default()) {
        findings
            .note(&objective.name, "what is asked besides its place (after, worth, time limits, dwell_s) is left out");
    }
    let text = match target {
        Target::GeoJson => crate::geojson::write(&geographic),
        Target::Plan => crate::qgc::write(&geographic, &mut findings),
    };
    (text, findings.into_notes())
}

/// Degrees to a tenth of a millimetre on the ground: what is beyond it is not meant.
pub(crate) fn degrees(degrees: f64) -> f64 {
    // Adding zero turns a negative zero into a positive one.
    (degrees * 1e9).round() / 1e9 + 0.0
}

/// The word for a kind of area in a mission file.
pub(crate) fn kind(kind: AreaKind) -> &'static str {
    match kind {
        AreaKind::Permission => "permission",
        AreaKind::KeepOut => "keep-out",
    }
}

/// A moment as a mission file has it.
pub(crate) fn utc(ms: i64) -> String {
    let since_epoch = Duration::from_millis(u64::try_from(ms).unwrap_or_default());
    humantime::format_rfc3339(UNIX_EPOCH + since_epoch).to_string()
}
