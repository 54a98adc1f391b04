//! The shortest way that may be flown now, round the areas that may not be entered.
//!
//! For a vehicle that returns without a plan: it asks for no permission on the way, and it may leave an area that it is
//! in already.

use crate::area::Area;
use crate::corners::corners;
use crate::geometry::Ned;
use crate::route::{barred, way_is_clear};

/// The points to fly to from `from`, the last one `to`; empty if there is no way. Turns keep
/// `margin_m` from the borders and are flown at the height of `to`.
pub fn way_round(from: Ned, to: Ned, areas: &[Area], held: &[String], utc_ms: i64, margin_m: f64) -> Vec<Ned> {
    let is_clear = |a: Ned, b: Ned| way_is_clear(a, b, areas, held, utc_ms);
    let turns = barred(areas, held, utc_ms).flat_map(|it| corners(&it.corners, margin_m));
    let mut points: Vec<Ned> = vec![from];
    points.extend(turns.map(|it| it.at_height(to.height_m())));
    points.push(to);
    let goal = points.len() - 1;
    // Dijkstra over few points: length so far and where from.
    let mut best: Vec<(f64, usize)> = vec![(f64::INFINITY, 0); points.len()];
    let mut settled = vec![false; points.len()];
    best[0].0 = 0.0;
    loop {
        let open = (0..points.len()).filter(|&it| !settled[it] && best[it].0.is_finite());
        let Some(here) = open.min_by(|&a, &b| best[a].0.total_cmp(&best[b].0)) else { return Vec::new() };
        if here == goal {
            break;
        }
        settled[here] = true;
        for there in 0..points.len() {
            let length_m = best[here].0 + points[here].distance_m(points[there]);
            if !settled[there] && length_m < best[there].0 && is_clear(points[here], points[there]) {
                best[there] = (length_m, here);
            }
        }
    }
    let mut way = vec![to];
    let mut at = best[goal].1;
    while at != 0 {
        way.push(points[at]);
        at = best[at].1;
    }
    way.reverse();
    way
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::AreaKind;

    #[test]
    fn the_way_leads_round_what_may_not_be_entered() {
        let square = [(-90.0, 100.0), (90.0, 100.0), (90.0, 300.0), (-90.0, 300.0)];
        let area = Area {
            name: "A".into(),
            kind: AreaKind::Permission,
            corners: square.iter().map(|&(north, east)| Ned::new(north, east, 0.0)).collect(),
            floor_m: None,
            ceiling_m: None,
            from_utc_ms: None,
            until_utc_ms: None,
        };
        let areas = [area];
        let home = Ned::new(0.0, 0.0, -15.0);
        #[track_caller]
        fn check(areas: &[Area], from: (f64, f64), to: Ned, held: &[String], expected: &[(f64, f64)]) {
            let way = way_round(Ned::new(from.0, from.1, -10.0), to, areas, held, 0, 10.0);
            let way: Vec<_> = way.iter().map(|it| (it.north_m.round(), it.east_m.round())).collect();
            assert_eq!(way, expected, "from {from:?}");
        }
        check(&areas, (10.0, 400.0), home, &[], &[(100.0, 310.0), (100.0, 90.0), (0.0, 0.0)]);
        check(&areas, (10.0, 400.0), home, &["A".into()], &[(0.0, 0.0)]);
        // It leaves the area by the shortest way, and does not enter it.
        check(&areas, (0.0, 150.0), home, &[], &[(0.0, 0.0)]);
        check(&areas, (0.0, 0.0), Ned::new(0.0, 200.0, -15.0), &[], &[]);
    }
}
