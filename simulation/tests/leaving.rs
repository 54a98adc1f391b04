//! Inside an area that closes, opens, is revoked or runs out, the vehicle leaves by the shortest way, whatever it does there.

use std::ops::Range;
use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::operator_command::Verb;
use kittiwake_proto::v1::{self, Decision};
use simulation::{Memory, Simulation};

use crate::stories::support::{config, config_with, mission_file, simulation, simulation_of};

const LIMIT: Duration = Duration::from_secs(2400);

/// In the middle of area A of the reference mission: from 110 m to 290 m east, 90 m to either side.
#[track_caller]
fn inside() -> Simulation<'static> {
    inside_of(simulation(None, Policy::Grant))
}

/// The same for this flight of the reference mission.
#[track_caller]
fn inside_of(mut simulation: Simulation<'static>) -> Simulation<'static> {
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    while simulation.position().is_none_or(|it| it.east_m < 180.0) {
        simulation.pass(Duration::from_millis(200));
    }
    simulation
}

/// Fails unless the vehicle is out of area A within `seconds`, and breaks no rule until then.
#[track_caller]
fn leaves(simulation: &mut Simulation<'_>, seconds: u64) {
    let is_inside = |it: v1::Ned| (110.0..290.0).contains(&it.east_m) && it.north_m.abs() < 90.0;
    for _ in 0..seconds * 5 {
        simulation.pass(Duration::from_millis(200));
        if !simulation.position().is_some_and(is_inside) {
            assert_eq!(simulation.breaches(), [], "{}", simulation.decision_log());
            return;
        }
    }
    panic!("still at {:?}:\n{}", simulation.position(), simulation.decision_log());
}

/// Until a process that was killed is there again.
const DEAD: Duration = Duration::from_millis(300);

/// Fails if the manager believed at any time that it breaches an area.
#[track_caller]
fn breached_nothing(simulation: &Simulation<'_>) {
    let log = simulation.decision_log();
    assert!(!log.contains("area_breached"), "{log}");
    assert_eq!(simulation.breaches(), [], "{log}");
}

#[test]
fn a_manager_that_is_killed_inside_has_its_permission_when_it_is_back() {
    let mut simulation = inside();
    // The second time before it has heard the tower.
    for time in [DEAD, DEAD, Duration::from_secs(5)] {
        simulation.restart("mcm", time, Memory::Restored);
        simulation.pass(time + Duration::from_millis(50));
    }
    let report = simulation.fly(LIMIT).expect("the mission ends");
    assert_eq!(report.outcome(), v1::MissionOutcome::Success, "{}", simulation.decision_log());
    breached_nothing(&simulation);
}

#[test]
fn without_memory_and_tower_it_leaves() {
    let mut simulation = inside();
    simulation.freeze("control-tower", LIMIT);
    simulation.restart("mcm", DEAD, Memory::Lost);
    simulation.pass(Duration::from_secs(3));
    // It may still hear that it is granted.
    breached_nothing(&simulation);
    leaves(&mut simulation, 40);
    assert!(simulation.decision_log().contains("inside area A without permission"), "{}", simulation.decision_log());
}

#[test]
fn what_was_revoked_while_the_manager_was_dead_is_left() {
    let mut simulation = inside();
    simulation.restart("mcm", Duration::from_secs(3), Memory::Restored);
    simulation.decide("A", Decision::Revoke);
    leaves(&mut simulation, 30);
}

#[test]
fn what_was_revoked_while_everybody_on_board_was_dead_is_not_entered_before_the_tower_is_heard() {
    let mut simulation = simulation(None, Policy::Grant);
    assert!(simulation.fly_until("area A: granted", LIMIT), "{}", simulation.decision_log());
    while simulation.position().is_none_or(|it| it.east_m < 60.0) {
        simulation.pass(Duration::from_millis(200));
    }
    for node in ["mcm", "planner", "skill-manager", "monitor"] {
        simulation.restart(node, Duration::from_secs(15), Memory::Restored);
    }
    simulation.pass(Duration::from_secs(5));
    simulation.decide("A", Decision::Revoke);
    simulation.pass(Duration::from_secs(1));
    simulation.freeze("control-tower", Duration::from_secs(60));
    simulation.pass(Duration::from_secs(40));
    assert_eq!(simulation.breaches(), [], "{}", simulation.decision_log());
    let log = simulation.decision_log();
    assert!(log.contains("it comes to rest"), "it did not come near the border:\n{log}");
    // Once the tower is heard, the area is flown round, or the objective fails.
    simulation.fly(LIMIT).expect("the mission ends");
    assert_eq!(simulation.breaches(), [], "{}", simulation.decision_log());
    assert!(simulation.decision_log().contains("area A: denied (by hand)"), "{}", simulation.decision_log());
}

/// A manager that comes back before the planner knows the mission's areas, also where another mission was uploaded.
#[test]
fn a_return_leads_round_an_area_before_the_planner_is_heard_again() {
    #[track_caller]
    fn check(is_uploaded: bool) {
        let path = config().join("missions/keep_out.toml");
        let text = std::fs::read_to_string(&path).expect("it is shipped");
        let mut simulation = simulation(Some(&path).filter(|_| !is_uploaded).map(|it| it.as_path()), Policy::Grant);
        if is_uploaded {
            simulation.pass(Duration::from_secs(5));
            let upload = v1::MissionText { text, wind: None };
            simulation.ask(v1::mission_request::Request::Upload(upload));
        }
        while simulation.position().is_none_or(|it| it.north_m < 280.0) {
            simulation.pass(Duration::from_millis(200));
        }
        simulation.order(Verb::Return(v1::ReturnHome { overrides: false }));
        simulation.pass(Duration::from_secs(1));
        simulation.restart("planner", Duration::from_secs(100), Memory::Restored);
        simulation.restart("mcm", DEAD, Memory::Restored);
        simulation.pass(Duration::from_secs(15));
        let north_m = simulation.position().map_or(0.0, |it| it.north_m);
        assert!(north_m < 260.0, "at {north_m} m:\n{}", simulation.decision_log());
        simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
        assert_eq!(simulation.breaches(), [], "{}", simulation.decision_log());
        assert!(simulation.position().is_some_and(|it| it.north_m.abs() < 5.0), "{}", simulation.decision_log());
    }
    check(false);
    check(true);
}

#[test]
fn a_leave_that_was_under_way_goes_on_after_a_restart() {
    let mut simulation = inside();
    simulation.decide("A", Decision::Revoke);
    simulation.pass(Duration::from_secs(1));
    simulation.restart("mcm", DEAD, Memory::Restored);
    leaves(&mut simulation, 30);
}

/// Kills the manager inside the area while the tower is silent, and sets the wall clock by this much before it is back.
#[track_caller]
fn killed_inside_without_tower(clock_ms: i64) -> Simulation<'static> {
    let mut simulation = inside();
    simulation.order(Verb::Pause(v1::PauseMission { overrides: false }));
    simulation.pass(Duration::from_secs(10));
    simulation.decide_for("A", Decision::Grant, Some(120.0));
    simulation.pass(Duration::from_secs(2));
    simulation.freeze("control-tower", LIMIT);
    simulation.restart("mcm", DEAD, Memory::Restored);
    if clock_ms != 0 {
        simulation.set_clock(clock_ms);
    }
    simulation
}

#[test]
fn with_a_silent_tower_it_stays_until_the_permission_that_it_remembers_ends() {
    // A clock that was set back gives no time.
    for clock_ms in [0, -3_600_000] {
        let mut simulation = killed_inside_without_tower(clock_ms);
        simulation.pass(Duration::from_secs(40));
        breached_nothing(&simulation);
        leaves(&mut simulation, 70);
    }
}

#[test]
fn a_clock_that_was_set_on_while_the_manager_was_dead_ends_no_permission_that_the_tower_repeats() {
    let mut simulation = inside();
    simulation.restart("mcm", DEAD, Memory::Restored);
    simulation.set_clock(3_600_000);
    simulation.pass(Duration::from_secs(20));
    breached_nothing(&simulation);
}

#[test]
fn a_revoked_area_is_left_on_the_way() {
    let mut simulation = inside();
    simulation.decide("A", Decision::Revoke);
    leaves(&mut simulation, 30);
}

#[test]
fn a_paused_vehicle_leaves_an_area_that_is_revoked() {
    let mut simulation = inside();
    simulation.order(Verb::Pause(v1::PauseMission { overrides: false }));
    simulation.pass(Duration::from_secs(20));
    simulation.decide("A", Decision::Revoke);
    leaves(&mut simulation, 30);
    simulation.pass(Duration::from_secs(60));
    assert_eq!(simulation.responder(), "operator_pause", "it holds outside: {}", simulation.decision_log());
}

#[test]
fn a_paused_vehicle_is_out_before_its_permission_ends() {
    let mut simulation = inside();
    simulation.order(Verb::Pause(v1::PauseMission { overrides: false }));
    simulation.pass(Duration::from_secs(10));
    // Nobody renews it.
    simulation.decide_for("A", Decision::Grant, Some(40.0));
    simulation.inject_fault("link_loss", &["400"]);
    leaves(&mut simulation, 60);
}

/// In the middle of area A, paused there, with grants of 150 s.
#[track_caller]
fn paused_inside_by_short_grants(name: &str) -> Simulation<'static> {
    let (mission, config) =
        (config().join("missions/reference.toml"), config_with(name, &[("grant_valid_s", "150.0")]));
    let mut simulation = inside_of(simulation_of(&config, Some(&mission), Policy::Grant));
    simulation.order(Verb::Pause(v1::PauseMission { overrides: false }));
    simulation
}

#[test]
fn a_permission_is_renewed_before_the_vehicle_must_leave() {
    let mut simulation = paused_inside_by_short_grants("renewed");
    // Longer than three grants.
    simulation.pass(Duration::from_secs(500));
    let log = simulation.decision_log();
    assert!(simulation.position().is_some_and(|it| it.east_m < 290.0), "it stays where it was paused: {log}");
    let renewals = log.matches("asking for area A again before its permission expires").count();
    assert!(3 <= renewals, "{renewals} renewals:\n{log}");
    assert!(!log.contains("area_breached"), "nothing breaches meanwhile:\n{log}");
    simulation.order(Verb::Resume(v1::ResumeMission {}));
    let report = simulation.fly(LIMIT).expect("the mission ends");
    assert_eq!(report.outcome(), v1::MissionOutcome::Success, "{}", simulation.decision_log());
    assert_eq!(simulation.breaches(), []);
}

#[test]
fn a_permission_whose_renewal_is_refused_is_left_before_it_expires() {
    let mut simulation = paused_inside_by_short_grants("not_renewed");
    // The operator sets an end that no further request moves.
    simulation.decide_for("A", Decision::Grant, Some(60.0));
    leaves(&mut simulation, 60);
    let log = simulation.decision_log();
    assert!(log.contains("asking for area A again before its permission expires"), "{log}");
}

/// Fails unless the vehicle is out of this area when a grant for `seconds` ends that no request moves.
#[track_caller]
fn is_out_when_the_grant_ends(simulation: &mut Simulation<'_>, east_m: Range<f64>, north_m: f64, seconds: u16) {
    simulation.decide_for("A", Decision::Grant, Some(f64::from(seconds)));
    simulation.pass(Duration::from_secs(u64::from(seconds)));
    let at = simulation.position().expect("it is somewhere");
    let log = simulation.decision_log();
    assert!(!east_m.contains(&at.east_m) || north_m < at.north_m.abs(), "still at {at:?}:\n{log}");
    simulation.pass(Duration::from_secs(5));
    assert_eq!(simulation.breaches(), [], "{log}");
}

/// Paused on the way to the east, this far from where it has begun.
#[track_caller]
fn paused_at(mut simulation: Simulation<'static>, east_m: f64) -> Simulation<'static> {
    while simulation.position().is_none_or(|it| it.east_m < east_m) {
        simulation.pass(Duration::from_millis(200));
    }
    simulation.order(Verb::Pause(v1::PauseMission { overrides: false }));
    simulation.pass(Duration::from_secs(20));
    simulation
}

#[test]
fn a_permission_that_ends_is_left_in_time_where_the_nearest_border_is_closed() {
    let text = "name = \"closed_border\"\n\
         [[objective]]\nname = \"there\"\nnorth_m = 0\neast_m = 430\nheight_m = 10\nflying = true\n\
         [[objective]]\nname = \"back\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\n\
         [[area]]\nname = \"A\"\nkind = \"permission\"\n\
         corners_m = [[-300, 100], [300, 100], [300, 450], [-300, 450]]\n\
         [[area]]\nname = \"K\"\nkind = \"keep-out\"\n\
         corners_m = [[-400, 450], [400, 450], [400, 700], [-400, 700]]\n";
    let mut simulation = paused_at(simulation(Some(&mission_file("closed_border", text)), Policy::Grant), 420.0);
    is_out_when_the_grant_ends(&mut simulation, 100.0..450.0, 300.0, 100);
    assert!(simulation.decision_log().contains("asking for area A again before its permission expires"));
}

#[test]
fn a_permission_that_ends_is_left_in_time_in_a_wind_that_blows_from_the_nearest_border() {
    let area = "kind = \"permission\"\ncorners_m = [[-200, 100], [200, 100], [200, 400], [-200, 400]]";
    let mut simulation = mission_with("against_the_wind", area);
    simulation.inject_fault("wind", &["0", "4"]);
    let mut simulation = paused_at(simulation, 235.0);
    simulation.inject_fault("wind", &["0", "12"]);
    simulation.pass(Duration::from_secs(30));
    is_out_when_the_grant_ends(&mut simulation, 100.0..400.0, 200.0, 100);
}

#[test]
fn a_return_leaves_a_revoked_area_by_the_nearest_border() {
    let mut simulation = inside();
    simulation.order(Verb::Return(v1::ReturnHome { overrides: false }));
    simulation.decide("A", Decision::Revoke);
    leaves(&mut simulation, 25);
    let report = simulation.fly(LIMIT);
    assert!(report.is_some() && simulation.breaches().is_empty(), "{}", simulation.decision_log());
}

/// A mission over `area`, which is 200 m wide and far too long to be flown round.
fn mission_with(name: &str, area: &str) -> Simulation<'static> {
    let text = format!(
        "name = \"{name}\"\n\
         [[objective]]\nname = \"there\"\nnorth_m = 0\neast_m = 500\nheight_m = 8\nflying = true\n\
         [[objective]]\nname = \"back\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\n\
         [[area]]\nname = \"A\"\n{area}\n"
    );
    simulation(Some(&mission_file(name, &text)), Policy::Grant)
}

#[test]
fn a_low_ceiling_on_the_way_home_is_flown_under_or_gone_round() {
    let mut simulation = mission_with(
        "low_ceiling",
        "kind = \"keep-out\"\nfloor_m = 13\ncorners_m = [[-300, 150], [300, 150], [300, 350], [-300, 350]]",
    );
    while simulation.position().is_none_or(|it| it.east_m < 250.0) {
        simulation.pass(Duration::from_secs(1));
    }
    simulation.order(Verb::Return(v1::ReturnHome { overrides: false }));
    simulation.fly(LIMIT);
    simulation.pass(Duration::from_secs(30));
    let at = simulation.position().unwrap();
    assert!(at.north_m.hypot(at.east_m) < 5.0, "home, not where it was: {at:?}\n{}", simulation.decision_log());
    assert_eq!(simulation.breaches(), [], "{}", simulation.decision_log());
}

#[test]
fn an_area_that_opens_over_the_vehicle_is_left_before() {
    let mut simulation = mission_with(
        "opens",
        "kind = \"keep-out\"\nfrom_utc = \"2026-01-01T00:00:45Z\"\n\
         corners_m = [[-300, 150], [300, 150], [300, 350], [-300, 350]]",
    );
    simulation.pass(Duration::from_secs(44));
    let is_inside = |it: v1::Ned| (150.0..350.0).contains(&it.east_m);
    assert!(!simulation.position().is_some_and(is_inside), "{}", simulation.decision_log());
    let report = simulation.fly(LIMIT);
    simulation.pass(Duration::from_secs(30));
    assert!(report.is_some() && simulation.is_on_ground(), "{}", simulation.decision_log());
    assert_eq!(simulation.breaches(), [], "{}", simulation.decision_log());
}

#[test]
fn landed_in_an_area_that_is_revoked_it_does_not_take_off() {
    let mut simulation = simulation(None, Policy::Grant);
    assert!(simulation.fly_until("step 5 of 5: land", LIMIT));
    simulation.pass(Duration::from_secs(2));
    simulation.decide("B", Decision::Revoke);
    simulation.pass(Duration::from_secs(600));
    assert_eq!(simulation.breaches(), [], "{}", simulation.decision_log());
}

/// The climb before the way out may end a little below the least height of the flight.
#[test]
fn a_vehicle_that_is_low_inside_a_revoked_area_climbs_once_and_leaves() {
    for height_m in [6.0, 4.5, 2.5] {
        let mut simulation = simulation(None, Policy::Grant);
        // In the middle of area B.
        assert!(simulation.fly_until("step 5 of 5: land", LIMIT));
        while simulation.position().is_none_or(|it| height_m < -it.down_m) {
            simulation.pass(Duration::from_millis(100));
        }
        simulation.decide("B", Decision::Revoke);
        simulation.pass(Duration::from_secs(40));
        let is_outside = |it: v1::Ned| 90.0 < it.north_m.abs() || !(380.0..560.0).contains(&it.east_m);
        let is_outside = simulation.position().is_some_and(is_outside);
        assert!(is_outside, "{height_m} m, {:?}:\n{}", simulation.position(), simulation.decision_log());
        let report = simulation.fly(LIMIT);
        simulation.pass(Duration::from_secs(30));
        let log = simulation.decision_log();
        assert!(report.is_some() && simulation.is_on_ground(), "{log}");
        assert_eq!(simulation.breaches(), [], "{log}");
        assert!(log.matches("asking for area B").count() <= 3, "asked once, and once more after the denial: {log}");
    }
}
