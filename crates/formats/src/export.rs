//! A mission on the Earth, for the formats that it is written in.

use std::time::{Duration, UNIX_EPOCH};

use domain::area::{Area, AreaKind};
use domain::file::Source;
use domain::geodesy::{LatLon, LocalFrame, Origin};
use domain::geometry::Ned;
use domain::mission::terms::Order;
use domain::mission::{Mission, Objective};
use domain::site::Site;

use crate::findings::{Findings, Note};

/// A mission whose places are known in WGS 84.
pub(crate) struct Geographic<'a> {
    pub(crate) name: &'a str,
    pub(crate) origin: Origin,
    /// Each with its places: its position, or each turn of its survey.
    pub(crate) objectives: Vec<(&'a Objective, Vec<LatLon>)>,
    /// The corners of a survey, and of any polygon else.
    pub(crate) frame: LocalFrame,
    pub(crate) order: Order,
    pub(crate) route: &'a [Leg],
    /// Each with its rings, the outline first.
    pub(crate) areas: Vec<(&'a Area, Vec<Vec<LatLon>>)>,
    pub(crate) sites: Vec<(&'a Site, LatLon)>,
}

/// A leg of the way that would be flown, for formats that can show one.
#[derive(Debug, Clone, PartialEq)]
pub struct Leg {
    /// The objective it leads to.
    pub objective: String,
    /// In words.
    pub text: String,
    /// Where it begins and ends, in the mission's frame.
    pub way: (Ned, Ned),
    /// When it begins, in seconds after the first takeoff.
    pub begins_s: f64,
    /// How long it takes, in seconds.
    pub time_s: f64,
}

/// What a mission can be written as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// GeoJSON, RFC 7946.
    GeoJson,
    /// A plan of QGroundControl.
    Plan,
}

/// The mission of `source` in another format, with its `route` where that can show one, and what that format cannot say; the place
/// of a note is a name in the mission.
pub fn export(
    source: &Source,
    mission: &Mission,
    origin: Origin,
    target: Target,
    route: &[Leg],
) -> (String, Vec<Note>) {
    let frame = LocalFrame::at(origin.place);
    let geographic = Geographic {
        name: &mission.name,
        origin,
        objectives: mission.objectives.iter().map(|it| (it, on_earth(&it.places(), frame))).collect(),
        frame,
        order: mission.order,
        route,
        areas: mission.areas.iter().map(|it| (it, it.rings().map(|ring| on_earth(ring, frame)).collect())).collect(),
        sites: mission.sites.iter().map(|it| (it, frame.lat_lon(it.position))).collect(),
    };
    let mut findings = Findings::about(&source.path);
    let text = match target {
        Target::GeoJson => crate::geojson::write(&geographic),
        Target::Plan => crate::plan::write(&geographic, &mut findings),
    };
    for feed in &mission.feeds {
        findings.note(&feed.name, "the edition of a data set is not written: its areas become the mission's own");
    }
    (text, findings.into_notes())
}

/// These places on the Earth.
pub(crate) fn on_earth(places: &[Ned], frame: LocalFrame) -> Vec<LatLon> {
    places.iter().map(|it| frame.lat_lon(*it)).collect()
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
