//! Ways in a hole of an area, out of one, and from one to another.

use super::*;
fn rectangle(north_m: (f64, f64), east_m: (f64, f64)) -> Vec<Ned> {
    let corners = [(north_m.0, east_m.0), (north_m.1, east_m.0), (north_m.1, east_m.1), (north_m.0, east_m.1)];
    corners.map(|(north, east)| Ned::new(north, east, 0.0)).to_vec()
}

/// From 600 m west to 600 m east, with two holes: 200 m to each side of 300 m west, and of 300 m east.
fn two_holes(kind: AreaKind, ceiling_m: Option<f64>) -> Area {
    let holes = vec![rectangle((-200.0, 200.0), (-500.0, -100.0)), rectangle((-200.0, 200.0), (100.0, 500.0))];
    Area { holes, ceiling_m, ..Area::new("two holes", kind, rectangle((-400.0, 400.0), (-600.0, 600.0))) }
}

const START: Ned = Ned::new(0.0, -300.0, -10.0);

#[test]
fn a_way_leads_out_of_a_hole_and_into_another_over_the_area_only() {
    #[track_caller]
    fn check(ceiling_m: Option<f64>, to: Ned, expected: &[(f64, f64, f64)]) {
        assert_eq!(way_among(&[two_holes(AreaKind::KeepOut, ceiling_m)], START, to)[1..], *expected);
    }
    let low = Some(40.0);
    let other_hole = Ned::new(0.0, 300.0, -10.0);
    check(low, other_hole, &[(0.0, -110.0, 44.0), (0.0, 110.0, 44.0), (0.0, 300.0, 10.0)]);
    let outside = Ned::new(900.0, -300.0, -10.0);
    check(low, outside, &[(190.0, -300.0, 44.0), (410.0, -300.0, 44.0), (900.0, -300.0, 10.0)]);
    // Within the hole nothing is in the way.
    check(None, Ned::new(150.0, -450.0, -10.0), &[(150.0, -450.0, 10.0)]);
}

#[test]
fn out_of_a_hole_that_is_closed_all_round_there_is_no_way() {
    for to in [Ned::new(0.0, 300.0, -10.0), Ned::new(900.0, 0.0, -10.0)] {
        among(&[two_holes(AreaKind::KeepOut, None)], START, to, |obstacles| {
            assert_eq!(cheapest(obstacles), Err(NoWay::Closed));
        });
    }
}

#[test]
fn a_permission_area_round_a_hole_is_asked_for() {
    let straight = |to: Ned| vec![(0.0, -300.0, 10.0), (to.north_m, to.east_m, to.height_m())];
    for to in [Ned::new(0.0, 300.0, -10.0), Ned::new(900.0, 0.0, -10.0)] {
        among(&[two_holes(AreaKind::Permission, None)], START, to, |obstacles| {
            let way = cheapest(obstacles).expect("there is a way");
            assert_eq!((rounded(&way.points), way.entered), (straight(to), vec![0]));
        });
    }
}

#[test]
fn a_way_in_a_hole_turns_where_the_area_juts_into_it_and_round_what_stands_in_it() {
    // A hole like a U that is open to the north, and a mast between its southern corners.
    let mut hole = rectangle((-200.0, 200.0), (-200.0, 200.0));
    let wall = [(200.0, 50.0), (-100.0, 50.0), (-100.0, -50.0), (200.0, -50.0)];
    hole.splice(2..2, wall.map(|(north, east)| Ned::new(north, -east, 0.0)));
    let outline = rectangle((-600.0, 600.0), (-600.0, 600.0));
    let round = Area { holes: vec![hole], ..Area::new("U", AreaKind::KeepOut, outline) };
    assert_eq!(round.check_rings(), Ok(()));
    let mast = Area::new("mast", AreaKind::KeepOut, rectangle((-140.0, -100.0), (-10.0, 10.0)));
    let (from, to) = (Ned::new(150.0, -120.0, -10.0), Ned::new(150.0, 120.0, -10.0));
    let ends = [(150.0, -120.0, 10.0), (150.0, 120.0, 10.0)];
    let turns = [(-110.0, -60.0, 10.0), (-110.0, 60.0, 10.0)];
    assert_eq!(way_among(std::slice::from_ref(&round), from, to), [ends[0], turns[0], turns[1], ends[1]]);
    let round_mast = [(-150.0, -20.0, 10.0), (-150.0, 20.0, 10.0)];
    let expected = [ends[0], turns[0], round_mast[0], round_mast[1], turns[1], ends[1]];
    assert_eq!(way_among(&[mast, round], from, to), expected);
}
