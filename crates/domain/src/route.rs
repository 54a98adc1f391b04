//! Straight ways through the areas of a mission: where they enter one, and how a transition is limited. Ways round areas
//! are found elsewhere.

use crate::area::Area;
use crate::geometry::Ned;

/// A transition shorter than this is not flown, in metres.
pub const WORTH_FLYING_M: f64 = 1.0;

/// Fractions of the straight way from `from` to `to` at which it enters `area`, ascending.
///
/// Leaving is not entering: a way that starts inside enters only where it comes back. Conservative
/// in height, as [`Area::is_crossed`] is.
pub fn entries(area: &Area, from: Ned, to: Ned) -> Vec<f64> {
    if !area.touches_heights(from.height_m(), to.height_m()) || passes_beside(area, from, to) {
        return Vec::new();
    }
    let polygon = area.polygon();
    let mut was_inside = area.contains(from);
    let mut found = Vec::new();
    for stretch in area.crossings(from, to).windows(2) {
        let middle = from.towards(to, (stretch[0] + stretch[1]) / 2.0);
        let inside = geo::Contains::contains(&polygon, &geo::Point::new(middle.east_m, middle.north_m));
        if inside && !was_inside {
            found.push(stretch[0]);
        }
        was_inside = inside;
    }
    found
}

/// Whether the bounding boxes do not touch: a cheap check that settles most pairs.
fn passes_beside(area: &Area, from: Ned, to: Ned) -> bool {
    let beside = |of: fn(&Ned) -> f64| {
        let (low, high) = (of(&from).min(of(&to)), of(&from).max(of(&to)));
        area.corners.iter().all(|it| of(it) < low) || area.corners.iter().all(|it| of(it) > high)
    };
    beside(|it| it.north_m) || beside(|it| it.east_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::AreaKind;

    fn area(name: &str, kind: AreaKind, corners: &[(f64, f64)]) -> Area {
        let corners = corners.iter().map(|&(north, east)| Ned::new(north, east, 0.0)).collect();
        Area { ceiling_m: Some(100.0), until_utc_ms: Some(1_000), ..Area::new(name, kind, corners) }
    }

    fn square() -> Area {
        area("A", AreaKind::Permission, &[(-90.0, 100.0), (90.0, 100.0), (90.0, 300.0), (-90.0, 300.0)])
    }

    fn at(east: f64) -> Ned {
        Ned::new(0.0, east, -10.0)
    }

    #[test]
    fn entering_counts_and_leaving_does_not() {
        #[track_caller]
        fn check(area: &Area, from: Ned, to: Ned, expected: &[f64]) {
            assert_eq!(entries(area, from, to), expected, "{from:?} to {to:?}");
        }
        check(&square(), at(0.0), at(400.0), &[0.25]);
        check(&square(), at(200.0), at(400.0), &[]);
        check(&square(), at(0.0), at(100.0), &[]);
        check(&square(), at(100.0), at(200.0), &[0.0]);
        // From above the ceiling straight down is entering at once, as far as a leg's heights tell.
        check(&square(), at(200.0).at_height(110.0), at(200.0), &[0.0]);
        check(&square(), at(200.0).at_height(0.0), at(200.0), &[]);
        // A horseshoe is entered twice, or once more from inside one of its arms.
        let horseshoe = area(
            "U",
            AreaKind::Permission,
            &[
                (50.0, 0.0),
                (50.0, 400.0),
                (-50.0, 400.0),
                (-50.0, 300.0),
                (20.0, 300.0),
                (20.0, 100.0),
                (-50.0, 100.0),
                (-50.0, 0.0),
            ],
        );
        check(&horseshoe, at(-100.0), at(500.0), &[100.0 / 600.0, 400.0 / 600.0]);
        check(&horseshoe, at(50.0), at(450.0), &[250.0 / 400.0]);
    }
}
