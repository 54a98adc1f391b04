//! Heights above the take-off point, on the safe side where what is published cannot be converted: an area begins lower and
//! ends higher rather than the reverse.

use domain::geodesy::Origin;

use crate::content::{Height, Reference, Zone};
use crate::findings::{Findings, Wrong};
use crate::zone_text::FEET;

/// The geoid lies between these heights above the ellipsoid of WGS 84, in metres. (EGM96: from -107 m south of India to
/// +85.4 m at New Guinea; Lemoine et al., NASA/TP-1998-206861, 1998.)
const GEOID_M: [f64; 2] = [-107.0, 85.4];

/// A limit of a zone, as it is published.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Limit {
    /// The ground or the water.
    Ground,
    /// The lowest and the highest that it may be.
    At([Height; 2]),
    /// There is none.
    Unlimited,
}

impl Limit {
    /// Where a zone begins that has it as its lower limit.
    pub(crate) fn as_lower(self) -> Result<Option<Height>, String> {
        match self {
            Limit::Ground => Ok(None),
            Limit::At([lowest, _]) => Ok(Some(lowest)),
            Limit::Unlimited => Err("a lower limit without a height".into()),
        }
    }

    /// Where a zone ends that has it as its upper limit.
    pub(crate) fn as_upper(self) -> Result<Option<Height>, String> {
        match self {
            Limit::Ground => Err("an upper limit at the ground".into()),
            Limit::At([_, highest]) => Ok(Some(highest)),
            Limit::Unlimited => Ok(None),
        }
    }
}

/// How far the altitude of a flight level may be from what it says, in metres: the pressure at sea level is 940 hPa in a deep low and
/// 1060 hPa in a high, where 1013.25 hPa is assumed, and a hectopascal is 8.3 m.
const PRESSURE_M: [f64; 2] = [600.0, 400.0];
/// And in parts of the altitude: air that is 25 K colder or warmer than assumed.
const TEMPERATURE: f64 = 0.1;

/// The lowest and the highest altitude of a flight level, in hundreds of feet above the standard pressure.
pub(crate) fn flight_level(level: f64) -> [Height; 2] {
    let metres = level * 100.0 * FEET;
    let [below_m, above_m] = PRESSURE_M;
    [metres * (1.0 - TEMPERATURE) - below_m, metres * (1.0 + TEMPERATURE) + above_m]
        .map(|metres| Height { metres, above: Reference::SeaLevel })
}

/// Beyond this no vehicle flies: the limit of a mission file's heights, in metres.
pub(crate) const HIGHEST_M: f64 = 10_000.0;

/// What is known about the ground.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Terrain {
    /// The take-off point's altitude above mean sea level, in metres.
    pub(crate) altitude_m: Option<f64>,
    /// The ground lies at most this much above or below the take-off point, in metres, wherever there is a zone.
    pub(crate) relief_m: Option<f64>,
}

impl Terrain {
    /// What is known at `origin`.
    pub(crate) fn at(origin: Option<Origin>, relief_m: Option<f64>) -> Terrain {
        Terrain { altitude_m: origin.and_then(|it| it.altitude_m), relief_m }
    }

    /// The lowest and the highest that `height` may be above the take-off point; `None`: that cannot be said.
    pub(crate) fn bounds_m(self, height: Height) -> Option<[f64; 2]> {
        let metres = height.metres;
        match height.above {
            Reference::TakeOff => Some([metres; 2]),
            Reference::Ground => self.relief_m.map(|relief_m| [metres - relief_m, metres + relief_m]),
            Reference::SeaLevel => self.altitude_m.map(|altitude_m| [metres - altitude_m; 2]),
            Reference::Ellipsoid => {
                self.altitude_m.map(|altitude_m| [metres - GEOID_M[1] - altitude_m, metres - GEOID_M[0] - altitude_m])
            }
        }
    }
}

/// Floor and ceiling of an area.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Band {
    pub(crate) floor_m: Option<f64>,
    pub(crate) ceiling_m: Option<f64>,
}

/// What is wrong with limits that are given above the same reference.
pub(crate) fn exchanged(zone: &Zone) -> Option<Wrong> {
    let (lower, upper) = zone.lower.zip(zone.upper)?;
    if lower.above != upper.above || lower.metres < upper.metres {
        return None;
    }
    let message = format!("the upper limit {} m is not above the lower limit {} m", upper.metres, lower.metres);
    Some(Wrong::at(&zone.source, message, "correct the limits, or leave the zone out"))
}

/// The heights of a zone; `None` if it has none at which anything flies.
pub(crate) fn band(zone: &Zone, terrain: Terrain, findings: &mut Findings) -> Option<Band> {
    let mut limit = |height: Height, which: &str, bound: usize, instead: &str| {
        let bounds = terrain.bounds_m(height);
        match (bounds, height.above) {
            (Some(_), Reference::Ellipsoid) => findings.note(
                &zone.source,
                format!("its {which} limit is above the ellipsoid: converted with the most that the geoid differs from it"),
            ),
            (Some(_), _) => {}
            (None, Reference::Ground) => findings.note(
                &zone.source,
                format!("its {which} limit is above the ground, whose height is not known: {instead}; see --relief"),
            ),
            (None, _) => findings.note(
                &zone.source,
                format!("its {which} limit is an altitude, and that of the take-off point is not known: {instead}; see --origin"),
            ),
        }
        // Whole centimetres: a foot is 30.48 of them.
        bounds.map(|it| (it[bound] * 100.0).round() / 100.0 + 0.0)
    };
    let is_ground = |it: &Height| it.above == Reference::Ground && it.metres <= 0.0;
    let floor_m =
        zone.lower.filter(|it| !is_ground(it)).and_then(|it| limit(it, "lower", 0, "it begins at the ground"));
    let ceiling_m = zone.upper.and_then(|it| limit(it, "upper", 1, "it has no upper limit"));
    if let (Some(floor_m), Some(ceiling_m)) = (floor_m, ceiling_m)
        && ceiling_m <= floor_m
    {
        let text = format!(
            "it would end at {ceiling_m} m above the take-off point and begin at {floor_m} m: there is nothing of it there, left out"
        );
        findings.note(&zone.source, text);
        return None;
    }
    if floor_m.is_some_and(|it| HIGHEST_M < it) || ceiling_m.is_some_and(|it| it < -HIGHEST_M) {
        findings.note(&zone.source, "it lies beyond all heights that a vehicle flies at: left out");
        return None;
    }
    Some(Band { floor_m: floor_m.filter(|it| -HIGHEST_M < *it), ceiling_m: ceiling_m.filter(|it| *it < HIGHEST_M) })
}
