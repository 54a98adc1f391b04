//! What the geographic keys of a GeoTIFF say (OGC 19-008r4): which coordinates it has, and what its heights are counted from.

use crate::Problem;

const MODEL_TYPE: u16 = 1024;
const RASTER_TYPE: u16 = 1025;
const GEODETIC_SYSTEM: u16 = 2048;
const VERTICAL_SYSTEM: u16 = 4096;
const VERTICAL_UNITS: u16 = 4099;

/// Of the model type: latitude and longitude.
const GEOGRAPHIC: u16 = 2;
/// Of the raster type: a value is the height at a point. The other type is that of an area.
const POINT: u16 = 2;
/// WGS 84 and ETRS89 (EPSG), which are the same within a metre.
const SYSTEMS: [u16; 2] = [4326, 4258];
/// Heights above an ellipsoid; the geoid differs from that by up to 107 m.
const ELLIPSOIDS: std::ops::RangeInclusive<u16> = 5001..=5033;
/// EPSG.
const METRE: u16 = 9001;

/// Whether a value is the height at a point: `keys` is the whole directory, a head of four numbers and four for each key.
pub(crate) fn is_point(keys: &[u16]) -> Result<bool, Problem> {
    let value = |id: u16| {
        let entry = keys.chunks_exact(4).skip(1).find(|it| it[0] == id);
        // A value elsewhere than in the key itself is a text or a fraction, which none of these is.
        entry.map(|it| if it[1] == 0 { it[3] } else { 0 })
    };
    if let Some(found) = value(MODEL_TYPE).filter(|it| *it != GEOGRAPHIC) {
        let message = format!("its model type is {found}, expected {GEOGRAPHIC} (latitude and longitude)");
        return Err(Problem::new(message, "convert the tile to EPSG 4326"));
    }
    let system = value(GEODETIC_SYSTEM).unwrap_or_default();
    if !SYSTEMS.contains(&system) {
        let message = format!("its coordinate system is EPSG {system}, expected 4326 (WGS 84) or 4258 (ETRS89)");
        return Err(Problem::new(message, "convert the tile to EPSG 4326"));
    }
    if let Some(found) = value(VERTICAL_SYSTEM).filter(|it| ELLIPSOIDS.contains(it)) {
        let message = format!("its heights are above an ellipsoid (EPSG {found}), expected above mean sea level");
        return Err(Problem::new(message, "convert its heights to EGM96 (EPSG 5773)"));
    }
    if let Some(found) = value(VERTICAL_UNITS).filter(|it| *it != METRE) {
        let message = format!("its heights are in the unit EPSG {found}, expected {METRE} (metres)");
        return Err(Problem::new(message, "convert its heights to metres"));
    }
    Ok(value(RASTER_TYPE) == Some(POINT))
}
