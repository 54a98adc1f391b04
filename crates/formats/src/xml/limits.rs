//! The vertical limits of AIXM.

use roxmltree::Node;

use super::LocalName as _;
use crate::content::{Height, Reference};
use crate::heights::{Limit, flight_level};
use crate::json::short;
use crate::zone_text::FEET;

/// A limit of a volume: `lowerLimit` or `upperLimit`, with its reference beside it; `None`: it is not there.
pub(super) fn read(volume: Node<'_, '_>, name: &str) -> Result<Option<Limit>, String> {
    let Some(node) = volume.child(name) else { return Ok(None) };
    let text = node.words();
    match text.to_ascii_uppercase().as_str() {
        "" => return Ok(None),
        "GND" | "SFC" | "FLOOR" => return Ok(Some(Limit::Ground)),
        "UNL" | "CEILING" => return Ok(Some(Limit::Unlimited)),
        _ => {}
    }
    let unit = node.attribute_of("uom").unwrap_or_default();
    let value: f64 = text
        .parse()
        .ok()
        .filter(|it: &f64| it.is_finite())
        .ok_or_else(|| format!("{name} is `{}`, expected a number, GND or UNL", short(&text)))?;
    let unit_m = match unit.to_ascii_uppercase().as_str() {
        "FL" => return Ok(Some(Limit::At(flight_level(value)))),
        "FT" | "[FT_I]" => FEET,
        "M" => 1.0,
        // The standard's metric flight levels.
        "SM" => return Ok(Some(Limit::At(flight_level(value / FEET / 10.0)))),
        other => return Err(format!("the unit of {name} is `{}`, expected FT, M or FL", short(other))),
    };
    let metres = value * unit_m;
    let reference = volume.child_words(&format!("{name}Reference")).unwrap_or_default();
    let above = match reference.to_ascii_uppercase().as_str() {
        "SFC" if metres == 0.0 => return Ok(Some(Limit::Ground)),
        "SFC" => Reference::Ground,
        "MSL" => Reference::SeaLevel,
        "W84" => Reference::Ellipsoid,
        "STD" => return Ok(Some(Limit::At(flight_level(metres / FEET / 100.0)))),
        other => return Err(format!("{name}Reference is `{}`, expected SFC, MSL, W84 or STD", short(other))),
    };
    Ok(Some(Limit::At([Height { metres, above }; 2])))
}
