//! Places, heights and lengths as OpenAir writes them.

use domain::geodesy::LatLon;

use crate::content::{Height, Reference};
use crate::heights::{Limit, flight_level};
use crate::json::short;
use crate::zone_text::FEET;

const NAUTICAL_MILE_M: f64 = 1852.0;

/// A limit: `GND`, `UNL`, `FL65`, `1500ft AGL`, `2000 MSL`, `450m AMSL`. Without a unit it is in feet, without a reference above sea level.
pub(super) fn limit(text: &str) -> Result<Limit, String> {
    let not_understood =
        || format!("found `{}`, expected a height like GND, UNL, FL65, 1500ft AGL, 450m AMSL", short(text));
    let upper = text.to_ascii_uppercase();
    let words = upper.trim();
    match words {
        "GND" | "SFC" | "SURFACE" | "GROUND" => return Ok(Limit::Ground),
        "UNL" | "UNLTD" | "UNLIM" | "UNLIMITED" => return Ok(Limit::Unlimited),
        _ => {}
    }
    if let Some(level) = words.strip_prefix("FL") {
        let level: f64 = number(level.trim()).ok_or_else(not_understood)?;
        return Ok(Limit::At(flight_level(level)));
    }
    let end = words.find(|it: char| !it.is_ascii_digit() && it != '.').unwrap_or(words.len());
    let value = number(&words[..end]).ok_or_else(not_understood)?;
    let rest = words[end..].trim();
    let (unit_m, reference) = match rest {
        it if it.starts_with("FT") => (FEET, &it[2..]),
        it if it.starts_with("F ") => (FEET, &it[1..]),
        // `M` is a unit, and begins `MSL`.
        it if it == "M" || it.starts_with("M ") => (1.0, &it[1..]),
        it if ["MAGL", "MAMSL", "MMSL", "MGND", "MSFC"].contains(&it) => (1.0, &it[1..]),
        it => (FEET, it),
    };
    let above = match reference.trim() {
        "" | "MSL" | "AMSL" | "ALT" => Reference::SeaLevel,
        "AGL" | "GND" | "SFC" | "ASFC" | "AGND" => Reference::Ground,
        _ => return Err(not_understood()),
    };
    let height = Height { metres: value * unit_m, above };
    if height.metres == 0.0 && above == Reference::Ground { Ok(Limit::Ground) } else { Ok(Limit::At([height; 2])) }
}

/// A place: `54:00:03.6 N 006:36:00 E`, `54:00.06N 006:36.0E` or `54.001 N 6.6 E`.
pub(super) fn place(text: &str) -> Result<LatLon, String> {
    let not_understood = || format!("found `{}`, expected a place like 54:00:03 N 006:36:00 E", short(text));
    let upper = text.to_ascii_uppercase();
    let split = upper.find(['N', 'S']).ok_or_else(not_understood)?;
    let (latitude, rest) = (&upper[..split], upper[split + 1..].trim());
    let south = upper[split..].starts_with('S');
    let (longitude, west) = match (rest.strip_suffix('E'), rest.strip_suffix('W')) {
        (Some(it), _) => (it, false),
        (_, Some(it)) => (it, true),
        _ => return Err(not_understood()),
    };
    let signed = |text: &str, is_negative: bool| {
        let degrees = sexagesimal(text.trim())?;
        Some(if is_negative { -degrees } else { degrees })
    };
    let latitude = signed(latitude, south).ok_or_else(not_understood)?;
    let longitude = signed(longitude, west).ok_or_else(not_understood)?;
    LatLon::new(latitude, longitude).map_err(|error| error.to_string())
}

/// Degrees, minutes and seconds with colons between them; what is left out is 0.
fn sexagesimal(text: &str) -> Option<f64> {
    let parts: Vec<f64> = text.split(':').map(|it| number(it.trim())).collect::<Option<_>>()?;
    match *parts.as_slice() {
        [degrees] => Some(degrees),
        [degrees, minutes] if minutes < 60.0 => Some(degrees + minutes / 60.0),
        [degrees, minutes, seconds] if minutes < 60.0 && seconds < 60.0 => {
            Some(degrees + minutes / 60.0 + seconds / 3600.0)
        }
        _ => None,
    }
}

/// A length in nautical miles, in metres.
pub(super) fn miles(text: &str) -> Result<f64, String> {
    let miles = number(text.trim()).ok_or_else(|| format!("found `{}`, expected nautical miles", short(text)))?;
    Ok(miles * NAUTICAL_MILE_M)
}

/// An angle.
pub(super) fn degrees(text: &str) -> Result<f64, String> {
    number(text.trim()).ok_or_else(|| format!("found `{}`, expected degrees", short(text)))
}

/// Values with commas between them.
pub(super) fn list<const N: usize>(text: &str) -> Option<[&str; N]> {
    text.split(',').map(str::trim).collect::<Vec<_>>().try_into().ok()
}

/// Digits, with a decimal point at most.
fn number(text: &str) -> Option<f64> {
    let is_plain = !text.is_empty() && text.bytes().all(|it| it.is_ascii_digit() || it == b'.');
    text.parse().ok().filter(|_| is_plain)
}
