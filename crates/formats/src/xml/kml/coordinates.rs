//! The lists of places of KML.

use domain::geodesy::LatLon;

use crate::json::short;

/// A place with its height, which is 0 if it is not given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Position {
    pub(super) at: LatLon,
    pub(super) height_m: f64,
}

/// The places of a list. White space separates them; beside a comma it separates nothing.
pub(super) fn tuples(list: &str) -> impl Iterator<Item = &str> {
    let mut rest = list;
    std::iter::from_fn(move || {
        rest = rest.trim_start();
        let mut end = 0;
        loop {
            let word = rest[end..].find(char::is_whitespace).unwrap_or(rest.len() - end);
            end += word;
            let next = rest[end..].trim_start();
            if next.is_empty() || !(rest[..end].ends_with(',') || next.starts_with(',')) {
                break;
            }
            end = rest.len() - next.len();
        }
        let (tuple, after) = rest.split_at(end);
        rest = after;
        (!tuple.is_empty()).then_some(tuple)
    })
}

/// `longitude,latitude` with a height, and with a fourth number that some programs write.
pub(super) fn position(tuple: &str) -> Result<Position, String> {
    let numbers: Option<Vec<f64>> =
        tuple.split(',').map(|it| it.trim().parse().ok().filter(|it: &f64| it.is_finite())).collect();
    // With spaces in it, it may also be two places with a comma between them.
    let has_spaces = tuple.contains(char::is_whitespace);
    let (longitude, latitude, height_m) = match numbers.as_deref() {
        Some([longitude, latitude]) => (*longitude, *latitude, 0.0),
        Some([longitude, latitude, height_m]) => (*longitude, *latitude, *height_m),
        Some([longitude, latitude, height_m, _]) if !has_spaces => (*longitude, *latitude, *height_m),
        _ => return Err(format!("found `{}`, expected a place", short(tuple))),
    };
    let at = LatLon::new(latitude, longitude).map_err(|error| error.to_string())?;
    Ok(Position { at, height_m })
}
