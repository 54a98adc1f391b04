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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::airspace::Grants;
    use crate::airspace::tests::{airspace, square};
    use crate::area::{AreaKind, NO_LANDING_TO_M};

    #[test]
    fn the_worst_thing_decides_then_the_next() {
        let both = Harm::AIRSPACE | Harm::AIRCRAFT;
        let order = [Harm::NONE, Harm::AIRCRAFT, Harm::AIRSPACE, both, Harm::PEOPLE, Harm::PEOPLE | Harm::AIRCRAFT];
        assert!(order.is_sorted());
        assert_eq!(least(order.into_iter().rev().zip(0..)), Some((Harm::NONE, 5)));
        assert_eq!(least([(both, "first"), (both, "second")]), Some((both, "first")));
        assert_eq!(least::<()>([]), None);
    }

    #[test]
    fn what_is_below_is_the_worst_of_all_that_is_there() {
        #[track_caller]
        fn check(areas: &[Area], expected: &str) {
            let grants: Grants = [("held".to_owned(), Duration::from_secs(900))].into();
            let harm = airspace(areas, &grants).harm_below(Ned::new(0.0, 200.0, -40.0));
            assert_eq!(harm.to_string(), expected);
        }
        let ground = |ground| Area { ceiling_m: Some(NO_LANDING_TO_M), ground, ..square(AreaKind::KeepOut) };
        let named = |name: &str| Area { name: name.into(), ..square(AreaKind::Permission) };
        check(&[], "on free ground");
        check(&[ground(Ground::Water)], "where the aircraft is lost");
        check(&[ground(Ground::Water), ground(Ground::People)], "among people, where the aircraft is lost");
        check(&[named("held")], "on free ground");
        check(&[named("denied")], "in an area that may not be entered");
        check(
            &[named("denied"), ground(Ground::Water)],
            "in an area that may not be entered, where the aircraft is lost",
        );
        // A low wall is a keep-out area like any other.
        check(&[ground(Ground::Nobody)], "in an area that may not be entered");
        // What begins above the vehicle is not below it.
        check(&[Area { floor_m: Some(60.0), ceiling_m: None, ..named("denied") }], "on free ground");
    }
}
