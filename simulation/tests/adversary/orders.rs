//! Orders in the wrong moment: before, during and after the flight, twice, and contradicting each other.

use super::*;

#[test]
fn an_abort_before_anything_was_planned_ends_on_the_ground() {
    for after_ms in sample([0, 100, 1_000, 2_500]) {
        let mut simulation = mission("early-abort", &out_and_back(), Policy::Grant);
        simulation.pass(Duration::from_millis(after_ms));
        simulation.order(ABORT);
        let report = ends(&mut simulation);
        assert_ne!(report.outcome(), MissionOutcome::Success, "{after_ms} ms: {}", brief(&simulation));
        assert_eq!(count(&simulation, "step 1 succeeded"), 0, "{}", brief(&simulation));
    }
}

#[test]
fn an_order_in_the_last_metre_of_the_last_landing_is_obeyed() {
    for (verb, expected, north_m) in [
        (RETURN, MissionOutcome::Emergency, 0.0),
        (ABORT, MissionOutcome::Emergency, 0.0),
        (land_at(80.0, 40.0), MissionOutcome::Emergency, 80.0),
        (REPLAN, MissionOutcome::Success, 0.0),
    ] {
        for height in [1.0, 0.3] {
            let mut simulation = mission("last-metre", &out_and_back(), Policy::Grant);
            until(&mut simulation, |it| 200.0 < it.east_m);
            until(&mut simulation, |it| it.east_m < 2.0 && -it.down_m < height);
            simulation.order(verb.clone());
            ends_as(&mut simulation, expected);
            let at = simulation.position().unwrap();
            assert!((at.north_m - north_m).abs() < 3.0, "{verb:?} at {height} m: {at:?}\n{}", brief(&simulation));
        }
    }
}

#[test]
fn orders_flags_and_missions_after_the_end_move_nothing() {
    let mut simulation = mission("after", &out_and_back(), Policy::Grant);
    ends_as(&mut simulation, MissionOutcome::Success);
    let text = std::fs::read_to_string(config().join("missions/keep_out.toml")).unwrap();
    for verb in [START, RESUME, RETURN, land_at(60.0, 60.0), REPLAN, PAUSE, RESUME, ABORT, START] {
        simulation.order(verb);
        simulation.pass(s(15));
        assert!(simulation.is_on_ground(), "{}", brief(&simulation));
    }
    simulation.ask(Ask::Upload(v1::MissionText { text, wind: None }));
    simulation.pass(s(5));
    let objective = v1::NewObjective {
        name: "late".to_owned(),
        position: Some(v1::Ned { north_m: 50.0, east_m: 0.0, down_m: -10.0 }),
        flying: true,
    };
    simulation.ask(Ask::Insert(v1::InsertObjective { index: 2, objective: Some(objective) }));
    ["obstacle", "battery_low", "ended_in_air", "area_breached"].iter().for_each(|it| simulation.inject_flag(it));
    simulation.pass(s(60));
    simulation.order(START);
    simulation.pass(s(120));
    assert!(simulation.is_on_ground() && simulation.breaches().is_empty(), "{}", brief(&simulation));
    assert_eq!(count(&simulation, "takeoff by"), 2, "the plan's and the step's: {}", brief(&simulation));
}

#[test]
fn of_contradicting_orders_the_last_one_counts() {
    use MissionOutcome::{Emergency, Success};
    let orders = [
        (vec![RETURN, ABORT], Emergency, false),
        (vec![ABORT, RETURN], Emergency, true),
        (vec![ABORT, RESUME], Emergency, false),
        (vec![RETURN, PAUSE, RESUME], Success, true),
        (vec![PAUSE, PAUSE, RESUME], Success, true),
        (vec![REPLAN, REPLAN, PAUSE, REPLAN, RESUME], Success, true),
    ];
    for ((verbs, expected, home), gap_ms) in sample(each(orders, [1, 3_000])) {
        let mut simulation = mission("contradict", &out_and_back(), Policy::Grant);
        until(&mut simulation, |it| 150.0 < it.east_m);
        for verb in &verbs {
            simulation.order(verb.clone());
            simulation.pass(Duration::from_millis(gap_ms));
        }
        ends_as(&mut simulation, expected);
        assert_eq!(is_home(&simulation), home, "{verbs:?} {gap_ms} ms apart: {}", brief(&simulation));
    }
}

#[test]
fn a_landing_ordered_where_it_cannot_be_is_refused_and_the_mission_flown_on() {
    let closed = [
        area("K", "keep-out", [100.0, 100.0], [200.0, 200.0], ""),
        // A ring.
        area("R1", "keep-out", [-300.0, 100.0], [-100.0, 130.0], ""),
        area("R2", "keep-out", [-300.0, 170.0], [-100.0, 200.0], ""),
        area("R3", "keep-out", [-130.0, 100.0], [-100.0, 200.0], ""),
        area("R4", "keep-out", [-300.0, 100.0], [-270.0, 200.0], ""),
    ]
    .concat();
    let mut simulation = mission("nowhere", &with(out_and_back(), closed), Policy::Grant);
    until(&mut simulation, |it| 150.0 < it.east_m);
    let places = [land_at(150.0, 150.0), land_at(-200.0, 150.0), land_at(1e9, 0.0), land_at(f64::NAN, 0.0)];
    for verb in places {
        simulation.order(verb);
        simulation.pass(s(1));
    }
    let answers = simulation.story(&["operator"]);
    assert!(answers.len() == 4 && answers.iter().all(|it| it.contains("land at: refused: ")), "{answers:?}");
    ends_as(&mut simulation, MissionOutcome::Success);
}

#[test]
fn twenty_replans_in_twenty_seconds_cost_the_mission_nothing() {
    let mut simulation = mission("replans", &out_and_back(), Policy::Grant);
    until(&mut simulation, |it| 50.0 < it.east_m);
    for _ in 0..20 {
        simulation.order(REPLAN);
        simulation.pass(s(1));
    }
    ends_as(&mut simulation, MissionOutcome::Success);
}

#[test]
fn a_pause_and_resume_every_two_seconds_cost_no_objective() {
    let mut simulation = mission("nervous", &out_and_back(), Policy::Grant);
    until(&mut simulation, |it| 50.0 < it.east_m);
    for _ in 0..15 {
        simulation.order(PAUSE);
        simulation.pass(s(1));
        simulation.order(RESUME);
        simulation.pass(s(1));
    }
    ends_as(&mut simulation, MissionOutcome::Success);
}

#[test]
fn objectives_are_skipped_removed_and_inserted_while_they_are_flown() {
    let mut simulation = mission("edits", &out_and_back(), Policy::Grant);
    until(&mut simulation, |it| 100.0 < it.east_m);
    let objective = |name: &str, north_m| {
        let position = Some(v1::Ned { north_m, east_m: 100.0, down_m: -15.0 });
        Some(v1::NewObjective { name: name.to_owned(), position, flying: true })
    };
    simulation.ask(Ask::Insert(v1::InsertObjective { index: 0, objective: objective("first", 80.0) }));
    simulation.pass(s(3));
    simulation.ask(Ask::Skip(v1::SkipObjective { name: "look".to_owned() }));
    simulation.pass(s(3));
    simulation.ask(Ask::Remove(v1::RemoveObjective { name: "first".to_owned() }));
    simulation.pass(s(1));
    simulation.ask(Ask::Remove(v1::RemoveObjective { name: "home".to_owned() }));
    let report = ends_as(&mut simulation, MissionOutcome::Failure);
    let names: Vec<&str> = report.objectives.iter().map(|it| it.name.as_str()).collect();
    assert_eq!(names, ["look"], "{}", brief(&simulation));
    assert!(is_home(&simulation), "{}", brief(&simulation));
}

#[test]
fn an_objective_that_is_skipped_during_its_landing_is_left() {
    for height in [6.0, 0.2] {
        let parts = vec![ground("there", 0.0, 150.0), ground("home", 0.0, 0.0)];
        let mut simulation = mission("skip-landing", &parts, Policy::Grant);
        until(&mut simulation, |it| 148.0 < it.east_m && -it.down_m < height);
        simulation.ask(Ask::Skip(v1::SkipObjective { name: "there".to_owned() }));
        ends_as(&mut simulation, MissionOutcome::Failure);
        assert!(is_home(&simulation), "{}", brief(&simulation));
    }
}

#[test]
fn a_mission_uploaded_in_any_moment_is_the_one_that_is_flown() {
    for moment in sample(["spool-up", "climb", "landing", "paused", "last-metre"]) {
        let mut simulation = mission("upload-moments", &out_and_back(), Policy::Grant);
        match moment {
            "spool-up" => simulation.pass(s(1)),
            "climb" => until(&mut simulation, |it| 3.0 < -it.down_m),
            _ => until(&mut simulation, |it| 200.0 < it.east_m),
        }
        match moment {
            "landing" => until(&mut simulation, |it| it.east_m < 2.0 && -it.down_m < 5.0),
            "last-metre" => until(&mut simulation, |it| it.east_m < 2.0 && -it.down_m < 0.5),
            "paused" => {
                simulation.order(PAUSE);
                simulation.pass(s(20));
            }
            _ => {}
        }
        upload(&mut simulation, &[air("north", 120.0, 0.0, 15.0), ground("home", 0.0, 0.0)]);
        simulation.pass(s(5));
        if moment == "paused" {
            simulation.order(RESUME);
        }
        let report = ends(&mut simulation);
        assert_eq!(report.objectives[0].name, "north", "{moment}: {}", brief(&simulation));
        assert_eq!(report.outcome(), MissionOutcome::Success, "{moment}: {}", brief(&simulation));
    }
}

#[test]
fn of_fifteen_missions_uploaded_each_second_the_last_is_flown() {
    let mut simulation = mission("uploads", &out_and_back(), Policy::Grant);
    until(&mut simulation, |it| 50.0 < it.east_m);
    for number in 0..15 {
        let parts = [air(&format!("new-{number}"), 40.0, 200.0 + f64::from(number), 15.0), ground("home", 0.0, 0.0)];
        upload(&mut simulation, &parts);
        simulation.pass(s(1));
    }
    let report = ends_as(&mut simulation, MissionOutcome::Success);
    assert_eq!(report.objectives[0].name, "new-14", "{}", brief(&simulation));
}

/// Over the vehicle that is on its way to the east.
fn over(more: &str) -> String {
    area("over", "keep-out", [-60.0, 90.0], [60.0, 210.0], more)
}

#[test]
fn a_mission_with_a_keep_out_area_over_the_vehicle_is_not_taken() {
    let mut simulation = mission("upload-over", &out_and_back(), Policy::Grant);
    until(&mut simulation, |it| 150.0 < it.east_m);
    upload(&mut simulation, &[air("other", 200.0, 100.0, 20.0), ground("home", 200.0, 0.0), over("")]);
    let report = ends_as(&mut simulation, MissionOutcome::Success);
    assert_eq!(report.objectives[0].name, "look", "{}", brief(&simulation));
    assert_eq!(simulation.breaches(), [], "{}", brief(&simulation));
}

#[test]
fn an_edition_of_a_data_set_with_an_area_over_the_vehicle_is_taken_and_the_area_left() {
    let mut simulation = mission("edition-over", &out_and_back(), Policy::Grant);
    until(&mut simulation, |it| 150.0 < it.east_m);
    let text = format!("name = \"new\"\n[[feed]]\nname = \"z.json\"\n{}", over("feed = \"z.json\""));
    simulation.ask(Ask::AdoptAirspace(v1::MissionText { text, wind: None }));
    let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", brief(&simulation)));
    assert_eq!(report.outcome(), MissionOutcome::Success, "{}", brief(&simulation));
    assert_eq!(count(&simulation, "`area_breached`: leave_area"), 1, "{}", brief(&simulation));
    // It was inside when the area came to be, and nowhere else.
    assert_eq!(simulation.breaches().len(), 1, "{:?}\n{}", simulation.breaches(), brief(&simulation));
}

#[test]
fn an_area_that_the_tower_has_closed_is_closed_to_every_later_mission() {
    for is_revoked in [false, true] {
        let wide = area("P", "permission", [-200.0, 100.0], [200.0, 200.0], "");
        let policy = if is_revoked { Policy::Grant } else { Policy::Deny };
        let mut simulation = mission("upload-closed", &with(out_and_back(), wide), policy);
        until(&mut simulation, |it| 50.0 < it.east_m);
        simulation.pass(s(10));
        if is_revoked {
            simulation.decide("P", Decision::Revoke);
        }
        simulation.pass(s(10));
        for number in 0..2 {
            let parts = [air(&format!("far-{number}"), 0.0, 260.0 + f64::from(number), 20.0), ground("home", 0.0, 0.0)];
            upload(&mut simulation, &parts);
            simulation.pass(s(5));
        }
        let mut outside = true;
        while simulation.report().is_none() && simulation.now() < at_s(900) {
            simulation.pass(s(1));
            let at = simulation.position().unwrap();
            outside &= 200.0 < at.north_m.abs() || !(100.0..200.0).contains(&at.east_m);
        }
        let report = ends_as(&mut simulation, MissionOutcome::Success);
        assert_eq!(report.objectives[0].name, "far-1", "{}", brief(&simulation));
        assert!(outside || is_revoked, "{}", brief(&simulation));
        assert_eq!(simulation.breaches(), [], "{}", brief(&simulation));
    }
}

/// Uploads a mission of this text.
fn upload(simulation: &mut Simulation<'_>, parts: &[String]) {
    simulation.ask(Ask::Upload(v1::MissionText { text: format!("name = \"new\"\n{}", parts.concat()), wind: None }));
}
