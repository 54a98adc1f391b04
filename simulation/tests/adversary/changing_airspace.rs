//! Areas that open, close, are granted and revoked around the vehicle.

use super::*;

#[test]
fn a_revocation_in_the_climb_of_a_takeoff_costs_no_objective() {
    // Lower than a metre it lands again, and waits for an operator.
    for height in sample([1.2, 4.0, 9.0]) {
        let parts = with(out_and_back(), area("port", "permission", [-60.0, -60.0], [60.0, 60.0], ""));
        let mut simulation = mission("revoked-takeoff", &parts, Policy::Grant);
        until(&mut simulation, |it| height < -it.down_m);
        simulation.decide("port", Decision::Revoke);
        simulation.pass(s(60));
        simulation.decide("port", Decision::Grant);
        let report = ends(&mut simulation);
        assert_eq!(report.outcome(), MissionOutcome::Success, "{height}: {}", brief(&simulation));
    }
}

#[test]
fn a_tower_that_changes_its_mind_every_three_seconds_is_flown_round() {
    let mut simulation = simulation(None, Policy::Grant);
    simulation.pass(s(5));
    for _ in 0..30 {
        simulation.decide("A", Decision::Revoke);
        simulation.pass(s(3));
        simulation.decide("A", Decision::Grant);
        simulation.pass(s(3));
    }
    ends_as(&mut simulation, MissionOutcome::Success);
    assert!(count(&simulation, "asking for area A") < 8, "{}", brief(&simulation));
}

#[test]
fn a_silent_tower_that_answers_late_is_flown_with() {
    for late_s in [15, 80] {
        let mut simulation = simulation(None, Policy::Silent);
        assert!(simulation.fly_until("asking for area A", LIMIT));
        simulation.pass(s(late_s));
        simulation.decide("A", Decision::Grant);
        simulation.decide("B", Decision::Grant);
        let report = ends(&mut simulation);
        assert_eq!(report.outcome(), MissionOutcome::Success, "{late_s}: {}", brief(&simulation));
    }
}

#[test]
fn a_permission_that_comes_during_a_pause_is_used_after_it() {
    let mut simulation = simulation(None, Policy::Silent);
    simulation.pass(s(30));
    simulation.order(PAUSE);
    simulation.pass(s(200));
    simulation.decide("A", Decision::Grant);
    simulation.decide("B", Decision::Grant);
    simulation.pass(s(5));
    simulation.order(RESUME);
    ends_as(&mut simulation, MissionOutcome::Success);
}

#[test]
fn a_row_of_twelve_areas_is_flown_with_grants_that_are_short() {
    for grant in ["20.0", "100.0"] {
        let config = config_with(&format!("adversary-grants-{grant}"), &[("grant_valid_s", grant)]);
        let mut parts = vec![ground("there", 0.0, 900.0), ground("home", 0.0, 0.0)];
        for number in 0..12 {
            let west = 60.0 + 65.0 * f64::from(number);
            parts.push(area(&format!("area-{number}"), "permission", [-400.0, west], [400.0, west + 40.0], ""));
        }
        let mut simulation = mission_with(&config, &format!("row-{grant}"), &parts, Policy::Grant);
        let report = ends(&mut simulation);
        assert_eq!(report.outcome(), MissionOutcome::Success, "{grant}: {}", brief(&simulation));
        assert!(count(&simulation, "plan ") < 40, "{grant}: {}", brief(&simulation));
    }
}

#[test]
fn a_return_out_of_a_slalom_of_sixty_areas_finds_home() {
    let mut parts = vec![air("there", 0.0, 900.0, 20.0), ground("home", 0.0, 0.0)];
    for row in 0..10 {
        for column in 0..6 {
            let (north, east) =
                (f64::from(row % 2) * 40.0 - 240.0 + 80.0 * f64::from(column), 60.0 + 80.0 * f64::from(row));
            parts.push(area(&format!("k-{row}-{column}"), "keep-out", [north, east], [north + 40.0, east + 40.0], ""));
        }
    }
    let mut simulation = mission("slalom", &parts, Policy::Grant);
    until(&mut simulation, |it| 400.0 < it.east_m);
    simulation.order(RETURN);
    ends(&mut simulation);
    assert!(is_home(&simulation), "{}", brief(&simulation));
}

#[test]
fn a_mission_below_a_low_sky_is_flown_and_each_response_comes_home() {
    for (name, floor) in
        sample([("nothing", 13.0), ("nothing", 16.0), ("battery", 13.0), ("return", 13.0), ("pause", 13.0)])
    {
        let low = area("low", "keep-out", [-500.0, -500.0], [500.0, 500.0], &format!("floor_m = {floor:.1}\n"));
        let parts = vec![air("there", 0.0, 200.0, 6.0), ground("home", 0.0, 0.0), low];
        let mut simulation = mission("low-sky", &parts, Policy::Grant);
        until(&mut simulation, |it| 100.0 < it.east_m);
        match name {
            "battery" => simulation.inject_fault("battery", &["0.2"]),
            "return" => simulation.order(RETURN),
            "pause" => {
                simulation.order(PAUSE);
                simulation.pass(s(30));
                simulation.order(RESUME);
            }
            _ => {}
        }
        ends(&mut simulation);
        assert!(is_home(&simulation), "{name} below {floor} m: {}", brief(&simulation));
    }
}

#[test]
fn a_low_battery_with_no_permission_for_home_waits_as_long_as_it_suffices_and_lands_outside() {
    let harbour = area("harbour", "permission", [-100.0, -100.0], [100.0, 100.0], "");
    let mut simulation = mission("denied-home", &with(out_and_back(), harbour), Policy::Grant);
    until(&mut simulation, |it| 250.0 < it.east_m);
    simulation.decide("harbour", Decision::Deny);
    simulation.pass(s(1));
    simulation.decide("harbour", Decision::Revoke);
    simulation.inject_fault("battery", &["0.24"]);
    ends_as(&mut simulation, MissionOutcome::Emergency);
    assert!(100.0 < simulation.position().unwrap().east_m, "{}", brief(&simulation));
    // Above the 10 % at which it lands where it is: 14 % of 300 Wh, less the way home.
    says(&simulation, "holds for up to 1");
}
