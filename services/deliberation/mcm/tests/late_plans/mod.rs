//! A planner that needs longer for a plan than a request may take.

use domain::skill::Goal;
use kittiwake_proto::topics::Request;
use kittiwake_proto::v1::FlightMode::Loiter;
use node::CallError;

use crate::stories::rig::{Rig, plan, step};

/// The id of the request for a plan that waits for its answer.
#[track_caller]
fn asked(rig: &Rig) -> String {
    let replan = |it: &Request| if let Request::Replan(it) = it { Some(it.request_id.clone()) } else { None };
    rig.open().find_map(replan).expect("a plan is asked for")
}

/// The deadline of the request for a plan passes, and the manager asks again.
#[track_caller]
fn deadline_passes(rig: &mut Rig) {
    rig.wait(1.0);
    rig.answer(|it| matches!(it, Request::Replan(_)).then_some(Err(CallError::Unanswered)));
    rig.wait(1.1);
}

/// It asks for the same plan again and again while the planner plans for five seconds; returns the id of the requests.
fn kept_waiting() -> (Rig, String) {
    let mut rig = Rig::new();
    let id = asked(&rig);
    for _ in 0..2 {
        deadline_passes(&mut rig);
        assert_eq!(asked(&rig), id, "the planner knows its answer by this id");
    }
    (rig, id)
}

#[test]
fn a_late_answer_is_flown_if_nothing_has_changed() {
    let (mut rig, _) = kept_waiting();
    rig.plan(plan(&[step(1, Goal::Takeoff { climb_m: 10.0 }, &[])]));
    assert!(rig.story().ends_with("start takeoff 10"));
    let waits = rig.decisions.iter().filter(|it| it.contains("still planning")).count();
    assert_eq!(waits, 1, "{:#?}", rig.decisions);
}

#[test]
fn a_late_answer_for_another_place_is_not_flown() {
    let (mut rig, id) = kept_waiting();
    rig.vehicle(false, Loiter, (0.0, 5.0, 0.0));
    rig.plan(plan(&[step(1, Goal::Takeoff { climb_m: 10.0 }, &[])]));
    assert!(!rig.story().contains("start"), "{:#?}", rig.decisions);
    assert!(rig.decisions.iter().any(|it| it.contains("for a state that has changed")), "{:#?}", rig.decisions);
    assert_ne!(asked(&rig), id, "it is another question");
}

#[test]
fn a_vehicle_that_has_moved_asks_another_question() {
    let (mut rig, id) = kept_waiting();
    rig.vehicle(false, Loiter, (0.0, 5.0, 0.0));
    deadline_passes(&mut rig);
    assert_ne!(asked(&rig), id);
}
