//! After the end: a vehicle that flies again is brought down, unless somebody else flies it; and the next mission.

use kittiwake_proto::v1;
use kittiwake_proto::v1::FlightMode::{Land, Loiter, Takeoff, Unspecified};
use kittiwake_proto::v1::SkillOutcome::Succeeded;
use v1::operator_command::Verb;

use crate::stories::rig::Rig;
use crate::stories::under_way;

const ABORT: Verb = Verb::Abort(v1::AbortMission { overrides: false });
const START: Verb = Verb::Start(v1::StartMission {});

/// Comes down where it is, and disarms.
fn comes_down(rig: &mut Rig) {
    rig.execute();
    rig.vehicle(false, Land, (0.0, 50.0, 0.0));
    rig.end_present(Succeeded);
    rig.wait(20.0);
    assert_eq!(rig.status().phase(), v1::MissionPhase::Over);
}

/// Aborted, and on the ground with its report.
fn over(mut rig: Rig) -> Rig {
    assert!(rig.command(ABORT).done);
    comes_down(&mut rig);
    let story = rig.story();
    assert!(story.contains("report Emergency"), "{story}");
    rig
}

#[test]
fn a_vehicle_that_flies_again_is_brought_down_each_time() {
    let mut rig = over(under_way().0);
    for _ in 0..2 {
        rig.vehicle(true, Loiter, (0.0, 50.0, 10.0));
        assert_eq!(rig.story(), "start fly 0 50 15", "it returns");
        assert_eq!(rig.status().acting, "ended_in_air");
        rig.execute();
        rig.vehicle(false, Land, (0.0, 50.0, 0.0));
        rig.end_present(Succeeded);
        assert_eq!(rig.story(), "start land");
        comes_down(&mut rig);
        assert_eq!(rig.story(), "", "and stays there");
    }
    // It has hardly lifted off.
    rig.vehicle(true, Takeoff, (0.0, 50.0, 0.5));
    assert_eq!(rig.story(), "start land");
}

#[test]
fn a_vehicle_that_stands_armed_is_not_flown_anywhere_because_its_height_drifts() {
    let flies = "start fly 0 50 15";
    for (landed, heard_s, height_m, moves_m_s, expected) in [
        (true, 0.0, 4.0, 0.0, "start land"),
        (true, 0.0, 4.0, 1.0, flies),
        (false, 0.0, 4.0, 0.0, flies),
        // A detector that sticks, or has fallen silent, while the vehicle hovers far above.
        (true, 0.0, 15.0, 0.0, "start fly 0 0 15"),
        (true, 60.0, 4.0, 0.0, flies),
    ] {
        let mut rig = over(under_way().0);
        let mut drifted = rig.introspection();
        drifted.status.as_mut().expect("it has a status").armed = true;
        let place = drifted.local_position.as_mut().expect("it is somewhere");
        place.position = Some(v1::Ned { east_m: 50.0, down_m: -height_m, ..Default::default() });
        place.velocity = Some(v1::NedVelocity { north_m_s: moves_m_s, ..Default::default() });
        place.timestamp_us = 1_000_000;
        let detector = drifted.land_detected.as_mut().expect("it has a land detector");
        (detector.landed, detector.timestamp_us) = (landed, 1_000_000);
        drifted.ages.as_mut().expect("it tells ages").land_detected_s = Some(heard_s);
        rig.say(drifted);
        assert_eq!(rig.story(), expected, "detector {landed} for {heard_s} s, {height_m} m, {moves_m_s} m/s");
    }
}

#[test]
fn a_pilot_who_flies_after_the_end_is_left_alone() {
    let mut rig = over(under_way().0);
    // The motors were known to be on, and the status that tells the mode is late.
    let mut before = rig.introspection();
    let (status, place, landed) = (&mut before.status, &mut before.local_position, &mut before.land_detected);
    status.as_mut().expect("it has a status").armed = true;
    let place = place.as_mut().expect("it is somewhere");
    (place.position, place.timestamp_us) = (Some(v1::Ned { down_m: -10.0, ..Default::default() }), 1_000_000);
    let landed = landed.as_mut().expect("it has a land detector");
    (landed.landed, landed.timestamp_us) = (false, 1_000_000);
    before.ages.as_mut().expect("it tells ages").status_s = Some(0.4);
    rig.say(before);
    assert_eq!(rig.story(), "");
    for _ in 0..300 {
        rig.vehicle(true, Unspecified, (0.0, 50.0, 10.0));
        rig.wait(0.1);
    }
    assert_eq!(rig.story(), "");
    let flags: Vec<_> = rig.status().contingencies.into_iter().map(|it| it.flag).collect();
    assert_eq!(flags, ["somebody_else_flies"]);
}

/// This mission, nothing of which has been attempted.
fn mission(name: &str) -> v1::MissionStatus {
    let objective = v1::Objective {
        name: "there".into(),
        position: Some(v1::Ned::default()),
        state: v1::ObjectiveState::Waiting as i32,
        ..Default::default()
    };
    v1::MissionStatus { mission: name.into(), objectives: vec![objective], ..Default::default() }
}

#[test]
fn only_a_mission_that_is_uploaded_after_the_end_is_begun_also_after_restarts() {
    let mut rig = under_way().0;
    rig.mission(mission("flown"));
    let mut rig = over(rig).started_again();
    rig.vehicle(false, Land, (0.0, 50.0, 0.0));
    rig.wait(20.0);
    assert!(!rig.status().start_awaited && !rig.command(START).done, "not once more");
    rig.change_mission(mission("next"), true);
    rig.wait(1.0);
    assert!(rig.status().start_awaited);
    let mut rig = rig.started_again();
    rig.vehicle(false, Land, (0.0, 50.0, 0.0));
    rig.wait(20.0);
    assert!(rig.status().start_awaited, "it waits over a restart");
    assert_eq!(rig.command(START).text, "the next mission starts: `next`");
}
