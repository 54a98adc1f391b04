//! What a manager that is started again in flight must know of the one before: that it flies, in which frame, and who flies.

use kittiwake_proto::v1;
use kittiwake_proto::v1::FlightMode::{Land, Loiter, Offboard};
use v1::operator_command::Verb;

use crate::rig::{Rig, plan, step};
use crate::{fly, under_way};

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

#[test]
fn a_landing_meanwhile_is_followed_by_a_takeoff_only_if_it_was_planned() {
    let mut rig = under_way().0.started_again();
    rig.vehicle(false, Land, (0.0, 50.0, 0.0));
    rig.wait(60.0);
    assert_eq!(rig.story(), "");
    assert!(rig.status().start_awaited);

    let (mut rig, skill) = under_way();
    rig.end(&skill, v1::SkillOutcome::Succeeded, "");
    assert_eq!(rig.story(), "start land\ndone 1");
    rig.execute();
    let mut rig = rig.started_again();
    rig.vehicle(false, Land, (0.0, 100.0, 0.0));
    rig.wait(1.0);
    assert_eq!(rig.story(), "replan after 0 () []");

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
    assert_eq!(memory.frame, None);
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
