//! What the files of all formats say, in one form: places in WGS 84, heights with the reference they were given in.

use crate::findings::Wrong;
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
    /// Points and lines that are neither places to fly to nor areas.
    pub unused: Vec<Unused>,
    /// Zones whose shape cannot be read.
    pub(crate) lost: Vec<Lost>,
    /// What the file says of itself.
    pub edition: Edition,
}

/// The most zones and other places of a file: twenty times the zones of the largest country. More would take all memory.
pub(crate) const MOST_ZONES: usize = 1_000_000;

impl Content {
    /// The zones whose shape cannot be read, each with its reason.
    pub fn without_shape(&self) -> impl Iterator<Item = Doubt> {
        self.lost.iter().map(|it| Doubt { place: it.wrong.place.clone(), message: it.wrong.message.clone() })
    }

    /// A mistake, if there are too many zones and places to go on reading.
    pub(crate) fn too_many(&self, place: impl FnOnce() -> String) -> Option<Wrong> {
        let count = self.zones.len() + self.lost.len() + self.unused.len();
        let message = || format!("more than {MOST_ZONES} zones and places: what follows is not read");
        (MOST_ZONES < count).then(|| Wrong::at(place(), message(), "cut the file down"))
    }
}

/// A zone of which only some places are known.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Lost {
    pub(crate) wrong: Wrong,
    /// The places that can be read.
    pub(crate) places: Vec<LatLon>,
}

/// Which edition of a data set a file is. Each field may be unknown.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Edition {
    /// Who publishes it.
    pub provider: Option<String>,
    /// When it was published, milliseconds since the Unix epoch, UTC.
    pub issued_utc_ms: Option<i64>,
    /// From when to when its zones are to be used.
    pub valid: Window,
}

/// A point or a line without a word on what it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Unused {
    /// `Point`, `LineString`.
    pub what: String,
    /// Its place in the file.
    pub source: String,
}

/// A place to fly to.
#[derive(Debug, Clone, PartialEq)]
pub struct Waypoint {
    /// Made unique when a mission is written.
    pub name: String,
    /// Where.
    pub at: Place,
    /// How high.
    pub height: Height,
    /// In the air, or on the ground.
    pub flying: bool,
    /// Its other requirements.
    pub terms: Terms,
    /// A polygon to be flown over, in place of the place.
    pub survey: Option<Survey>,
    /// Its place in the file.
    pub source: String,
}

/// Where a place to fly to is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Place {
    /// In WGS 84.
    At(LatLon),
    /// At the take-off point.
    TakeOff,
    /// Where the place before it has brought the vehicle, and first the take-off point: at the end of a survey.
    Here,
}

impl Place {
    /// The place, if it stands in the file and is not the take-off point.
    pub(crate) fn known(self) -> Option<LatLon> {
        match self {
            Place::At(at) => Some(at),
            Place::TakeOff | Place::Here => None,
        }
    }
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
    /// Along a line from one picture to the next.
    pub picture_distance_m: Option<f64>,
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
    /// When it applies: in each of these, of which there is one at least.
    pub periods: Vec<Period>,
    /// What a human should know: authority, reason, schedule. They become comments.
    pub remarks: Vec<String>,
    /// What was not understood; the zone then bars more.
    pub doubts: Vec<Doubt>,
    /// Its place in the file.
    pub source: String,
}

impl Zone {
    /// One that always applies, at all heights.
    pub fn always(name: impl Into<String>, rule: Rule, outline: Outline, source: impl Into<String>) -> Zone {
        Zone {
            name: name.into(),
            rule,
            outline,
            lower: None,
            upper: None,
            periods: vec![Period::default()],
            remarks: Vec::new(),
            doubts: Vec::new(),
            source: source.into(),
        }
    }
}

/// Something that was not understood.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Doubt {
    /// Where in the file.
    pub place: String,
    /// What was found and what was expected.
    pub message: String,
}

/// One time at which a zone applies.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Period {
    /// From when to when.
    pub window: Window,
    /// At which hours of the week within the window; `None`: at all of them.
    pub hours: Option<WeeklyHours>,
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
    /// Straight between its corners in latitude and longitude.
    Polygon {
        /// The corners in order, not closed.
        border: Vec<LatLon>,
        /// The corners of what is cut out, in the same form.
        holes: Vec<Vec<LatLon>>,
    },
    /// All within a distance.
    Circle {
        /// The middle.
        centre: LatLon,
        /// More than 0.
        radius_m: f64,
    },
}

impl Outline {
    /// A polygon without holes.
    pub(crate) fn polygon(border: Vec<LatLon>) -> Outline {
        Outline::Polygon { border, holes: Vec::new() }
    }
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
