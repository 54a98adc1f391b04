//! The place or the piece of air that is taken by what stands there.

use std::f64::consts::{PI, TAU};

use domain::area::{Area, AreaKind};
use domain::fmu::TrafficKind;
use domain::geometry::Ned;
use domain::traffic::WellClear;

/// An aircraft that stands no higher than this above the take-off point is parked. (ENG: what heights by air pressure differ by.)
const PARKED_M: f64 = 10.0;
/// How far a landing keeps from what is parked, in metres: from one with people around it, and from one without. (ENG: a ship's length or a
/// rotor's wash; what a landing is off by.)
const BESIDE_PEOPLE_M: f64 = 40.0;
const BESIDE_M: f64 = 15.0;
/// How far a flight keeps above what is parked. (ASTM F3442: 100 ft.)
const ABOVE_M: f64 = 30.0;
/// How far a flight keeps from a ship that lies, in metres: what falls hits no farther aside than it was high. (ENG: as high as missions fly
/// there.)
const FROM_SHIP_M: f64 = 60.0;
/// Sides of an area that stands for a circle.
const SIDES: u32 = 12;

/// What is taken by traffic of this kind that stands at `place`.
pub(super) fn taken_by(id: &str, kind: TrafficKind, place: Ned) -> Area {
    let WellClear { over_ground_m, height_m } = WellClear::of(kind, 0.0);
    let around = |what: &str, radius_m: f64, floor_m: Option<f64>, ceiling_m: Option<f64>| {
        let corners = circle(place, radius_m);
        Area { floor_m, ceiling_m, ..Area::new(format!("{what} {id}"), AreaKind::KeepOut, corners) }
    };
    let at_m = place.height_m();
    let above_m = Some(at_m + ABOVE_M);
    match kind {
        TrafficKind::Vessel => around("the water around", FROM_SHIP_M, None, None),
        TrafficKind::Crewed if at_m <= PARKED_M => around("the place of", BESIDE_PEOPLE_M, None, above_m),
        TrafficKind::Uncrewed if at_m <= PARKED_M => around("the place of", BESIDE_M, None, above_m),
        TrafficKind::Crewed | TrafficKind::Uncrewed => {
            let floor_m = Some(at_m - height_m).filter(|it| 0.0 < *it);
            around("the air around", over_ground_m, floor_m, Some(at_m + height_m))
        }
    }
}

/// Around a circle.
fn circle(place: Ned, radius_m: f64) -> Vec<Ned> {
    let out_m = radius_m / (PI / f64::from(SIDES)).cos();
    let corner = |side: u32| {
        let (sin, cos) = (TAU * f64::from(side) / f64::from(SIDES)).sin_cos();
        Ned::new(place.north_m + cos * out_m, place.east_m + sin * out_m, 0.0)
    };
    (0..SIDES).map(corner).collect()
}
