//! Heights above the take-off point, on the safe side where what is published cannot be converted: an area begins lower and
//! ends higher rather than the reverse.

use std::path::Path;

use domain::file::Mistake;
use domain::geodesy::{LatLon, Origin};
use domain::ground::GroundModel;

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

/// A take-off point's altitude that differs more from the ground there, in metres, is that of another place, or above something else than sea
/// level. (A model of the ground is within some 10 m; a roof that is higher is not the ground.)
const DIFFERENCE_M: f64 = 20.0;

/// What is known about the ground.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Terrain<'a> {
    /// The take-off point's altitude above mean sea level, in metres.
    pub(crate) altitude_m: Option<f64>,
    /// The lowest and the highest ground where there is a zone, in metres above the take-off point.
    relief_m: Option<[f64; 2]>,
    /// A model, and what it says of the take-off point, in metres above mean sea level.
    model: Option<(&'a dyn GroundModel, f64)>,
}

impl<'a> Terrain<'a> {
    /// What is known at `origin`. Heights above the ground are counted from the ground that the model has at the take-off point: what it is wrong by
    /// in a whole region does not matter then.
    pub(crate) fn at(origin: Origin, relief_m: Option<f64>, model: Option<&'a dyn GroundModel>) -> Terrain<'a> {
        let ground_m = model.and_then(|it| it.altitude_m(origin.place));
        let altitude_m = origin.altitude_m.or(ground_m);
        Terrain { altitude_m, relief_m: relief_m.map(|it| [-it, it]), model: model.zip(ground_m.or(altitude_m)) }
    }

    /// The take-off point's altitude against the ground there.
    pub(crate) fn contradiction(self, origin: Origin, path: &Path) -> Option<Mistake> {
        let ((_, ground_m), altitude_m) = self.model.zip(origin.altitude_m)?;
        (DIFFERENCE_M < (altitude_m - ground_m).abs()).then(|| Mistake {
            path: path.to_owned(),
            place: None,
            message: format!(
                "the take-off point is given at {altitude_m:.0} m above sea level, and the ground there is at {ground_m:.0} m"
            ),
            help: "give it with --origin LATITUDE,LONGITUDE, without altitude, to take that of the ground".into(),
        })
    }

    /// What is known where `zone` is, within `corners`.
    pub(crate) fn over(self, zone: &Zone, corners: impl Iterator<Item = LatLon>) -> Terrain<'a> {
        // A large zone has millions of posts.
        let is_needed = [zone.lower, zone.upper].into_iter().flatten().any(|it| it.above == Reference::Ground);
        let found = self.model.filter(|_| is_needed).and_then(|(model, ground_m)| {
            let corners: Vec<LatLon> = corners.collect();
            model.bounds_m(&corners).map(|it| it.map(|it| it - ground_m))
        });
        Terrain { relief_m: found.or(self.relief_m), ..self }
    }

    /// How high a place is above the take-off point, which it is itself without `at`; `None`: that cannot be said.
    pub(crate) fn height_m(self, height: Height, at: Option<LatLon>) -> Option<f64> {
        if height.above == Reference::Ground {
            return Some(at.map_or(Some(0.0), |it| self.ground_m(it))? + height.metres);
        }
        self.bounds_m(height).filter(|[low, high]| low == high).map(|it| it[0])
    }

    /// How high the ground at a place is above the take-off point.
    pub(crate) fn ground_m(self, at: LatLon) -> Option<f64> {
        self.model.and_then(|(model, ground_m)| Some(model.altitude_m(at)? - ground_m))
    }

    /// The lowest and the highest that `height` may be above the take-off point; `None`: that cannot be said.
    pub(crate) fn bounds_m(self, height: Height) -> Option<[f64; 2]> {
        let metres = height.metres;
        match height.above {
            Reference::TakeOff => Some([metres; 2]),
            Reference::Ground => self.relief_m.map(|[low, high]| [metres + low, metres + high]),
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
                format!("its {which} limit is above the ground, whose height is not known: {instead}; see --ground and --relief"),
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
            "it would end at {ceiling_m} m above the take-off point and begin at {floor_m} m: nothing is there, left out"
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
