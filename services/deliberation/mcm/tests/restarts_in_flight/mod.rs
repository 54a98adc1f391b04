//! What a manager that is started again in flight must know of the one before: that it flies, in which frame, and who flies.

use kittiwake_proto::v1;
use kittiwake_proto::v1::FlightMode::{Land, Loiter, Offboard, Unspecified};
use v1::operator_command::Verb;

use crate::stories::rig::{Rig, plan, step};
use crate::stories::{fly, under_way};

const ABORT: Verb = Verb::Abort(v1::AbortMission { overrides: false });
const RESUME: Verb = Verb::Resume(v1::ResumeMission {});

fn flags(rig: &mut Rig) -> Vec<String> {
    rig.status().contingencies.into_iter().map(|it| it.flag).collect()
}

#[test]
fn the_vehicle_stops_while_the_monitor_is_not_heard() {
    let mut rig = under_way().0.started_again();
    rig.silence(0.4);
    assert_eq!(rig.story(), "");
    rig.silence(1.0);
    assert_eq!(rig.story(), "start stop");
    rig.execute();
    rig.silence(1.0);
    assert_eq!(flags(&mut rig), ["introspection_lost"]);
    assert_eq!(rig.command(ABORT).text, "lands here and ends the mission");
    // On the ground nobody is stopped.
    let mut rig = Rig::new().started_again();
    rig.silence(60.0);
    assert_eq!(rig.story(), "");
}

/// The next process of a manager whose mission file was changed meanwhile, before it has seen the vehicle.
fn with_another_mission(rig: Rig) -> Rig {
    let mut memory = rig.mcm.memory();
    memory.configured = "another".into();
    let mut rig = Rig::without_vehicle();
    assert_eq!(rig.mcm.resume(memory), Ok(()));
    rig
}

#[test]
fn where_the_mission_file_was_changed_in_flight_an_order_holds_and_the_rest_waits() {
    let (mut rig, _) = under_way();
    rig.command(ABORT);
    let mut rig = with_another_mission(rig);
    rig.vehicle(true, Loiter, (0.0, 50.0, 10.0));
    rig.wait(1.0);
    assert_eq!(rig.story(), "start land");

    let mut rig = with_another_mission(under_way().0);
    rig.vehicle(true, Loiter, (0.0, 50.0, 10.0));
    rig.wait(1.0);
    assert_eq!((rig.story(), flags(&mut rig)), ("start stop".into(), vec!["memory_unusable".into()]));
    rig.execute();
    rig.end_present(v1::SkillOutcome::Succeeded);
    assert!(rig.command(RESUME).done);
    rig.wait(1.0);
    assert_eq!(rig.story(), "replan after 0 () []\nstart stop");
}

/// The mission that was flown goes on to count, with its areas, also for the process after the next one; from an operator's decision on that of
/// the file does.
#[test]
fn where_the_mission_file_was_changed_in_flight_a_return_flies_round_the_areas_of_before() {
    let corner = |(north_m, east_m)| v1::Ned { north_m, east_m, down_m: 0.0 };
    let area = v1::Area {
        name: "A".into(),
        kind: v1::AreaKind::KeepOut as i32,
        corners: [(-10.0, 20.0), (10.0, 20.0), (10.0, 30.0), (-10.0, 30.0)].map(corner).into(),
        ..Default::default()
    };
    let (mut rig, _) = under_way();
    rig.mission(v1::MissionStatus { areas: vec![area], ..Default::default() });
    rig.command(Verb::Return(v1::ReturnHome { overrides: false }));
    let mut rig = with_another_mission(rig);
    for _ in 0..2 {
        rig.vehicle(true, Loiter, (0.0, 50.0, 15.0));
        rig.wait(2.5);
        assert_eq!(rig.story(), "start fly 20 40 15", "round it");
        rig = rig.started_again();
    }
    rig.vehicle(true, Loiter, (0.0, 50.0, 15.0));
    rig.wait(1.0);
    rig.story();
    let reply = rig.command(RESUME);
    assert!(reply.done, "{}", reply.text);
    let of_file = domain::mission::MissionAreas::of(&crate::stories::rig::mission().areas, &[]);
    assert_eq!(rig.mcm.memory().mission.unwrap().areas, *of_file.encoded());
}

#[test]
fn where_the_vehicle_stands_by_then_nothing_of_the_other_mission_counts_but_an_operator_starts_the_one_of_now() {
    let (mut rig, _) = under_way();
    rig.command(ABORT);
    let mut rig = with_another_mission(rig);
    rig.silence(0.1);
    rig.vehicle(false, Loiter, (0.0, 0.0, 0.0));
    rig.wait(1.0);
    // The landing from before it was seen, and the stop that the lost memory asks for.
    rig.execute();
    rig.execute();
    rig.end_present(v1::SkillOutcome::Succeeded);
    rig.wait(60.0);
    let status = rig.status();
    assert!(status.start_awaited && status.report.is_none());
    assert_eq!(flags(&mut rig), ["memory_unusable"]);
    let before = rig.story();
    assert!(!before.contains("replan"), "{before}");
    let reply = rig.command(Verb::Start(v1::StartMission {}));
    assert!(reply.done, "{}", reply.text);
    rig.wait(1.0);
    let story = rig.story();
    assert!(story.contains("replan after 0"), "{before}\n{story}\n{:#?}", rig.decisions);
}

#[test]
fn who_remembers_nothing_and_finds_the_vehicle_in_the_air_holds() {
    let mut rig = Rig::without_vehicle();
    rig.vehicle(true, Loiter, (0.0, 50.0, 10.0));
    rig.wait(1.0);
    assert_eq!((rig.story(), flags(&mut rig)), ("start stop".into(), vec!["memory_unusable".into()]));
    // It may be another mission that is flown, but a return keeps out of the areas of this one.
    rig.execute();
    rig.command(Verb::Return(v1::ReturnHome { overrides: false }));
    rig.wait(2.5);
    assert_eq!(rig.story(), "start fly 0 50 15, giving up 1", "it climbs first");
}

#[test]
fn a_land_detector_that_bounces_after_a_landing_that_nobody_had_ordered_begins_nothing() {
    let (mut rig, _) = under_way();
    rig.vehicle(false, Land, (0.0, 50.0, 0.0));
    rig.wait(0.2);
    assert!(rig.status().start_awaited);
    rig.story();
    for flying in [true, false, true, false] {
        rig.vehicle(flying, Land, (0.0, 50.0, 0.05));
        rig.wait(0.3);
        assert!(rig.status().start_awaited, "flying: {flying}");
    }
    assert!(!rig.story().contains("replan"));
    // What does fly again is in flight.
    rig.vehicle(true, Land, (0.0, 50.0, 5.0));
    assert!(!rig.status().start_awaited);
}

#[test]
fn an_order_that_takes_control_back_does_so_after_a_restart() {
    let (mut rig, _) = under_way();
    rig.vehicle(true, Unspecified, (0.0, 50.0, 10.0));
    assert_eq!(flags(&mut rig), ["somebody_else_flies"]);
    assert!(rig.command(ABORT).done);
    let mut rig = rig.started_again();
    rig.vehicle(true, Unspecified, (0.0, 50.0, 10.0));
    rig.wait(0.5);
    assert_eq!(flags(&mut rig), ["operator_abort"]);
}

#[test]
fn a_landing_meanwhile_is_followed_by_a_takeoff_only_if_it_was_planned() {
    let mut rig = under_way().0.started_again();
    rig.vehicle(false, Land, (0.0, 50.0, 0.0));
    rig.wait(60.0);
    assert_eq!(rig.story(), "");
    assert!(rig.status().start_awaited);

    // Seen on the ground there after a landing of the plan was begun at 100 m.
    let lands_at = |east_m: f64| {
        let (mut rig, skill) = under_way();
        rig.vehicle(true, Offboard, (0.0, 100.0, 10.0));
        rig.end(&skill, v1::SkillOutcome::Succeeded, "");
        assert_eq!(rig.story(), "start land");
        rig.execute();
        let mut rig = rig.started_again();
        rig.vehicle(false, Land, (0.0, east_m, 0.0));
        rig.wait(1.0);
        rig
    };
    assert_eq!(lands_at(110.0).story(), "replan after 0 () []");
    // A pilot took it elsewhere meanwhile.
    let mut rig = lands_at(130.0);
    rig.wait(60.0);
    assert_eq!(rig.story(), "");
    assert!(rig.status().start_awaited);

    // Back in the air by a new plan, it is as before.
    let (mut rig, skill) = under_way();
    rig.end(&skill, v1::SkillOutcome::Succeeded, "");
    rig.execute();
    let mut rig = rig.started_again();
    rig.vehicle(true, Offboard, (0.0, 100.0, 5.0));
    rig.plan(plan(&[step(1, fly(200.0), &[])]));
    rig.wait(1.0);
    rig.vehicle(false, Land, (0.0, 100.0, 0.0));
    rig.wait(1.0);
    assert!(rig.status().start_awaited);
}

#[test]
fn a_frame_that_moves_meanwhile_or_had_moved_before_holds_the_vehicle() {
    /// The vehicle's frame when the manager ends, and when it has been started again; then its flags in the air.
    #[track_caller]
    fn check(before: (u64, f64), after: (u64, f64), expected: &[&str]) {
        let (mut rig, _) = under_way();
        rig.frame = before;
        rig.wait(1.0);
        let mut rig = rig.started_again();
        rig.frame = after;
        rig.wait(5.0);
        assert_eq!(flags(&mut rig), expected, "{before:?}, {after:?}");
        // Another restart changes nothing, and what it says of the flags has its time.
        let mut rig = rig.started_again();
        rig.wait(5.0);
        assert_eq!(flags(&mut rig), expected, "{before:?}, {after:?}");
        assert!(rig.records.iter().all(|it| 0.0 < it.at_s), "{:?}", rig.records);
        if !expected.is_empty() {
            assert!(!rig.command(RESUME).done);
            rig.execute();
            rig.end_present(v1::SkillOutcome::Succeeded);
            rig.frame = (after.0 + 1, 0.0);
            rig.wait(5.0);
            assert_eq!(flags(&mut rig), [""; 0], "back in the frame of the mission");
        }
    }
    check((0, 0.0), (0, 0.0), &[]);
    check((0, 0.0), (1, 0.0), &[]);
    check((0, 0.0), (1, 60.0), &["frame_moved"]);
    // Everything was started again at once, and epochs begin at zero again.
    check((0, 0.0), (0, 60.0), &["frame_moved"]);
    check((1, 60.0), (1, 60.0), &["frame_moved"]);
    check((1, 60.0), (0, 60.0), &["frame_moved"]);
}

#[test]
fn on_the_ground_a_mission_that_has_not_begun_takes_the_frame_that_there_is() {
    let mut rig = Rig::with(&[("start = \"at-once\"", "start = \"operator\"")]);
    let memory = rig.mcm.memory();
    assert_eq!(memory.flight.and_then(|it| it.frame), None);
    rig.frame = (1, 60.0);
    rig.wait(1.0);
    assert_eq!(flags(&mut rig), [""; 0]);
    // One that has begun does not: its places would be others.
    let mut rig = Rig::new().started_again();
    rig.frame = (1, 60.0);
    rig.vehicle(false, Loiter, (0.0, 0.0, 0.0));
    assert_eq!(flags(&mut rig), ["frame_moved"]);
}

#[test]
fn an_autopilot_that_holds_by_itself_is_left_alone_whatever_it_misses_by_then() {
    let (mut rig, _) = under_way();
    rig.failsafe = Some((Loiter, false));
    rig.listed_flags(&["autopilot_preempts"]);
    rig.wait(3.0);
    let mut rig = rig.started_again();
    // The monitor was started again, too, and takes what is missed for the reason.
    rig.listed_flags(&[]);
    rig.failsafe = Some((Loiter, true));
    rig.wait(30.0);
    assert_eq!((rig.story(), flags(&mut rig)), (String::new(), vec!["autopilot_preempts".to_owned()]));
    // It flies again what was asked for.
    rig.failsafe = None;
    rig.vehicle(true, Offboard, (0.0, 50.0, 10.0));
    rig.wait(5.0);
    assert_eq!(rig.story(), "replan after 0 () []\nstart stop");
}

#[test]
fn the_report_tells_the_time_of_the_whole_flight() {
    let (mut rig, _) = under_way();
    rig.wait(30.0);
    let mut rig = rig.started_again();
    assert!(rig.command(ABORT).done);
    rig.execute();
    rig.end_present(v1::SkillOutcome::Succeeded);
    rig.vehicle(false, Land, (0.0, 50.0, 0.0));
    rig.wait(1.0);
    let report = rig.status().report.expect("the mission is over");
    assert!((30.0..40.0).contains(&report.duration_s), "{report:?}");
}
