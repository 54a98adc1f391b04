//! Whether a place is in an area. The witness sees for itself: it shares no geometry with the processes that it judges.

use domain::area::Area;
use domain::geometry::Ned;

/// Whether the place is in the altitude band, and in an odd number of the area's rings: inside a hole it is in two.
pub(crate) fn is_inside(area: &Area, at: Ned) -> bool {
    let height_m = -at.down_m;
    let is_in_band = area.floor_m.is_none_or(|floor_m| floor_m <= height_m)
        && area.ceiling_m.is_none_or(|ceiling_m| height_m <= ceiling_m);
    let rings = std::iter::once(&area.corners).chain(&area.holes);
    is_in_band && rings.filter(|ring| is_in_ring(ring, at)).count() % 2 == 1
}

/// Whether the ray from the place to the east meets an odd number of sides.
fn is_in_ring(ring: &[Ned], at: Ned) -> bool {
    let is_met = |(a, b): &(&Ned, &Ned)| {
        let is_across = (a.north_m > at.north_m) != (b.north_m > at.north_m);
        let east_m = || a.east_m + (b.east_m - a.east_m) * (at.north_m - a.north_m) / (b.north_m - a.north_m);
        is_across && at.east_m < east_m()
    };
    ring.iter().zip(ring.iter().cycle().skip(1)).filter(is_met).count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use domain::area::AreaKind;

    use super::*;

    #[test]
    fn a_hole_is_outside_and_so_is_what_is_over_the_ceiling() {
        let ring = |side_m: f64| {
            let corners = [(-side_m, -side_m), (side_m, -side_m), (side_m, side_m), (-side_m, side_m)];
            corners.map(|(north, east)| Ned::new(north, east, 0.0)).to_vec()
        };
        let area =
            Area { holes: vec![ring(10.0)], ceiling_m: Some(30.0), ..Area::new("A", AreaKind::KeepOut, ring(50.0)) };
        let check = |north_m: f64, height_m: f64, expected: bool| {
            assert_eq!(is_inside(&area, Ned::new(north_m, 3.0, -height_m)), expected, "{north_m} {height_m}");
        };
        check(0.0, 5.0, false);
        check(9.0, 5.0, false);
        check(11.0, 5.0, true);
        check(-49.0, 30.0, true);
        check(-49.0, 31.0, false);
        check(-51.0, 5.0, false);
    }
}
