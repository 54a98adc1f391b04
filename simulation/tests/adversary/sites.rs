//! Where a flight ends that has to end early: sites near and far, closed, revoked, blocked, and ditches.

use super::*;

/// A site of the mission file.
fn site(name: &str, kind: &str, north: f64, east: f64) -> String {
    format!("[[site]]\nname = \"{name}\"\nkind = \"{kind}\"\nnorth_m = {north:.1}\neast_m = {east:.1}\n")
}

/// A look 1,500 m to the east, and home; with these sites and areas.
fn far_out(more: &[String]) -> Vec<String> {
    [&[air("look", 0.0, 1500.0, 20.0), ground("home", 0.0, 0.0)][..], more].concat()
}

/// At 1,000 m on the way out, where a battery of a fifth suffices for some hundred metres: 30 Wh are left above the tenth at which it
/// would land where it is.
#[track_caller]
fn far_with_low_battery(name: &str, more: &[String], permissions: Policy) -> Simulation<'static> {
    let mut simulation = mission(name, &far_out(more), permissions);
    until(&mut simulation, |it| 1000.0 < it.east_m);
    simulation.inject_fault("battery", &["0.2"]);
    simulation
}

#[track_caller]
fn is_at(simulation: &Simulation<'_>, north_m: f64, east_m: f64) {
    let at = simulation.position().expect("it is heard");
    let away_m = (at.north_m - north_m).hypot(at.east_m - east_m);
    assert!(away_m < 5.0, "it is {away_m:.0} m away, at {at:?}:\n{}", brief(simulation));
}

/// The places that the manager tells, best first: name, kept or why not.
fn told(simulation: &Simulation<'_>) -> Vec<String> {
    let line = |it: &v1::Alternate| {
        let asks = it.permissions.iter().map(|area| format!(", asks for {area}")).collect::<String>();
        let reach = if it.why_not.is_empty() { String::new() } else { ", not in reach".to_owned() };
        format!("{}{asks}{reach}", it.name)
    };
    simulation.alternates().iter().map(line).collect()
}

#[test]
fn a_low_battery_lands_at_a_site_nearby_and_not_at_home_far_away() {
    let sites = [site("field", "landing", 100.0, 1100.0), site("meadow", "landing", -200.0, 900.0)];
    let mut simulation = far_with_low_battery("near-site", &sites, Policy::Grant);
    ends_as(&mut simulation, MissionOutcome::Emergency);
    is_at(&simulation, 100.0, 1100.0);
    says(&simulation, "`battery_low`: divert");
    says(&simulation, "flies to site `field` to land");
}

#[test]
fn what_can_be_reached_is_told_before_anything_goes_wrong() {
    let sites = [
        site("pond", "ditch", 50.0, 1000.0),
        site("field", "landing", 100.0, 1100.0),
        site("island", "landing", 300.0, 1000.0),
        site("yard", "landing", -300.0, 1000.0),
        area("water", "keep-out", [250.0, 900.0], [350.0, 1100.0], "until_utc = \"2026-01-01T02:00:00Z\""),
        area("port", "permission", [-350.0, 900.0], [-250.0, 1100.0], ""),
    ];
    let mut simulation = mission("told", &far_out(&sites), Policy::Grant);
    assert_eq!(told(&simulation), Vec::<String>::new(), "nothing flies");
    until(&mut simulation, |it| 1000.0 < it.east_m);
    assert_eq!(told(&simulation), ["field", "home", "yard, asks for port", "pond", "island, not in reach"]);
    let best = simulation.alternates()[0].clone();
    let (length_m, time_s, wh) = (best.length_m.unwrap(), best.time_s.unwrap(), best.energy_wh.unwrap());
    assert!((140.0..200.0).contains(&length_m) && (20.0..60.0).contains(&time_s), "{best:?}");
    assert!((5.0..15.0).contains(&wh) && best.charge.is_some_and(|it| 0.7 < it), "{best:?}");
    simulation.inject_fault("battery", &["0.2"]);
    simulation.pass(s(1));
    let now = told(&simulation);
    assert_eq!(now[0], "field", "{now:?}");
    assert!(now.contains(&"home, not in reach".to_owned()), "{now:?}");
    ends_as(&mut simulation, MissionOutcome::Emergency);
    is_at(&simulation, 100.0, 1100.0);
    assert_eq!(told(&simulation), Vec::<String>::new(), "it has landed");
}

#[test]
fn home_comes_first_while_it_can_be_reached_with_the_reserve_or_is_about_as_near() {
    // A flag by hand: the battery is nearly full.
    let sites = [site("field", "landing", 60.0, 1000.0)];
    let mut simulation = mission("with-reserve", &far_out(&sites), Policy::Grant);
    until(&mut simulation, |it| 1000.0 < it.east_m);
    simulation.inject_flag("battery_low");
    ends_as(&mut simulation, MissionOutcome::Emergency);
    assert!(is_home(&simulation), "{}", brief(&simulation));
    // 300 m from home, 200 m from the site: half a minute of flight is not worth leaving people and charger.
    let sites = [site("field", "landing", 200.0, 300.0)];
    let mut simulation = mission("about-as-near", &far_out(&sites), Policy::Grant);
    until(&mut simulation, |it| 300.0 < it.east_m);
    simulation.inject_fault("battery", &["0.2"]);
    ends_as(&mut simulation, MissionOutcome::Emergency);
    assert!(is_home(&simulation), "{}", brief(&simulation));
}

/// A permission area round the place of the site `field`.
fn field_inside() -> [String; 2] {
    [site("field", "landing", 100.0, 1000.0), area("P", "permission", [60.0, 900.0], [140.0, 1100.0], "")]
}

#[test]
fn a_site_inside_an_area_is_asked_for_if_nothing_else_can_be_reached() {
    let mut simulation = far_with_low_battery("asked", &field_inside(), Policy::Grant);
    ends_as(&mut simulation, MissionOutcome::Emergency);
    is_at(&simulation, 100.0, 1000.0);
    says(&simulation, "asking for area P, which the only way leads through");
}

#[test]
fn what_needs_no_permission_comes_before_a_nearer_site_that_needs_one() {
    let sites = [&field_inside()[..], &[site("meadow", "landing", -150.0, 1000.0)]].concat();
    let mut simulation = far_with_low_battery("free-first", &sites, Policy::Grant);
    ends_as(&mut simulation, MissionOutcome::Emergency);
    is_at(&simulation, -150.0, 1000.0);
    assert_eq!(count(&simulation, "asking for area P"), 0, "{}", brief(&simulation));
}

#[test]
fn a_site_that_nobody_permits_is_given_up_for_a_ditch_once_the_tower_has_not_answered() {
    let sites = [&field_inside()[..], &[site("pond", "ditch", -150.0, 1000.0)]].concat();
    let mut simulation = far_with_low_battery("silent", &sites, Policy::Silent);
    ends_as(&mut simulation, MissionOutcome::Emergency);
    is_at(&simulation, -150.0, 1000.0);
    says(&simulation, "asking for area P, which the only way leads through");
    says(&simulation, "flies to ditch `pond` to land");
}

#[test]
fn a_site_that_is_revoked_on_the_way_is_left_for_the_next_one() {
    let sites = [&field_inside()[..], &[site("meadow", "landing", -200.0, 1000.0)]].concat();
    let mut simulation = mission("revoked", &far_out(&sites), Policy::Grant);
    simulation.decide("P", Decision::Grant);
    until(&mut simulation, |it| 1000.0 < it.east_m);
    simulation.inject_fault("battery", &["0.2"]);
    assert!(simulation.fly_until("flies to site `field` to land", LIMIT), "{}", brief(&simulation));
    until(&mut simulation, |it| 20.0 < it.north_m);
    simulation.decide("P", Decision::Revoke);
    ends_as(&mut simulation, MissionOutcome::Emergency);
    is_at(&simulation, -200.0, 1000.0);
}

#[test]
fn a_site_that_is_revoked_on_the_way_without_another_is_asked_for_again() {
    let mut simulation = mission("revoked-only", &far_out(&field_inside()), Policy::Grant);
    simulation.decide("P", Decision::Grant);
    until(&mut simulation, |it| 1000.0 < it.east_m);
    simulation.inject_fault("battery", &["0.2"]);
    assert!(simulation.fly_until("flies to site `field` to land", LIMIT), "{}", brief(&simulation));
    until(&mut simulation, |it| 20.0 < it.north_m);
    simulation.decide("P", Decision::Revoke);
    let asks = "asking for area P, which the only way leads through";
    assert!(simulation.fly_until(asks, LIMIT), "{}", brief(&simulation));
    simulation.decide("P", Decision::Grant);
    ends_as(&mut simulation, MissionOutcome::Emergency);
    is_at(&simulation, 100.0, 1000.0);
}

#[test]
fn a_dead_planner_does_not_keep_a_low_battery_from_the_nearest_site() {
    let sites = [site("field", "landing", 100.0, 1100.0)];
    let mut simulation = mission("planner-dead", &far_out(&sites), Policy::Grant);
    until(&mut simulation, |it| 700.0 < it.east_m);
    simulation.freeze("planner", s(3600));
    until(&mut simulation, |it| 1000.0 < it.east_m);
    simulation.inject_fault("battery", &["0.2"]);
    let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", brief(&simulation)));
    assert_eq!(report.outcome(), MissionOutcome::Emergency, "{}", brief(&simulation));
    assert!(simulation.is_on_ground() && simulation.breaches().is_empty(), "{}", brief(&simulation));
    is_at(&simulation, 100.0, 1100.0);
}

#[test]
fn a_dead_planner_a_silent_ground_and_a_low_battery_at_once_end_at_the_nearest_site() {
    let sites = [site("field", "landing", 100.0, 1100.0)];
    let mut simulation = mission("all-at-once", &far_out(&sites), Policy::Grant);
    until(&mut simulation, |it| 1000.0 < it.east_m);
    simulation.freeze("planner", s(3600));
    simulation.freeze("gateway", s(3600));
    simulation.freeze("control-tower", s(3600));
    simulation.inject_fault("battery", &["0.2"]);
    let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", brief(&simulation)));
    assert_eq!(report.outcome(), MissionOutcome::Emergency, "{}", brief(&simulation));
    is_at(&simulation, 100.0, 1100.0);
}

#[test]
fn a_blocked_site_is_left_for_the_other_one() {
    let sites = [site("near", "landing", 60.0, 1000.0), site("far", "landing", 300.0, 1000.0)];
    let mut simulation = mission("blocked", &far_out(&sites), Policy::Grant);
    until(&mut simulation, |it| 1000.0 < it.east_m);
    simulation.inject_fault("blocked_landing", &["on"]);
    simulation.order(ABORT);
    assert!(simulation.fly_until("flies to site `near` to land", LIMIT), "{}", brief(&simulation));
    assert!(simulation.fly_until("flies to site `far` to land", LIMIT), "{}", brief(&simulation));
    simulation.inject_fault("blocked_landing", &["off"]);
    ends_as(&mut simulation, MissionOutcome::Emergency);
    is_at(&simulation, 300.0, 1000.0);
}

#[test]
fn a_ditch_near_by_is_not_chosen_while_a_landing_can_be_reached() {
    let sites = [site("pond", "ditch", 30.0, 1000.0), site("field", "landing", 300.0, 1000.0)];
    let mut simulation = far_with_low_battery("ditch-near", &sites, Policy::Grant);
    ends_as(&mut simulation, MissionOutcome::Emergency);
    is_at(&simulation, 300.0, 1000.0);
    assert_eq!(count(&simulation, "flies to ditch"), 0, "{}", brief(&simulation));
}

#[test]
fn a_ditch_is_chosen_if_no_landing_can_be_reached() {
    let sites = [site("pond", "ditch", 150.0, 1000.0)];
    let mut simulation = far_with_low_battery("ditch-only", &sites, Policy::Grant);
    ends_as(&mut simulation, MissionOutcome::Emergency);
    is_at(&simulation, 150.0, 1000.0);
    says(&simulation, "flies to ditch `pond` to land");
}

#[test]
fn a_site_inside_what_is_closed_for_now_is_no_place_to_go_to() {
    let sites = [
        site("field", "landing", 100.0, 1000.0),
        area("K", "keep-out", [60.0, 900.0], [140.0, 1100.0], &window(0, Some(7000))),
        site("meadow", "landing", -200.0, 1000.0),
    ];
    let mut simulation = far_with_low_battery("closed-site", &sites, Policy::Grant);
    ends_as(&mut simulation, MissionOutcome::Emergency);
    is_at(&simulation, -200.0, 1000.0);
}

#[test]
fn a_low_battery_before_the_takeoff_or_after_the_end_goes_nowhere() {
    let sites = [site("field", "landing", 30.0, 20.0)];
    let parts = [&[air("look", 0.0, 100.0, 20.0), ground("home", 0.0, 0.0)][..], &sites].concat();
    let mut simulation = mission("on-ground", &parts, Policy::Grant);
    simulation.inject_fault("battery", &["0.2"]);
    simulation.pass(s(120));
    assert!(simulation.is_on_ground() && is_home(&simulation), "{}", brief(&simulation));
    assert_eq!(told(&simulation), Vec::<String>::new());
    let mut simulation = mission("after", &parts, Policy::Grant);
    ends_as(&mut simulation, MissionOutcome::Success);
    simulation.inject_fault("battery", &["0.2"]);
    simulation.pass(s(120));
    assert!(simulation.is_on_ground() && is_home(&simulation), "{}", brief(&simulation));
}
