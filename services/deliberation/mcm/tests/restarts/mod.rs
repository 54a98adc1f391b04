//! What a manager knows after a restart.

use kittiwake_proto::v1;
use kittiwake_proto::v1::FlightMode::{Land, Loiter, Offboard};
use kittiwake_proto::v1::SkillOutcome::Succeeded;
use mcm::UnusableState;
use v1::operator_command::Verb;

use crate::stories::rig::Rig;
use crate::stories::under_way;

#[test]
fn what_was_ordered_is_flown_on() {
    /// `expected`: before anything is known of the vehicle, and from then on.
    #[track_caller]
    fn check(verb: Verb, expected: [&str; 2]) {
        let (mut rig, _) = under_way();
        assert!(rig.command(verb).done);
        let mut rig = rig.started_again();
        assert_eq!(rig.story(), expected[0]);
        rig.wait(1.0);
        assert_eq!(rig.story(), expected[1]);
    }
    check(Verb::Abort(v1::AbortMission { overrides: false }), ["start land", ""]);
    // A landing that touches the ground is not stopped: it looks first, for as long as the monitor may be silent.
    check(Verb::Pause(v1::PauseMission { overrides: false }), ["", "start stop"]);
    check(Verb::Return(v1::ReturnHome { overrides: false }), ["", "start fly 0 50 15"]);
    let position = Some(v1::Ned { north_m: 30.0, east_m: 40.0, down_m: 0.0 });
    check(Verb::LandAt(v1::LandAt { position, overrides: false }), ["", "start fly 0 50 15"]);
}

#[test]
fn a_mission_that_is_over_stays_over() {
    let (mut rig, _) = under_way();
    assert!(rig.command(Verb::Abort(v1::AbortMission { overrides: false })).done);
    rig.execute();
    rig.vehicle(false, Land, (0.0, 50.0, 0.0));
    rig.end_present(Succeeded);
    rig.story();
    let mut rig = rig.started_again();
    rig.wait(20.0);
    assert_eq!(rig.story(), "report Emergency: `operator_abort`: ordered by anna");
    assert_eq!(rig.status().phase(), v1::MissionPhase::Over);
    let reply = rig.command(Verb::Start(v1::StartMission {}));
    let over = "the mission is over: `operator_abort`: ordered by anna; upload the next mission to fly again";
    assert_eq!((reply.done, &*reply.text), (false, over));
}

#[test]
fn a_pause_is_still_resumed() {
    let (mut rig, _) = under_way();
    assert!(rig.command(Verb::Pause(v1::PauseMission { overrides: false })).done);
    let mut rig = rig.started_again();
    rig.vehicle(true, Loiter, (0.0, 50.0, 10.0));
    rig.execute();
    rig.end_present(Succeeded);
    assert!(rig.command(Verb::Resume(v1::ResumeMission {})).done);
    assert!(rig.story().contains("replan"));
}

#[test]
fn the_time_of_the_mission_goes_on() {
    let (rig, _) = under_way();
    let mut memory = rig.mcm.memory();
    // The mission was begun half a minute before the machine's clock shows zero, as it does in these stories.
    memory.clock.as_mut().unwrap().began_utc_ms = -30_000;
    let mut rig = crate::stories::rig::Rig::new();
    rig.mcm.resume(memory).unwrap();
    rig.wait(1.0);
    let status = rig.status();
    assert_eq!(status.began_utc_ms, -30_000);
    assert!(status.mission_time_s.is_some_and(|it| 30.0 <= it), "{status:?}");
}

#[test]
fn a_flag_that_fell_meanwhile_is_down() {
    let (mut rig, _) = under_way();
    rig.flag("obstacle", true);
    rig.vehicle(true, Offboard, (0.0, 50.0, 10.0));
    rig.listed_flags(&[]);
    let mut rig = rig.started_again();
    rig.wait(1.0);
    assert_eq!(rig.story(), "start stop");
    rig.vehicle(true, Loiter, (0.0, 50.0, 10.0));
    rig.execute();
    rig.end_present(Succeeded);
    assert_eq!(rig.story(), "replan after 0 () []\nstart stop");
}

#[test]
fn a_flag_that_stays_up_until_the_landing_does_so() {
    let (mut rig, _) = under_way();
    rig.flag("battery_low", true);
    rig.flag("battery_low", false);
    let mut rig = rig.started_again();
    rig.wait(1.0);
    assert_eq!(rig.story(), "start fly 0 50 15");
}

#[test]
fn a_crash_counts_in_every_mission_until_the_vehicle_was_inspected() {
    let (mut rig, _) = under_way();
    rig.vehicle(false, Land, (0.0, 50.0, 0.0));
    rig.flag("crashed", true);
    rig.wait(1.0);
    let memory = rig.mcm.memory();
    // Another mission file, a restart, and a restart after the inspection.
    let mut rig = Rig::new();
    assert_eq!(
        rig.mcm.resume(v1::McmMemory { configured: "another".into(), ..memory }),
        Err(UnusableState::OfAnotherMission)
    );
    let mut rig = rig.started_again();
    rig.vehicle(false, Loiter, (0.0, 50.0, 0.0));
    rig.wait(60.0);
    assert!(!rig.story().contains("replan"), "it asks for no plan");
    assert_eq!(rig.status().uninspected_crash, "`crashed`: by hand");
    let reply = rig.command(Verb::Start(v1::StartMission {}));
    let first = "the vehicle has crashed: inspect it, then order `inspected`";
    assert_eq!((reply.done, &*reply.text), (false, first));
    let reply = rig.command(Verb::Inspected(v1::Inspected {}));
    assert_eq!((reply.done, &*reply.text), (true, "the vehicle may fly again: start the mission"));
    let mut rig = rig.started_again();
    rig.vehicle(false, Loiter, (0.0, 50.0, 0.0));
    rig.flag("crashed", true);
    rig.wait(1.0);
    assert_eq!((rig.status().uninspected_crash.as_str(), rig.status().report.is_some()), ("", false));
    assert!(!rig.command(Verb::Inspected(v1::Inspected {})).done, "it was inspected");
    rig.wait(60.0);
    assert!(!rig.story().contains("replan"), "an operator starts it");
    assert!(rig.command(Verb::Start(v1::StartMission {})).done);
    rig.wait(1.0);
    assert_eq!(rig.story(), "replan after 0 () []");
    // It falls again, from less than a metre.
    rig.flag("crashed", false);
    rig.vehicle(true, Loiter, (0.0, 50.0, 0.8));
    rig.vehicle(false, Loiter, (0.0, 50.0, 0.0));
    rig.flag("crashed", true);
    rig.wait(1.0);
    assert_eq!(rig.status().uninspected_crash, "`crashed`: by hand");
}

/// A process that dies before it has heard anything hands on what it was given.
#[test]
fn what_is_restored_is_stored_again() {
    #[track_caller]
    fn check(prepare: impl FnOnce(&mut Rig)) {
        let (mut rig, _) = under_way();
        prepare(&mut rig);
        let memory = rig.mcm.memory();
        let mut next = Rig::without_vehicle();
        next.mcm.resume(memory.clone()).unwrap();
        for acts in [false, true] {
            if acts {
                next.silence(0.0);
            }
            let again = next.mcm.memory();
            let numbers = again.decision_numbers;
            assert!(memory.decision_numbers <= numbers);
            assert_eq!(v1::McmMemory { decision_numbers: numbers, ..memory.clone() }, again, "acts: {acts}");
        }
    }
    check(|_| {});
    check(|rig| {
        rig.command(Verb::Abort(v1::AbortMission { overrides: true }));
    });
    check(|rig| {
        rig.command(Verb::LandAt(v1::LandAt { position: Some(v1::Ned::default()), overrides: false }));
    });
    check(|rig| {
        rig.flag("obstacle", true);
        rig.command(Verb::Acknowledge(v1::AcknowledgeFlag { flag: "obstacle".into() }));
    });
    check(|rig| {
        rig.vehicle(true, v1::FlightMode::Unspecified, (0.0, 50.0, 10.0));
        rig.command(Verb::Return(v1::ReturnHome { overrides: false }));
    });
    check(|rig| {
        // The landing of the plan.
        rig.vehicle(true, Offboard, (0.0, 100.0, 10.0));
        rig.end_present(Succeeded);
        rig.execute();
        rig.wait(0.1);
        assert!(rig.mcm.memory().flight.is_some_and(|it| it.lands_at.is_some()));
    });
    check(|rig| rig.vehicle(false, Land, (0.0, 50.0, 0.0)));
    check(|rig| {
        rig.frame = (1, 60.0);
        rig.wait(1.0);
    });
    check(|rig| {
        rig.flag("crashed", true);
        rig.vehicle(false, Land, (0.0, 50.0, 0.0));
        rig.wait(5.0);
        assert!(rig.mcm.memory().end.is_some_and(|it| it.report.is_some()));
    });
    let line = |decision, state: v1::PermissionState| v1::Permission {
        area: format!("area {decision}"),
        state: state as i32,
        valid_for_s: 900.0,
        decision,
        ..Default::default()
    };
    check(|rig| {
        let permissions = vec![line(1, v1::PermissionState::Granted), line(2, v1::PermissionState::Revoked)];
        rig.say(v1::PermissionLedger { tower_start: 7, permissions, ..Default::default() });
    });
}

/// By its memory the mission has not begun, and nobody knows for what the vehicle flies.
#[test]
fn a_mission_that_has_not_begun_does_not_begin_in_the_air() {
    let mut rig = Rig::with(&[("start = \"at-once\"", "start = \"operator\"")]).started_again();
    rig.vehicle(true, Loiter, (0.0, 50.0, 10.0));
    rig.wait(5.0);
    let story = rig.story();
    assert!(!story.contains("replan"), "{story}");
}

#[test]
fn of_a_state_that_cannot_be_used_only_the_numbers_of_decisions_go_on() {
    let mut memory = Rig::new().mcm.memory();
    memory.end = Some(v1::StoredEnd { outcome: v1::MissionOutcome::Success.into(), ..Default::default() });
    memory.orders.as_mut().unwrap().landing_site = Some(v1::Ned { north_m: f64::NAN, ..Default::default() });
    let mut rig = Rig::new();
    assert!(matches!(rig.mcm.resume(memory.clone()), Err(UnusableState::InvalidMessage(_))));
    memory.configured = "another".into();
    assert_eq!(rig.mcm.resume(memory), Err(UnusableState::OfAnotherMission));
    let decision_numbers = rig.mcm.memory().decision_numbers;
    let fresh = Rig::new().mcm.memory();
    assert!(fresh.decision_numbers < decision_numbers, "{decision_numbers}");
    assert_eq!(rig.mcm.memory(), v1::McmMemory { decision_numbers, ..fresh });
}
