//! Sites: places that a mission names for a flight that has to end early.

use serde::Deserialize;

use crate::geometry::Ned;
use crate::harm::Harm;

/// What happens to a vehicle that comes down at a site.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SiteKind {
    /// It lands and can be used again.
    Landing,
    /// It is given up, where it harms nobody: water, scrub.
    Ditch,
}

impl SiteKind {
    /// What coming down there harms.
    pub fn harm(self) -> Harm {
        match self {
            SiteKind::Landing => Harm::NONE,
            SiteKind::Ditch => Harm::AIRCRAFT,
        }
    }

    /// The word for it in a mission file.
    pub fn word(self) -> &'static str {
        match self {
            SiteKind::Landing => "landing",
            SiteKind::Ditch => "ditch",
        }
    }
}

/// A place to come down at, other than those that the mission flies to.
#[derive(Debug, Clone, PartialEq)]
pub struct Site {
    /// Unique among the sites of a mission.
    pub name: String,
    /// On the ground, or on the water.
    pub position: Ned,
    /// What happens to a vehicle there.
    pub kind: SiteKind,
}

/// What the name of an area begins with whose grant says that a place is ready to be landed at.
const READY: &str = "site ";

/// The area round a place to land at that must be ready: the control tower grants it once the party of that site says so.
pub fn area_of(site: &str) -> String {
    format!("{READY}{site}")
}

/// The site whose readiness a grant for this area is.
pub fn site_of(area: &str) -> Option<&str> {
    area.strip_prefix(READY)
}

/// The most sites of a mission: the mission manager looks at all of them again and again while it flies. (ENG: PX4 stores 32 rally
/// points.)
pub const MOST_SITES: usize = 32;
