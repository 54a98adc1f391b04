use super::*;

const PACE: Pace = Pace::REAL_TIME;

/// At 50 m, on its way to the north at 10 m/s.
fn flies() -> LocalPosition {
    LocalPosition {
        position: Ned::new(0.0, 0.0, -50.0),
        velocity: NedVelocity::new(10.0, 0.0, 0.0),
        heading_rad: 0.0,
        horizontal_valid: true,
        vertical_valid: true,
        eph_m: 0.4,
        epv_m: 0.6,
        timestamp_us: 0,
    }
}

fn own(local: &LocalPosition) -> Own<'_> {
    Own { local, intends: None }
}

fn crewed(id: &str, position: Ned, velocity: NedVelocity) -> TransponderReport {
    TransponderReport { id: id.into(), position, velocity, kind: TrafficKind::Crewed }
}

fn at(s: u64) -> Time {
    Time::after(Duration::from_secs(s))
}

fn nearest_m(traffic: &Traffic, now: Time, local: &LocalPosition, kind: TrafficKind) -> f64 {
    traffic.closest_approach_m(now, PACE, own(local), kind)
}

#[test]
fn each_kind_counts_for_itself_and_within_its_heights() {
    let (mut traffic, local) = (Traffic::default(), flies());
    let other = |id: &str, north_m: f64, height_m: f64, kind| TransponderReport {
        kind,
        ..crewed(id, Ned::new(north_m, 0.0, -height_m), NedVelocity::new(10.0, 0.0, 0.0))
    };
    for it in [
        other("helicopter", 300.0, 120.0, TrafficKind::Crewed),
        other("drone", 200.0, 76.0, TrafficKind::Uncrewed),
        other("nearer drone", 250.0, 70.0, TrafficKind::Uncrewed),
        other("ship", 100.0, -20.0, TrafficKind::Vessel),
    ] {
        traffic.hear(Time::ZERO, PACE, Some(own(&local)), it);
    }
    let kinds = [TrafficKind::Crewed, TrafficKind::Uncrewed, TrafficKind::Vessel];
    assert_eq!(kinds.map(|it| nearest_m(&traffic, Time::ZERO, &local, it)), [300.0, 250.0, 100.0]);
    // Of each its share of well clear.
    let near: Vec<String> = traffic.near(Time::ZERO, PACE, own(&local)).into_iter().map(|it| it.id).collect();
    assert_eq!(near, ["helicopter", "nearer drone", "ship"]);
}

#[test]
fn the_closest_approach_is_that_of_straight_flight_and_of_a_stay() {
    /// Of an aircraft so reported two seconds ago, to a vehicle at 10 m/s.
    #[track_caller]
    fn check(position: Ned, velocity: NedVelocity, expected_m: f64) {
        let (mut traffic, local) = (Traffic::default(), flies());
        traffic.hear(Time::ZERO, PACE, Some(own(&local)), crewed("a", position, velocity));
        let found_m = nearest_m(&traffic, at(2), &local, TrafficKind::Crewed);
        assert!((found_m - expected_m).abs() < 1e-6, "{found_m}");
    }
    let place = |north_m, east_m| Ned::new(north_m, east_m, -60.0);
    // Head on, 300 m aside.
    check(place(2000.0, 300.0), NedVelocity::new(-50.0, 0.0, 0.0), 300.0);
    // It flies away: 100 m now, after two seconds at 40 m/s.
    check(place(-20.0, 0.0), NedVelocity::new(-40.0, 0.0, 0.0), 100.0);
    // So far that a minute does not bring it near: 10 km less 62 s of 50 m/s.
    check(place(10_000.0, 0.0), NedVelocity::new(-50.0, 0.0, 0.0), 10_000.0 - 3100.0);
    // Far above, and far above but coming down.
    check(Ned::new(100.0, 0.0, -500.0), NedVelocity::default(), NO_TRAFFIC_M);
    check(Ned::new(100.0, 0.0, -300.0), NedVelocity::new(0.0, 0.0, 20.0), 100.0);
}

/// Something crosses the way 300 m ahead, from the east at 20 m/s. The vehicle stands still once it has heard that.
#[test]
fn what_comes_near_does_not_depend_on_the_answer_and_is_over_when_it_has_passed() {
    let (mut traffic, mut local) = (Traffic::default(), flies());
    let mut found = Vec::new();
    for s in 0..120 {
        if s == 3 {
            local.velocity = NedVelocity::default();
        }
        let report = crewed("a", Ned::new(700.0, 900.0 - 20.0 * s as f64, -50.0), NedVelocity::new(0.0, -20.0, 0.0));
        traffic.hear(at(s), PACE, Some(own(&local)), report);
        found.push(nearest_m(&traffic, at(s), &local, TrafficKind::Crewed));
    }
    let first_m = found[0];
    assert!(first_m < 300.0, "{first_m}");
    // A stay would be well clear, and it counts until it is abeam.
    assert!(found[1..=45].iter().all(|it| *it <= first_m), "{found:?}");
    assert!(found[47..].is_sorted() && 700.0 < found[47], "{found:?}");
}

#[test]
fn what_circles_comes_back() {
    let (mut traffic, local) = (Traffic::default(), LocalPosition { velocity: NedVelocity::default(), ..flies() });
    // 900 m round a place 700 m away, at 30 m/s: half of the time it flies away.
    for s in 0..300 {
        let (sin, cos) = (s as f64 / 30.0).sin_cos();
        let position = Ned::new(700.0 + 900.0 * cos, 900.0 * sin, -50.0);
        let report = crewed("a", position, NedVelocity::new(-30.0 * sin, 30.0 * cos, 0.0));
        traffic.hear(at(s), PACE, Some(own(&local)), report);
        let found_m = nearest_m(&traffic, at(s), &local, TrafficKind::Crewed);
        assert!(s < 94 || found_m < 210.0, "{s} s: {found_m}");
    }
}

#[test]
fn an_aircraft_that_moves_and_is_reported_where_it_was_has_flown_on_and_is_gone_in_the_end() {
    let (mut traffic, local) = (Traffic::default(), flies());
    // Straight at the vehicle, which flies away from it slower.
    let report = crewed("a", Ned::new(-2000.0, 0.0, -50.0), NedVelocity::new(110.0, 0.0, 0.0));
    for s in 0..20 {
        traffic.hear(at(s), PACE, Some(own(&local)), report.clone());
    }
    assert!(nearest_m(&traffic, at(9), &local, TrafficKind::Crewed) < 1.0);
    assert_eq!(nearest_m(&traffic, at(19), &local, TrafficKind::Crewed), NO_TRAFFIC_M);
}

#[test]
fn an_aircraft_that_is_not_reported_any_more_is_gone_and_a_flood_has_an_end() {
    let (mut traffic, local) = (Traffic::default(), flies());
    let report = |id: usize| crewed(&id.to_string(), Ned::new(100.0, 0.0, -50.0), NedVelocity::new(10.0, 0.0, 0.0));
    for id in 0..2 * MOST {
        traffic.hear(Time::ZERO, PACE, Some(own(&local)), report(id));
    }
    assert_eq!((traffic.tracks.len(), traffic.near(at(1), PACE, own(&local)).len()), (MOST, MOST_TOLD));
    let after = |ms| Time::after(Duration::from_millis(ms));
    assert!(nearest_m(&traffic, after(9_900), &local, TrafficKind::Crewed) < 200.0);
    assert_eq!(nearest_m(&traffic, after(10_000), &local, TrafficKind::Crewed), NO_TRAFFIC_M);
    traffic.hear(after(10_000), PACE, Some(own(&local)), report(9999));
    assert_eq!(traffic.tracks.len(), 1);
}

#[test]
fn the_vehicles_own_transponder_is_no_traffic() {
    /// What is counted after twenty seconds: `report` is at this second, the vehicle flies to the north.
    #[track_caller]
    fn check(own_ids: &[&str], report: fn(u64) -> TransponderReport, is_counted: bool) {
        let own_ids: Vec<String> = own_ids.iter().map(|it| (*it).to_owned()).collect();
        let mut traffic = Traffic::except(&own_ids);
        let mut local = flies();
        for s in 0..20 {
            local.position.north_m = 10.0 * s as f64;
            traffic.hear(at(s), PACE, Some(own(&local)), report(s));
        }
        assert_eq!(nearest_m(&traffic, at(19), &local, TrafficKind::Crewed) < 100.0, is_counted);
    }
    fn at_second(s: u64) -> TransponderReport {
        crewed("a", Ned::new(10.0 * s as f64 - 8.0, 5.0, -47.0), NedVelocity::new(10.0, 0.0, 0.0))
    }
    check(&[], at_second, false);
    // One report is late.
    check(&[], |s| at_second(if s == 9 { 4 } else { s }), false);
    // It has come from elsewhere, or leaves.
    check(
        &[],
        |s| if s < 3 { crewed("a", Ned::new(200.0, 0.0, -50.0), NedVelocity::default()) } else { at_second(s) },
        true,
    );
    check(
        &[],
        |s| {
            if s < 10 {
                at_second(s)
            } else {
                crewed("a", Ned::new(190.0, 40.0, -50.0), NedVelocity::new(0.5, 0.0, 0.0))
            }
        },
        true,
    );
    check(&["b", "a"], |_| crewed("a", Ned::new(200.0, 0.0, -50.0), NedVelocity::new(5.0, 0.0, 0.0)), false);
}

#[test]
fn what_stands_takes_a_place_and_comes_no_nearer() {
    /// The area that is taken by what stands at 300 m to the north at this height: how far it reaches, from where to where.
    #[track_caller]
    fn check(kind: TrafficKind, height_m: f64, radius_m: f64, band_m: (Option<f64>, Option<f64>)) {
        let (mut traffic, local) = (Traffic::default(), flies());
        let place = Ned::new(300.0, 0.0, -height_m);
        for s in 0..10 {
            assert_eq!(traffic.occupied(at(s), PACE), [], "{kind:?}");
            let report = TransponderReport { kind, ..crewed("a", place, NedVelocity::new(0.3, -0.2, 0.0)) };
            traffic.hear(at(s), PACE, Some(own(&local)), report);
        }
        assert_eq!(nearest_m(&traffic, at(10), &local, kind), NO_TRAFFIC_M);
        let [area] = &traffic.occupied(at(10), PACE)[..] else { panic!("{kind:?} takes nothing") };
        let beside = |m: f64| Ned::new(300.0, m, 0.0);
        let covers = |m: f64| Area { floor_m: None, ceiling_m: None, ..area.clone() }.contains(beside(m));
        assert!(covers(radius_m - 1.0) && !covers(1.04 * radius_m), "{kind:?}");
        assert_eq!((area.floor_m, area.ceiling_m), band_m, "{kind:?}");
        // It is gone.
        assert_eq!(traffic.occupied(at(20), PACE), []);
    }
    check(TrafficKind::Crewed, 100.0, 610.0, (Some(24.0), Some(176.0)));
    check(TrafficKind::Crewed, 20.0, 610.0, (None, Some(96.0)));
    check(TrafficKind::Crewed, 2.0, 40.0, (None, Some(32.0)));
    check(TrafficKind::Uncrewed, 40.0, 150.0, (Some(15.0), Some(65.0)));
    check(TrafficKind::Uncrewed, 0.0, 15.0, (None, Some(30.0)));
    check(TrafficKind::Vessel, 0.0, 60.0, (None, None));
}
