//! Areas that are too wide, or too soon over, to be left: the vehicle holds in them or lands.

use super::*;

/// Paused 150 m to the east, where the whole sky is closed from 300 s to `until_s`; a moment after it was closed.
fn paused_in_a_closed_sky(until_s: u64) -> Simulation<'static> {
    let closed = area("sky", "keep-out", [-5000.0, -5000.0], [5000.0, 5000.0], &window(300, Some(until_s)));
    let mut simulation = mission(&format!("sky-{until_s}"), &with(out_and_back(), closed), Policy::Grant);
    until(&mut simulation, |it| 150.0 < it.east_m);
    simulation.order(PAUSE);
    while simulation.now() < at_s(305) {
        simulation.pass(s(1));
    }
    simulation
}

#[test]
fn a_return_inside_a_closed_sky_waits_for_its_end_or_lands() {
    for (until_s, home) in [(440, true), (1200, false)] {
        let mut simulation = paused_in_a_closed_sky(until_s);
        simulation.order(RETURN);
        ends_as(&mut simulation, MissionOutcome::Emergency);
        assert_eq!(is_home(&simulation), home, "until {until_s} s: {}", brief(&simulation));
        let at = simulation.position().unwrap();
        assert!(at.north_m.hypot(at.east_m) < 400.0, "{at:?}\n{}", brief(&simulation));
    }
}

/// What `kittiwake plan` says must not be flown.
#[test]
fn nothing_takes_off_for_a_mission_whose_end_is_closed_for_longer_than_is_waited() {
    for (until_s, takes_off) in [(140, true), (2_000, false)] {
        let closed = area("over home", "keep-out", [-80.0, -80.0], [80.0, 80.0], &window(60, Some(until_s)));
        let mut simulation = mission(&format!("home-closed-{until_s}"), &with(out_and_back(), closed), Policy::Grant);
        let report = ends(&mut simulation);
        assert_eq!(report.outcome() == MissionOutcome::Success, takes_off, "{}", brief(&simulation));
        assert_eq!(0 < count(&simulation, "step 1 succeeded"), takes_off, "{}", brief(&simulation));
        assert!(takes_off || report.reason.contains("objective `home`"), "{report:?}");
    }
}

#[test]
fn a_low_battery_inside_a_closed_sky_lands() {
    let mut simulation = paused_in_a_closed_sky(560);
    simulation.inject_fault("battery", &["0.2"]);
    ends_as(&mut simulation, MissionOutcome::Emergency);
    let at = simulation.position().unwrap();
    assert!(at.north_m.hypot(at.east_m) < 400.0, "{at:?}\n{}", brief(&simulation));
    assert!(simulation.now() < at_s(480), "{}", brief(&simulation));
}

#[test]
fn a_closed_sky_in_each_phase_is_held_through_or_landed_in() {
    // Closed in the climb, on the way, before the landing; for a minute, for five, for ever.
    for (opens_s, lasts_s) in sample(each([4, 20, 60], [60, 280, 20_000])) {
        let closed = window(opens_s, Some(opens_s + lasts_s));
        let sky = area("sky", "keep-out", [-5000.0, -5000.0], [5000.0, 5000.0], &closed);
        let mut simulation = mission("sky-phases", &with(out_and_back(), sky), Policy::Grant);
        simulation.fly(s(900));
        simulation.pass(s(10));
        let at = simulation.position().unwrap();
        let label = format!("from {opens_s} s for {lasts_s} s: {at:?}\n{}", brief(&simulation));
        assert!(at.north_m.hypot(at.east_m) < 400.0, "{label}");
        assert_eq!(simulation.breaches(), [], "{label}");
        assert!(simulation.is_on_ground(), "{label}");
    }
}

#[test]
fn a_permission_area_two_kilometres_wide_that_is_revoked_is_landed_in() {
    let wide = area("P", "permission", [-3000.0, -3000.0], [3000.0, 3000.0], "");
    let mut simulation = mission("wide", &with(out_and_back(), wide), Policy::Grant);
    until(&mut simulation, |it| 150.0 < it.east_m);
    simulation.decide("P", Decision::Revoke);
    simulation.pass(s(120));
    let at = simulation.position().unwrap();
    assert!(simulation.is_on_ground() && at.east_m < 400.0, "{at:?}\n{}", brief(&simulation));
    simulation.order(RETURN);
    ends(&mut simulation);
}

#[test]
fn a_landing_at_the_delivery_goes_on_when_the_sky_closes_over_it() {
    for height in sample([8.0, 3.0, 0.6]) {
        let parts = vec![ground("there", 0.0, 150.0), ground("home", 0.0, 0.0)];
        let sky = area("P", "permission", [-3000.0, -3000.0], [3000.0, 3000.0], "");
        let mut simulation = mission("closing-landing", &with(parts, sky), Policy::Grant);
        until(&mut simulation, |it| 149.0 < it.east_m && -it.down_m < height);
        simulation.decide("P", Decision::Revoke);
        simulation.pass(s(30));
        assert!(simulation.is_on_ground(), "at {height} m: {}", brief(&simulation));
        assert_eq!(simulation.breaches(), [], "{}", brief(&simulation));
    }
}

#[test]
fn a_return_after_an_unplanned_landing_ends_the_mission_there() {
    let wide = area("P", "permission", [-3000.0, -3000.0], [3000.0, 3000.0], "");
    let mut simulation = mission("unplanned", &with(out_and_back(), wide), Policy::Grant);
    until(&mut simulation, |it| 150.0 < it.east_m);
    simulation.decide("P", Decision::Revoke);
    simulation.pass(s(90));
    assert!(simulation.is_on_ground(), "{}", brief(&simulation));
    simulation.order(RETURN);
    let report = ends_as(&mut simulation, MissionOutcome::Emergency);
    assert!(report.reason.contains("ordered by anna"), "{}", report.reason);
    says(&simulation, "does not fly to (0, 0): stays");
}

#[test]
fn after_a_landing_in_a_wide_area_an_operator_resumes_once_it_is_granted_again() {
    let wide = area("P", "permission", [-3000.0, -3000.0], [3000.0, 3000.0], "");
    let mut simulation = mission("regranted", &with(out_and_back(), wide), Policy::Grant);
    until(&mut simulation, |it| 150.0 < it.east_m);
    simulation.decide("P", Decision::Revoke);
    simulation.pass(s(90));
    simulation.decide("P", Decision::Grant);
    simulation.pass(s(20));
    assert!(simulation.is_on_ground(), "nobody has resumed it: {}", brief(&simulation));
    simulation.order(RESUME);
    ends_as(&mut simulation, MissionOutcome::Success);
}

#[test]
fn a_wide_area_that_is_granted_again_during_the_landing_in_it_is_landed_in() {
    let wide = area("P", "permission", [-3000.0, -3000.0], [3000.0, 3000.0], "");
    let mut simulation = mission("regranted-landing", &with(out_and_back(), wide), Policy::Grant);
    until(&mut simulation, |it| 150.0 < it.east_m);
    simulation.decide("P", Decision::Revoke);
    simulation.pass(s(9));
    simulation.decide("P", Decision::Grant);
    simulation.pass(s(60));
    assert!(simulation.is_on_ground(), "{}", brief(&simulation));
    simulation.order(RESUME);
    ends_as(&mut simulation, MissionOutcome::Success);
}

#[test]
fn an_abort_while_a_closed_sky_is_held_through_lands_at_once() {
    let mut simulation = paused_in_a_closed_sky(560);
    simulation.order(ABORT);
    simulation.pass(s(60));
    assert!(simulation.is_on_ground(), "{}", brief(&simulation));
    ends_as(&mut simulation, MissionOutcome::Emergency);
}

#[test]
fn a_wide_area_is_left_as_long_as_the_permission_outlasts_the_way_however_far_that_is() {
    let wide = area("P", "permission", [-3000.0, -3000.0], [3000.0, 3000.0], "");
    let mut simulation = mission("wide-expiry", &with(out_and_back(), wide), Policy::Grant);
    until(&mut simulation, |it| 150.0 < it.east_m);
    simulation.order(PAUSE);
    simulation.pass(s(10));
    // No further request moves this end.
    simulation.decide_for("P", Decision::Grant, Some(420.0));
    simulation.pass(s(415));
    let at = simulation.position().unwrap();
    assert!(3000.0 < at.north_m.abs().max(at.east_m.abs()), "{at:?}\n{}", brief(&simulation));
    assert_eq!(simulation.breaches(), [], "{}", brief(&simulation));
}
