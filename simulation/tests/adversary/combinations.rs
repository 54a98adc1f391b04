//! Orders on the ground, closures and short grants, in combinations.

use super::*;

/// A delivery inside of B, 500 m to the east, and home; the tower gives this many seconds for B just before the landing there.
fn delivers_with_a_grant_of(seconds: f64) -> Simulation<'static> {
    let mut simulation = simulation(None, Policy::Grant);
    until(&mut simulation, |it| 450.0 < it.east_m);
    simulation.decide_for("B", Decision::Grant, Some(seconds));
    simulation
}

#[track_caller]
fn lands_at_the_delivery(simulation: &mut Simulation<'_>) {
    assert!(simulation.fly_until("step 5 of 5: land", LIMIT), "{}", brief(simulation));
    until(simulation, |it| -it.down_m < 0.3);
}

/// The vehicle does not leave the ground again, and the mission ends.
#[track_caller]
fn stays_down(simulation: &mut Simulation<'_>) {
    let place = simulation.position().unwrap();
    for _ in 0..600 {
        simulation.pass(Duration::from_millis(500));
        let at = simulation.position().unwrap();
        assert!(-at.down_m < 1.0, "it flies at {at:?}:\n{}", brief(simulation));
    }
    ends(simulation);
    let at = simulation.position().unwrap();
    assert!((at.north_m - place.north_m).hypot(at.east_m - place.east_m) < 3.0, "{at:?}\n{}", brief(simulation));
}

#[test]
fn an_order_to_come_back_keeps_a_vehicle_down_whatever_it_waits_for_on_the_ground() {
    let port = |kind: &str, more: &str| area("port", kind, [-60.0, -60.0], [60.0, 60.0], more);
    let closed = window(0, Some(60));
    let waits = [
        ("permission", with(out_and_back(), port("permission", "")), Policy::Silent),
        ("denial", with(out_and_back(), port("permission", "")), Policy::Deny),
        ("closure", with(out_and_back(), port("keep-out", &closed)), Policy::Grant),
    ];
    for ((name, parts, policy), verb) in sample(each(waits, [RETURN, land_at(0.0, 0.0), land_at(120.0, 0.0)])) {
        let mut simulation = mission(&format!("waits-{name}"), &parts, policy);
        simulation.pass(s(8));
        simulation.order(verb.clone());
        stays_down(&mut simulation);
        says(&simulation, "stays, and ends the mission on the ground");
    }
}

#[test]
fn an_order_to_come_back_at_the_delivery_keeps_it_there_and_says_so() {
    for (verb, after_s) in sample(each([RETURN, land_at(0.0, 0.0), land_at(0.0, 500.0)], [0, 3, 6])) {
        let mut simulation = simulation(None, Policy::Grant);
        lands_at_the_delivery(&mut simulation);
        simulation.pass(s(after_s));
        if !simulation.is_on_ground() {
            // Still in the air by the rule, or with its motors on: it flies home.
            continue;
        }
        simulation.order(verb.clone());
        stays_down(&mut simulation);
        says(&simulation, "ends the mission on the ground");
    }
}

#[test]
fn a_pause_on_the_ground_followed_by_a_return_ends_the_mission_there() {
    let mut simulation = simulation(None, Policy::Grant);
    simulation.pass(s(1));
    simulation.order(PAUSE);
    simulation.pass(s(20));
    simulation.order(RETURN);
    stays_down(&mut simulation);
    simulation.order(RESUME);
    simulation.pass(s(60));
    assert!(simulation.is_on_ground(), "{}", brief(&simulation));
}

#[test]
fn a_return_while_a_new_grant_is_waited_for_keeps_it_down() {
    let mut simulation = delivers_with_a_grant_of(60.0);
    assert!(simulation.fly_until("asked for again once it has ended", LIMIT), "{}", brief(&simulation));
    simulation.order(RETURN);
    stays_down(&mut simulation);
}

#[test]
fn a_new_grant_that_is_denied_is_asked_for_once_more_and_then_given_up() {
    let mut simulation = delivers_with_a_grant_of(60.0);
    assert!(simulation.fly_until("asked for again once it has ended", LIMIT), "{}", brief(&simulation));
    simulation.decide("B", Decision::Revoke);
    let report = ends(&mut simulation);
    assert!(count(&simulation, "asking for area B") < 8, "{}", brief(&simulation));
    assert!(!report.reason.is_empty());
}

#[test]
fn where_no_grant_is_long_enough_to_fly_out_of_the_area_it_lands_again_and_waits_for_an_operator() {
    let config = config_with("adversary-always-short", &[("grant_valid_s", "100.0")]);
    // Home is far outside of an area that no grant outlasts.
    let parts = vec![ground("there", 0.0, 30.0), ground("home", 0.0, 1400.0)];
    let parts = with(parts, area("P", "permission", [-900.0, -900.0], [900.0, 1300.0], ""));
    let mut simulation = mission_with(&config, "always-short", &parts, Policy::Grant);
    let report = ends_as(&mut simulation, MissionOutcome::Failure);
    assert!(report.reason.contains("landed because of `area_breached`, and no operator resumed"), "{}", report.reason);
    assert_eq!(count(&simulation, "takeoff by 10 m"), 2, "the plan's and the step's: {}", brief(&simulation));
}

#[test]
fn a_landing_ordered_inside_an_area_whose_tower_refuses_goes_elsewhere_and_says_so() {
    for policy in [Policy::Deny, Policy::Silent] {
        let parts = with(out_and_back(), area("P", "permission", [100.0, 100.0], [200.0, 200.0], ""));
        let mut simulation = mission("land-refused", &parts, policy);
        until(&mut simulation, |it| 150.0 < it.east_m);
        simulation.order(land_at(150.0, 150.0));
        ends_as(&mut simulation, MissionOutcome::Emergency);
        says(&simulation, "asks for P first");
        says(&simulation, "land_at failed");
        let at = simulation.position().unwrap();
        assert!(!(100.0..200.0).contains(&at.north_m), "{at:?}\n{}", brief(&simulation));
    }
}

#[test]
fn a_landing_ordered_inside_an_area_that_is_revoked_on_the_way_goes_elsewhere() {
    let parts = with(out_and_back(), area("P", "permission", [100.0, 100.0], [300.0, 300.0], ""));
    let mut simulation = mission("land-revoked", &parts, Policy::Grant);
    until(&mut simulation, |it| 150.0 < it.east_m);
    simulation.order(land_at(200.0, 200.0));
    until(&mut simulation, |it| 130.0 < it.north_m);
    simulation.decide("P", Decision::Revoke);
    ends_as(&mut simulation, MissionOutcome::Emergency);
    let at = simulation.position().unwrap();
    let is_inside = (100.0..300.0).contains(&at.north_m) && (100.0..300.0).contains(&at.east_m);
    assert!(!is_inside, "{at:?}\n{}", brief(&simulation));
}

#[test]
fn an_ordered_place_that_a_closure_begins_near_later_is_judged_by_the_time_of_arrival() {
    // The place is 5 m from a border; the area applies during the flight there, or only much later.
    for (opens_s, words) in [(40, "land at: refused"), (2000, "land at: flies to (150, 95)")] {
        let closed = area("K", "keep-out", [100.0, 100.0], [200.0, 200.0], &window(opens_s, None));
        let mut simulation = mission("land-later", &with(out_and_back(), closed), Policy::Grant);
        until(&mut simulation, |it| 100.0 < it.east_m);
        simulation.order(land_at(150.0, 95.0));
        simulation.pass(s(2));
        says(&simulation, words);
    }
}

#[test]
fn a_landing_aside_of_a_blocked_place_keeps_its_distance_to_borders() {
    // Fences 33 m round the only landing site.
    let fence =
        |name: &str, south: [f64; 2], north: [f64; 2]| area(name, "keep-out", south, north, "ceiling_m = 5.0\n");
    let parts = vec![air("look", 0.0, 300.0, 20.0), ground("home", 0.0, 0.0)];
    let parts = with(parts, fence("north", [33.0, -200.0], [60.0, 200.0]));
    let parts = with(parts, fence("south", [-60.0, -200.0], [-33.0, 200.0]));
    let mut simulation = mission("fenced", &parts, Policy::Grant);
    until(&mut simulation, |it| 150.0 < it.east_m);
    simulation.inject_fault("blocked_landing", &["on"]);
    until(&mut simulation, |it| it.east_m < 1.0 && -it.down_m < 3.0);
    let first = simulation.position().unwrap();
    until(&mut simulation, |it| {
        20.0 < (first.north_m - it.north_m).hypot(first.east_m - it.east_m) && -it.down_m < 3.0
    });
    let at = simulation.position().unwrap();
    assert!(at.north_m.abs() < 23.5, "{at:?}\n{}", brief(&simulation));
    simulation.inject_fault("clear", &[]);
    ends(&mut simulation);
}

#[test]
fn flags_that_hold_and_orders_alternating_cost_no_objective() {
    let mut simulation = mission("alternating", &out_and_back(), Policy::Grant);
    until(&mut simulation, |it| 50.0 < it.east_m);
    for _ in 0..10 {
        simulation.inject_flag("obstacle");
        simulation.pass(Duration::from_millis(300));
        simulation.order(PAUSE);
        simulation.lower_flag("obstacle");
        simulation.pass(s(1));
        simulation.order(RESUME);
        simulation.pass(Duration::from_millis(700));
    }
    ends_as(&mut simulation, MissionOutcome::Success);
}

#[test]
fn an_obstacle_at_every_takeoff_ends_the_tries() {
    let mut simulation = mission("obstacle-takeoff", &out_and_back(), Policy::Grant);
    for _ in 0..8 {
        simulation.pass(Duration::from_millis(200));
        simulation.inject_flag("obstacle");
        simulation.pass(Duration::from_millis(50));
        simulation.lower_flag("obstacle");
    }
    let report = ends_as(&mut simulation, MissionOutcome::Failure);
    assert!(report.reason.contains("takeoff failed"), "{}", report.reason);
}

#[test]
fn a_landing_ordered_in_the_air_and_again_on_the_ground_elsewhere_stays_where_it_landed() {
    let mut simulation = mission("twice", &out_and_back(), Policy::Grant);
    until(&mut simulation, |it| 150.0 < it.east_m);
    simulation.order(land_at(60.0, 150.0));
    until(&mut simulation, |it| 58.0 < it.north_m && -it.down_m < 0.2);
    simulation.pass(Duration::from_millis(900));
    simulation.order(land_at(-60.0, 150.0));
    let report = ends(&mut simulation);
    assert_eq!(report.outcome(), MissionOutcome::Emergency);
}

#[test]
fn a_closure_over_the_delivery_during_the_stop_there_is_waited_for_on_the_ground() {
    let parts = vec![ground("there", 0.0, 150.0), ground("home", 0.0, 0.0)];
    let closed = area("K", "keep-out", [-50.0, 100.0], [50.0, 200.0], &window(90, Some(150)));
    let mut simulation = mission("closed-delivery", &with(parts, closed), Policy::Grant);
    until(&mut simulation, |it| 149.0 < it.east_m && -it.down_m < 0.3);
    simulation.order(PAUSE);
    simulation.pass(s(95));
    simulation.order(RESUME);
    ends_as(&mut simulation, MissionOutcome::Success);
    assert!(is_home(&simulation), "{}", brief(&simulation));
}

#[test]
fn a_plan_that_waits_for_approval_is_not_flown_after_a_return() {
    let config = config_with("adversary-approval", &[("plan_approval", "\"each-plan\"")]);
    let mut simulation = mission_with(&config, "approval", &out_and_back(), Policy::Grant);
    simulation.pass(s(5));
    simulation.order(RETURN);
    stays_down(&mut simulation);
    says(&simulation, "stays, and ends the mission on the ground");
}

#[test]
fn a_pause_and_resume_while_a_new_grant_is_waited_for_end_at_home() {
    let mut simulation = delivers_with_a_grant_of(60.0);
    assert!(simulation.fly_until("asked for again once it has ended", LIMIT), "{}", brief(&simulation));
    simulation.order(PAUSE);
    simulation.pass(s(5));
    simulation.order(RESUME);
    ends_as(&mut simulation, MissionOutcome::Success);
    assert!(is_home(&simulation), "{}", brief(&simulation));
}

#[test]
fn a_mission_uploaded_while_a_new_grant_is_waited_for_is_flown() {
    let mut simulation = delivers_with_a_grant_of(60.0);
    assert!(simulation.fly_until("asked for again once it has ended", LIMIT), "{}", brief(&simulation));
    let text = format!("name = \"new\"\n{}{}", air("north", 120.0, 500.0, 15.0), ground("there", 60.0, 500.0));
    simulation.ask(Ask::Upload(v1::MissionText { text, wind: None }));
    let report = ends_as(&mut simulation, MissionOutcome::Success);
    assert_eq!(report.objectives[0].name, "north", "{}", brief(&simulation));
}

#[test]
fn a_low_battery_on_the_way_into_an_area_whose_tower_is_silent_lands_elsewhere() {
    let parts = with(out_and_back(), area("P", "permission", [100.0, 100.0], [200.0, 200.0], ""));
    let mut simulation = mission("land-silent-low", &parts, Policy::Silent);
    until(&mut simulation, |it| 150.0 < it.east_m);
    simulation.order(land_at(150.0, 150.0));
    simulation.pass(s(3));
    simulation.inject_fault("battery", &["0.2"]);
    let begun = simulation.now();
    ends_as(&mut simulation, MissionOutcome::Emergency);
    assert!(simulation.now() - begun < s(240), "{}", brief(&simulation));
}

/// The place is closed now and free again before the vehicle could be there, or only after it.
#[test]
fn a_landing_ordered_into_a_closure_is_refused_as_long_as_it_applies() {
    let closed = area("K", "keep-out", [100.0, 100.0], [200.0, 200.0], &window(0, Some(120)));
    let mut simulation = mission("land-closed", &with(out_and_back(), closed), Policy::Grant);
    until(&mut simulation, |it| 100.0 < it.east_m);
    simulation.order(land_at(150.0, 150.0));
    simulation.pass(s(2));
    says(&simulation, "land at: refused: the place lies in keep-out area `K`, which applies then");
    simulation.order(PAUSE);
    while simulation.now() < at_s(125) {
        simulation.pass(s(1));
    }
    simulation.order(land_at(150.0, 150.0));
    ends_as(&mut simulation, MissionOutcome::Emergency);
    assert!(140.0 < simulation.position().unwrap().north_m, "{}", brief(&simulation));
}

#[test]
fn a_status_that_freezes_for_a_minute_costs_no_more_than_that() {
    for (moment, freezes_at) in sample([("spool-up", -1.0), ("climb", 5.0), ("way", 150.0), ("landing", 1000.0)]) {
        let mut simulation = mission("frozen-status", &out_and_back(), Policy::Grant);
        match moment {
            "spool-up" => simulation.pass(s(1)),
            "climb" => until(&mut simulation, |it| freezes_at < -it.down_m),
            "way" => until(&mut simulation, |it| freezes_at < it.east_m),
            _ => {
                until(&mut simulation, |it| 200.0 < it.east_m);
                until(&mut simulation, |it| it.east_m < 2.0 && -it.down_m < 6.0);
            }
        }
        simulation.inject_fault("freeze", &["vehicle_status"]);
        simulation.pass(s(60));
        simulation.inject_fault("thaw", &["vehicle_status"]);
        let report = ends(&mut simulation);
        assert_ne!(report.outcome(), MissionOutcome::Crash, "{moment}: {}", brief(&simulation));
        assert!(is_home(&simulation), "{moment}: {:?}\n{}", simulation.position(), brief(&simulation));
    }
}

#[test]
fn a_status_that_freezes_for_good_ends_the_mission_on_the_ground() {
    for (moment, freezes_at) in sample([("climb", 5.0), ("way", 150.0), ("landing", 1000.0)]) {
        let mut simulation = mission("frozen-for-good", &out_and_back(), Policy::Grant);
        match moment {
            "climb" => until(&mut simulation, |it| freezes_at < -it.down_m),
            "way" => until(&mut simulation, |it| freezes_at < it.east_m),
            _ => {
                until(&mut simulation, |it| 200.0 < it.east_m);
                until(&mut simulation, |it| it.east_m < 2.0 && -it.down_m < 6.0);
            }
        }
        simulation.inject_fault("freeze", &["vehicle_status"]);
        let report = simulation.fly(LIMIT);
        simulation.pass(s(30));
        let at = simulation.position().unwrap();
        assert!(report.is_some(), "{moment}, {at:?}: no end\n{}", brief(&simulation));
        assert!(-at.down_m < 0.5, "{moment}, {at:?}\n{}", brief(&simulation));
    }
}

/// What it says of its mode and its motors is what was once, and its land detector lies as well.
#[test]
fn an_abort_lands_also_with_a_status_that_is_frozen_and_a_land_detector_that_sticks() {
    for (moment, stuck) in sample([("climb", "landed"), ("climb", "flying"), ("way", "landed"), ("way", "flying")]) {
        let mut simulation = mission("frozen-and-stuck", &out_and_back(), Policy::Grant);
        match moment {
            "climb" => until(&mut simulation, |it| 0.2 < -it.down_m),
            _ => until(&mut simulation, |it| 150.0 < it.east_m),
        }
        simulation.inject_fault("freeze", &["vehicle_status"]);
        simulation.pass(Duration::from_millis(200));
        simulation.inject_fault("land_detector", &[stuck]);
        simulation.pass(s(12));
        simulation.order(ABORT);
        let place = simulation.position().unwrap();
        let report = simulation.fly(s(100));
        let story = brief(&simulation);
        // Two witnesses of three say that it flies: then it stays where it is, and the mission is not over.
        assert_eq!(report.is_some(), stuck == "landed", "{moment}, {stuck}\n{story}");
        for _ in 0..120 {
            let at = simulation.position().unwrap();
            assert!(-at.down_m < 0.5, "{moment}, {stuck}, {at:?}\n{story}");
            let aside_m = (at.north_m - place.north_m).hypot(at.east_m - place.east_m);
            assert!(aside_m < 20.0, "{moment}, {stuck}: {aside_m} m\n{story}");
            simulation.pass(s(1));
        }
    }
}

/// A pause in the first metre of a takeoff, and then nobody knows in which mode it is.
#[test]
fn who_hovers_low_with_a_silent_status_is_landed_by_an_abort_and_not_called_landed_before() {
    for ((fault, paused_at_m), silent_for) in
        sample(each([("drop", 0.1), ("drop", 0.4), ("freeze", 0.2), ("freeze", 0.6)], [5, 9, 12, 30]))
    {
        let mut simulation = mission("low-hover", &out_and_back(), Policy::Grant);
        until(&mut simulation, |it| paused_at_m < -it.down_m);
        simulation.inject_flag("operator_pause");
        simulation.pass(s(2));
        simulation.inject_fault(fault, &["vehicle_status"]);
        simulation.pass(s(silent_for));
        let hovers_at = simulation.position().unwrap();
        assert!((0.05..1.2).contains(&-hovers_at.down_m), "{hovers_at:?}");
        // An order would end the pause.
        simulation.inject_flag("operator_abort");
        while simulation.report().is_none() && simulation.now() < at_s(200) {
            simulation.pass(Duration::from_millis(100));
        }
        let at = simulation.position().unwrap();
        let story =
            || format!("{fault}, {paused_at_m} m, {silent_for} s: {hovers_at:?}, {at:?}\n{}", brief(&simulation));
        assert!(simulation.report().is_some(), "{}", story());
        assert!(-at.down_m < 0.2, "over in the air: {}", story());
    }
}

/// It speaks half a second or more too early, and sticks.
#[test]
fn a_land_detector_that_speaks_in_the_descent_ends_no_landing_above_the_ground() {
    for height_m in sample([0.9, 0.6, 0.4, 0.2]) {
        let mut simulation = simulation(None, Policy::Grant);
        assert!(simulation.fly_until("step 5 of 5: land", LIMIT), "{}", brief(&simulation));
        until(&mut simulation, |it| -it.down_m < height_m);
        simulation.inject_fault("land_detector", &["landed"]);
        while !simulation.decisions().iter().any(|it| it.1.text == "step 5 succeeded") && simulation.now() < at_s(300) {
            simulation.pass(Duration::from_millis(20));
        }
        let at = simulation.position().unwrap();
        assert!(-at.down_m < 0.15, "{height_m}, {at:?}\n{}", brief(&simulation));
        ends_as(&mut simulation, MissionOutcome::Success);
    }
}
