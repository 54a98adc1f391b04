//! The limits of a zone: a number, its unit and its reference. Each publisher spells them in another way.

use crate::content::{Height, Reference};
use crate::findings::Wrong;
use crate::heights::flight_level;
use crate::json::Node;
use crate::zone_text::FEET;

/// Units of length, in metres.
pub(crate) const LENGTHS: [(&str, f64); 8] = [
    ("M", 1.0),
    ("METERS", 1.0),
    ("METRES", 1.0),
    ("FT", FEET),
    ("FEET", FEET),
    ("KM", 1000.0),
    ("NM", 1852.0),
    ("NMI", 1852.0),
];
/// Between flight levels: 100 feet.
const LEVEL_M: f64 = 100.0 * FEET;
const REFERENCES: [(&str, Above); 12] = [
    ("AGL", Above::Is(Reference::Ground)),
    ("GND", Above::Is(Reference::Ground)),
    ("SFC", Above::Is(Reference::Ground)),
    ("AMSL", Above::Is(Reference::SeaLevel)),
    ("MSL", Above::Is(Reference::SeaLevel)),
    ("ALT", Above::Is(Reference::SeaLevel)),
    ("WGS84", Above::Is(Reference::Ellipsoid)),
    ("W84", Above::Is(Reference::Ellipsoid)),
    ("HAE", Above::Is(Reference::Ellipsoid)),
    ("STD", Above::Pressure),
    ("PA", Above::Pressure),
    ("QNE", Above::Pressure),
];
/// In place of a number: the ground, and no limit.
const GROUND: [&str; 4] = ["GND", "SFC", "SURFACE", "GROUND"];
const NO_LIMIT: [&str; 3] = ["UNL", "UNLTD", "UNLIMITED"];

/// Which end of a zone a limit is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    Lower,
    Upper,
}

#[derive(Debug, Clone, Copy)]
enum Above {
    Is(Reference),
    /// An altitude in the standard atmosphere, as flight levels are.
    Pressure,
}

/// Reads a limit. `None`: at the ground, or without limit.
pub(crate) fn height(
    end: End,
    value: &Node<'_>,
    unit: Option<&Node<'_>>,
    reference: Option<&Node<'_>>,
) -> Result<Option<Height>, Wrong> {
    let word = value.value.as_str().unwrap_or_default().trim().to_ascii_uppercase();
    if GROUND.contains(&word.as_str()) {
        return Ok(Some(Height { metres: 0.0, above: Reference::Ground }));
    }
    if end == End::Upper && NO_LIMIT.contains(&word.as_str()) {
        return Ok(None);
    }
    let number = value.number()?;
    if end == End::Lower && number == 0.0 && reference.is_none() {
        return Ok(None);
    }
    let missing = |what| Wrong::at(&value.place, format!("{what} is missing"), "correct it, or leave the zone out");
    let is_level = unit.is_some_and(|it| it.value.as_str().is_some_and(|it| it.trim().eq_ignore_ascii_case("FL")));
    let unit_m = match unit {
        Some(_) if is_level => LEVEL_M,
        Some(unit) => unit.one_of(&LENGTHS)?,
        None if number == 0.0 => 1.0,
        None => return Err(missing("its unit")),
    };
    let metres = number * unit_m;
    let above = match reference {
        _ if is_level && number != 0.0 => Above::Pressure,
        Some(reference) => reference.one_of(&REFERENCES)?,
        None => return Err(missing("its reference")),
    };
    Ok(Some(match (above, end) {
        (Above::Is(above), _) => Height { metres, above },
        (Above::Pressure, End::Lower) => flight_level(metres / LEVEL_M)[0],
        (Above::Pressure, End::Upper) => flight_level(metres / LEVEL_M)[1],
    }))
}
