//! Steps that need permissions: one of two is lost while the other one is awaited, and one is only remembered.

use domain::skill::Goal;
use kittiwake_proto::v1;
use kittiwake_proto::v1::FlightMode::{Loiter, Offboard, Takeoff};
use kittiwake_proto::v1::PermissionState::{self, Denied, Granted, Requested, Revoked};
use kittiwake_proto::v1::SkillOutcome::Succeeded;

use crate::stories::fly;
use crate::stories::rig::{Rig, plan, step};

/// The control tower's ledger: each area with its state, for how long it holds, and the number of the decision.
fn decide(rig: &mut Rig, lines: &[(&str, PermissionState, f64, u64)]) {
    let line = |&(area, state, valid_for_s, decision): &(&str, PermissionState, f64, u64)| v1::Permission {
        area: area.into(),
        state: state as i32,
        reason: if state == Granted { String::new() } else { "closed".into() },
        valid_for_s,
        decision,
        ..Default::default()
    };
    rig.say(v1::PermissionLedger { permissions: lines.iter().map(line).collect(), ..Default::default() });
}

/// At the border, at the end of a step that needs A and B; the next one is known.
fn at_the_border(rig: &mut Rig) {
    rig.vehicle(true, Loiter, (0.0, 0.0, 10.0));
    rig.plan(plan(&[step(1, fly(100.0), &["A", "B"]), step(2, fly(500.0), &[])]));
    rig.execute();
    rig.vehicle(true, Offboard, (0.0, 100.0, 10.0));
    rig.end_present(Succeeded);
}

const ASKED_BOTH: &str = "replan after 0 () []\nask A\nask B\nstart fly 0 100 10";
const ASKED_B: &str = "replan after 0 () []\nask B\nstart fly 0 100 10";
const GOES_ON: &str = "start fly 0 500 10";

/// A is granted, and B still awaited.
fn half_granted() -> Rig {
    let mut rig = Rig::new();
    at_the_border(&mut rig);
    assert_eq!(rig.story(), ASKED_BOTH);
    decide(&mut rig, &[("A", Granted, 100.0, 1)]);
    assert_eq!(rig.story(), "");
    rig
}

#[test]
fn what_is_revoked_meanwhile_is_asked_for_again() {
    let mut rig = half_granted();
    decide(&mut rig, &[("A", Revoked, 0.0, 2)]);
    assert_eq!(rig.story(), "ask A");
    decide(&mut rig, &[("A", Revoked, 0.0, 2), ("B", Granted, 100.0, 3)]);
    assert_eq!(rig.story(), "", "A is awaited");
    decide(&mut rig, &[("A", Granted, 100.0, 4), ("B", Granted, 100.0, 3)]);
    assert_eq!(rig.story(), GOES_ON);
}

#[test]
fn what_is_revoked_for_good_is_a_denial() {
    let mut rig = half_granted();
    decide(&mut rig, &[("A", Revoked, 0.0, 2)]);
    decide(&mut rig, &[("A", Denied, 0.0, 3), ("B", Granted, 100.0, 4)]);
    let story = rig.story();
    assert!(story.contains("(area A: closed) [\"A\"]"), "{story}");
}

#[test]
fn what_a_revoking_tower_never_answers_is_a_denial_too() {
    let mut rig = half_granted();
    decide(&mut rig, &[("A", Revoked, 0.0, 2), ("B", Granted, 100.0, 3)]);
    for _ in 0..40 {
        rig.wait(1.0);
        rig.vehicle(true, Loiter, (0.0, 100.0, 10.0));
    }
    let story = rig.story();
    assert!(story.contains("(area A: no answer from the control tower after 3 tries) [\"A\"]"), "{story}");
}

#[test]
fn a_tower_that_says_what_a_grant_waits_for_is_not_silent() {
    let mut rig = half_granted();
    decide(&mut rig, &[("A", Granted, 100.0, 1), ("B", Requested, 0.0, 0)]);
    for _ in 0..40 {
        rig.wait(1.0);
        rig.vehicle(true, Loiter, (0.0, 100.0, 10.0));
    }
    let story = rig.story();
    assert!(story.contains("(area B: closed) [\"B\"]"), "{story}");
}

#[test]
fn what_runs_out_meanwhile_is_asked_for_again() {
    let mut rig = Rig::new();
    // Held when the step begins, and relied on until 30 s before its end.
    decide(&mut rig, &[("A", Granted, 45.0, 1)]);
    at_the_border(&mut rig);
    assert_eq!(rig.story(), ASKED_B);
    for _ in 0..22 {
        rig.wait(1.0);
        rig.vehicle(true, Loiter, (0.0, 100.0, 10.0));
    }
    let story = rig.story();
    assert!(story.contains("ask A"), "{story}");
    decide(&mut rig, &[("A", Granted, 100.0, 2), ("B", Granted, 100.0, 3)]);
    assert_eq!(rig.story(), GOES_ON);
}

/// Permission area A, above where the vehicle stands.
fn above_the_pad() -> v1::MissionStatus {
    let corner = |(north_m, east_m)| v1::Ned { north_m, east_m, down_m: 0.0 };
    let area = v1::Area {
        name: "A".into(),
        kind: v1::AreaKind::Permission as i32,
        corners: [(-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (-50.0, 50.0)].map(corner).to_vec(),
        floor_m: Some(5.0),
        ..Default::default()
    };
    v1::MissionStatus { areas: vec![area], ..Default::default() }
}

/// It says for nothing yet: the tower is asked, so that it does, and a recording achieves no more than a few questions.
#[test]
fn an_area_of_the_mission_that_is_granted_in_advance_is_asked_for() {
    let mut rig = Rig::new();
    rig.mission(above_the_pad());
    let line = v1::Permission {
        area: "A".into(),
        state: Granted as i32,
        valid_for_s: 1000.0,
        decision: 1,
        vehicle: "uav1".into(),
        // With one the line is not completed.
        signature: vec![1],
        ..Default::default()
    };
    let mut asked = 0;
    for _ in 0..60 {
        rig.say(v1::PermissionLedger { permissions: vec![line.clone()], ..Default::default() });
        rig.wait(1.0);
        asked += rig.story().matches("ask A").count();
    }
    assert_eq!(asked, 3);
    let said = |it: &&String| it.contains("asking for area A, which was granted in advance");
    assert_eq!(rig.decisions.iter().filter(said).count(), 1);
}

/// It was asked about the grant that is older than the restart, and that question is over.
#[test]
fn a_tower_that_has_lost_its_numbers_is_asked_also_after_a_restart() {
    let mut rig = Rig::new();
    rig.mission(above_the_pad());
    decide(&mut rig, &[("A", Granted, 1000.0, 5)]);
    let mut rig = rig.started_again();
    rig.vehicle(false, Loiter, (0.0, 0.0, 0.0));
    rig.mission(above_the_pad());
    decide(&mut rig, &[("A", Granted, 999.0, 5)]);
    decide(&mut rig, &[("A", Granted, 999.0, 6)]);
    assert_eq!(rig.story(), "replan after 0 () []\nask A");
    rig.wait(60.0);
    decide(&mut rig, &[("A", Revoked, 0.0, 3)]);
    assert_eq!(rig.story(), "ask A");
}

/// What the tower has revoked meanwhile, a vehicle that stands can wait to hear.
#[test]
fn no_takeoff_begins_by_a_permission_that_is_only_remembered() {
    #[track_caller]
    fn check(in_a_next_life: bool, begins: &str) {
        let mut rig = Rig::new();
        rig.mission(above_the_pad());
        decide(&mut rig, &[("A", Granted, 1000.0, 1)]);
        let mut rig = if in_a_next_life { rig.started_again() } else { rig };
        rig.vehicle(false, Loiter, (0.0, 0.0, 0.0));
        rig.mission(above_the_pad());
        rig.plan(plan(&[step(1, Goal::Takeoff { climb_m: 10.0 }, &[])]));
        assert_eq!(rig.story(), ["replan after 0 () []", begins].join("\n"));
        if in_a_next_life {
            // Somebody repeats that grant: the tower is asked, which may have revoked it.
            decide(&mut rig, &[("A", Granted, 999.0, 1)]);
            assert_eq!(rig.story(), "ask A");
            decide(&mut rig, &[("A", Granted, 999.0, 2)]);
            rig.plan(plan(&[step(2, Goal::Takeoff { climb_m: 10.0 }, &[])]));
            assert_eq!(rig.story(), "start takeoff 10");
        }
    }
    check(false, "start takeoff 10");
    let refused = "precondition not met: area A would be entered at (0, 0, 3) without permission";
    check(true, &format!("replan after 1 ({refused}) []"));
}

/// The motors spool up for seconds: until it has lifted off, the vehicle can stay.
#[test]
fn a_takeoff_is_given_up_before_it_has_lifted_off_when_the_area_above_is_revoked() {
    let mut rig = Rig::new();
    rig.mission(above_the_pad());
    decide(&mut rig, &[("A", Granted, 1000.0, 1)]);
    rig.plan(plan(&[step(1, Goal::Takeoff { climb_m: 10.0 }, &[])]));
    rig.execute();
    rig.vehicle(false, Takeoff, (0.0, 0.0, 0.0));
    rig.story();
    decide(&mut rig, &[("A", Revoked, 0.0, 2)]);
    let revoked = "invariant not met: area A would be entered at (0, 0, 3) without permission";
    assert_eq!(rig.story(), format!("replan after 1 ({revoked}) []\ncancel skill 1"));
}
