//! What the files of all formats say, in one form: places in WGS 84, heights with the reference they were given in.

use domain::geodesy::{LatLon, Origin};
use domain::hours::WeeklyHours;
use domain::mission::terms::{Order, Terms};
use domain::site::SiteKind;

/// What one file says.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Content {
    /// The take-off point.
    pub origin: Option<Origin>,
    /// In the order they are flown to.
    pub waypoints: Vec<Waypoint>,
    /// In the order of the file.
    pub zones: Vec<Zone>,
    /// In which order the places are flown to.
    pub order: Order,
    /// Where a flight may end early.
    pub sites: Vec<Site>,
}

/// A place to fly to.
#[derive(Debug, Clone, PartialEq)]
pub struct Waypoint {
    /// Made unique when a mission is written.
    pub name: String,
    /// Where; `None`: the take-off point.
    pub at: Option<LatLon>,
    /// How high.
    pub height: Height,
    /// In the air, or on the ground.
    pub flying: bool,
    /// What is asked of it besides.
    pub terms: Terms,
    /// A polygon to be flown over, in place of the place.
    pub survey: Option<Survey>,
    /// Its place in the file.
    pub source: String,
}

/// A place to come down at.
#[derive(Debug, Clone, PartialEq)]
pub struct Site {
    /// Made unique when a mission is written.
    pub name: String,
    /// Where.
    pub at: LatLon,
    /// Of the ground there.
    pub height: Height,
    /// What happens to a vehicle there.
    pub kind: SiteKind,
    /// Its place in the file.
    pub source: String,
}

/// A polygon to be flown over line by line.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// The corners in order, not closed.
    pub corners: Vec<LatLon>,
    /// Between the lines.
    pub spacing_m: f64,
    /// Of the lines, clockwise from north.
    pub heading_deg: Option<f64>,
}

/// Airspace with a rule.
#[derive(Debug, Clone, PartialEq)]
pub struct Zone {
    /// Made unique when a mission is written.
    pub name: String,
    /// The rule.
    pub rule: Rule,
    /// Where.
    pub outline: Outline,
    /// It begins there; `None`: at the ground.
    pub lower: Option<Height>,
    /// It ends there; `None`: it has no limit.
    pub upper: Option<Height>,
    /// When it applies.
    pub window: Window,
    /// At which hours of the week within the window; `None`: at all of them.
    pub hours: Option<WeeklyHours>,
    /// What a human should know: authority, reason, schedule. They become comments.
    pub remarks: Vec<String>,
    /// Its place in the file.
    pub source: String,
}

/// What holds in a zone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// It is not entered.
    KeepOut,
    /// It is entered with a permission.
    Permission,
    /// It is not left.
    StayInside,
}

/// The shape of a zone over the ground.
#[derive(Debug, Clone, PartialEq)]
pub enum Outline {
    /// The corners in order, not closed; straight between them in latitude and longitude.
    Polygon(Vec<LatLon>),
    /// All within a distance.
    Circle {
        /// The middle.
        centre: LatLon,
        /// More than 0.
        radius_m: f64,
    },
}

/// A height as it was published.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Height {
    /// Metres above the reference.
    pub metres: f64,
    /// Above what.
    pub above: Reference,
}

impl Height {
    /// Of a place to stand at. Where the ground is not known, it counts as that of the take-off point.
    pub const ON_GROUND: Height = Height { metres: 0.0, above: Reference::Ground };
}

/// What a height is counted from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reference {
    /// The take-off point.
    TakeOff,
    /// The ground or water straight below (AGL).
    Ground,
    /// Mean sea level (AMSL).
    SeaLevel,
    /// The ellipsoid of WGS 84.
    Ellipsoid,
}

/// From when to when something applies, milliseconds since the Unix epoch, UTC; `None`: without end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Window {
    /// From then on.
    pub from_utc_ms: Option<i64>,
    /// Until then.
    pub until_utc_ms: Option<i64>,
}
