//! What an end of a flight harms: the one order by which outcomes are chosen, before takeoff and in flight.
//!
//! The outcome counts, not the manoeuvre that leads to it. People below come first, then an area that may not be entered, since people in
//! other aircraft may be there, then the aircraft, then the mission.

use std::fmt;
use std::ops::BitOr;
use std::time::Duration;

use serde::Deserialize;

use crate::airspace::Airspace;
use crate::area::Area;
use crate::geometry::Ned;

/// Who or what is harmed by coming down on a piece of ground. Later ones are worse; where kinds overlap, the worst counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ground {
    /// Nobody: land.
    #[default]
    Nobody,
    /// The aircraft: water, or whatever else nobody lives on and no aircraft survives.
    Water,
    /// People.
    People,
}

impl Ground {
    /// The harm.
    pub fn harm(self) -> Harm {
        match self {
            Ground::Nobody => Harm::NONE,
            Ground::Water => Harm::AIRCRAFT,
            Ground::People => Harm::PEOPLE,
        }
    }
}

/// All that an outcome harms. The greater one is worse: the worst thing decides, then the next one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Harm(u8);

impl Harm {
    /// No more than the mission: the aircraft lands, and can be used again.
    pub const NONE: Harm = Harm(0);
    /// The aircraft is lost.
    pub const AIRCRAFT: Harm = Harm(1);
    /// An area is entered, or come down in, that may not be: people in other aircraft may be there.
    pub const AIRSPACE: Harm = Harm(2);
    /// People are below.
    pub const PEOPLE: Harm = Harm(4);

    const WORDS: [(Harm, &str); 3] = [
        (Harm::PEOPLE, "among people"),
        (Harm::AIRSPACE, "in an area that may not be entered"),
        (Harm::AIRCRAFT, "where the aircraft is lost"),
    ];
}

impl BitOr for Harm {
    type Output = Harm;
    fn bitor(self, other: Harm) -> Harm {
        Harm(self.0 | other.0)
    }
}

/// Where the vehicle comes down: `among people`, `on free ground`.
impl fmt::Display for Harm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = Harm::WORDS.iter().filter(|(harm, _)| *self | *harm == *self).map(|(_, words)| *words);
        let words: Vec<&str> = words.collect();
        f.write_str(if words.is_empty() { "on free ground" } else { "" })?;
        f.write_str(&words.join(", "))
    }
}

/// The outcome that harms least, with its harm; of equal ones the first. The one choice of an end: by it places are ranked, a landing goes
/// aside or elsewhere, and an area is entered without permission.
pub fn least<Outcome>(outcomes: impl IntoIterator<Item = (Harm, Outcome)>) -> Option<(Harm, Outcome)> {
    outcomes.into_iter().min_by_key(|(harm, _)| *harm)
}

impl Airspace<'_> {
    /// What coming straight down now from `position` harms.
    pub fn harm_below(&self, position: Ned) -> Harm {
        let barred = self.barred(Duration::ZERO).into_iter().filter(|it| it.is_at_or_below(position));
        let harm = |it: &Area| if it.only_bars_landings() { it.ground.harm() } else { Harm::AIRSPACE };
        barred.map(harm).fold(Harm::NONE, BitOr::bitor)
    }
}
