//! In small worlds: over, under and round, no way costs much more than the best of a search among everything.

use super::*;

/// A way costs at most this many times the best one over these points. (Measured among 160,000 random worlds: 998 of 1,000 ways cost at
/// most 1.02 times as much, the worst 1.63 times: a climb in the middle of a turn is not tried while there is another way.)
pub(super) const FACTOR: f64 = 2.0;

/// The points that the search among everything may turn, climb and descend at: the ends and all corners of all areas, each at all heights
/// at which there may be a reason to fly. (No way is found that must climb elsewhere, where two holes meet without a corner of an area.)
fn points(obstacles: &Obstacles) -> Vec<Ned> {
    let Obstacles { trip: Trip { from, to, .. }, among, margin_m, .. } = *obstacles;
    let clearance_m = among.rule.vertical_margin_m + LIMITS.height_clearance_m;
    let areas: Vec<&Area> = obstacles.all().map(|it| obstacles.area(it)).collect();
    let beyond = areas.iter().flat_map(|it| crate::way::beyond(it, clearance_m)).filter(|it| LIMITS.permits(*it));
    let mut heights: Vec<f64> = [from.height_m(), to.height_m()].into_iter().chain(beyond).collect();
    heights.sort_by(f64::total_cmp);
    heights.dedup();
    let corners = areas.iter().flat_map(|it| crate::corners::corners(it, margin_m)).map(|it| it.at);
    let places: Vec<Ned> = [from, to].into_iter().chain(corners).collect();
    let columns = places.iter().flat_map(|place| heights.iter().map(|it| place.at_height(*it)));
    [from, to].into_iter().chain(columns).collect()
}

/// The time that the quickest way over `points` takes, in seconds, from the first to the second one (Dijkstra).
fn quickest_s(obstacles: &Obstacles, points: &[Ned]) -> Option<f64> {
    let speeds = obstacles.among.limits.speeds;
    let mut best_s = vec![f64::INFINITY; points.len()];
    let mut open: Vec<usize> = (0..points.len()).collect();
    best_s[0] = 0.0;
    loop {
        let (at, _) = open.iter().enumerate().min_by(|a, b| best_s[*a.1].total_cmp(&best_s[*b.1]))?;
        let here = open.swap_remove(at);
        if here == 1 || best_s[here].is_infinite() {
            return best_s[1].is_finite().then_some(best_s[1]);
        }
        for there in open.iter().copied() {
            let reached_s = best_s[here] + speeds.time_s(points[here], points[there]);
            let exempt = Exempt { start: points[here] == points[0], end: points[there] == points[1] };
            if reached_s < best_s[there].min(best_s[1])
                && !is_barred(obstacles, points[here], points[there], exempt, |_| true)
            {
                best_s[there] = reached_s;
            }
        }
    }
}

/// The time of the best way among everything.
pub(super) fn best_s(obstacles: &Obstacles) -> Option<f64> {
    quickest_s(obstacles, &points(obstacles))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn in_three_dimensions_a_way_costs_little_more_than_the_best(
        volumes in (0..4usize).prop_flat_map(|count| (0..count).map(any_volume).collect::<Vec<_>>()),
        from in (-500.0..500.0, -500.0..500.0, 5.0..60.0),
        to in (-500.0..500.0, -500.0..500.0, 5.0..60.0),
    ) {
        let at = |(north_m, east_m, height_m): (f64, f64, f64)| Ned::new(north_m, east_m, -height_m);
        let closed: Vec<Area> = volumes.into_iter().map(|it| Area { kind: AreaKind::KeepOut, ..it }).collect();
        let (from, to) = (at(from), at(to));
        // As a plan does: where no way keeps the margin, with half the margin.
        let found_s = (0..MARGINS.len()).find_map(|part| among_keeping(part, &closed, from, to, |obstacles| {
            cheapest(obstacles).as_ref().ok().map(takes_s)
        }));
        let best_s = among(&closed, from, to, best_s);
        if let Some(best_s) = best_s {
            let found_s = found_s.expect("there is a way");
            prop_assert!(found_s <= FACTOR * best_s + 0.1, "{found_s} s, and {best_s} s at best");
        }
    }

    #[test]
    fn in_a_wind_a_way_costs_little_more_than_the_best_and_no_less_than_straight(
        areas in (0..4usize).prop_flat_map(|count| (0..count).map(any_area).collect::<Vec<_>>()),
        from in (-500.0..500.0, -500.0..500.0),
        to in (-500.0..500.0, -500.0..500.0),
        (wind_m_s, from_deg) in (5.0..9.0, 0.0..360.0),
    ) {
        let wind = Wind::from_direction(wind_m_s, from_deg);
        let closed: Vec<Area> = areas.into_iter().map(|it| Area { kind: AreaKind::KeepOut, ..it }).collect();
        let ends = (Ned::new(from.0, from.1, -10.0), Ned::new(to.0, to.1, -10.0));
        let found_s = (0..MARGINS.len()).find_map(|part| among_in_wind(wind, part, &closed, trip(ends.0, ends.1), |obstacles| {
            cheapest(obstacles).as_ref().ok().map(takes_s)
        }));
        let (best_s, straight_s) = among_in_wind(wind, 0, &closed, trip(ends.0, ends.1), |obstacles| {
            (best_s(obstacles), obstacles.time(ends.0, ends.1).as_secs_f64())
        });
        if let Some(best_s) = best_s {
            let found_s = found_s.expect("there is a way");
            prop_assert!(found_s <= FACTOR * best_s + 0.1, "{found_s} s, and {best_s} s at best");
            prop_assert!(straight_s <= found_s + 0.1, "{found_s} s, and {straight_s} s straight");
        }
    }
}

/// Over the low area the way flies in the hole of the high one, and under the high one in the hole of the low one: in between it can
/// only come down where it turns, at the mast.
#[test]
fn where_there_is_no_other_way_a_way_comes_down_where_it_turns() {
    let ring = |corners: [(f64, f64); 3]| corners.map(|(north, east)| Ned::new(north, east, 0.0)).to_vec();
    let keep_out = |name: &str, outline, holes| Area { holes, ..Area::new(name, AreaKind::KeepOut, ring(outline)) };
    let low_hole = ring([(840.0, 0.0), (-53.0, 480.0), (-23.0, -427.0)]);
    let high_hole = ring([(548.0, 302.0), (-244.0, 724.0), (-304.0, -225.0)]);
    let low = keep_out("low", [(994.0, 0.0), (-123.0, 600.0), (-84.0, -533.0)], vec![low_hole]);
    let high = keep_out("high", [(685.0, 302.0), (-304.0, 830.0), (-381.0, -357.0)], vec![high_hole]);
    let mast = keep_out("mast", [(16.0, 0.0), (-10.0, 17.0), (-9.0, -16.0)], vec![]);
    let areas = [Area { ceiling_m: Some(112.0), ..low }, Area { floor_m: Some(115.0), ..high }, mast];
    let (from, to) = (Ned::new(-146.0, 0.0, -5.0), Ned::new(0.0, -282.0, -5.0));
    let over = [(-110.0, -70.0, 116.0), (-19.0, -26.0, 116.0), (-19.0, -26.0, 111.0)];
    let expected = [&[(-146.0, 0.0, 5.0)], &over[..], &[(0.0, -282.0, 5.0)]].concat();
    assert_eq!(way_among(&areas, from, to), expected);
}
