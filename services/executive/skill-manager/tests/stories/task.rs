//! A task: what the process of a declared skill hears and does, and what becomes of the skill by it.

use std::sync::Arc;

use domain::geometry::Ned;
use domain::skill::Goal;
use domain::task::{Stance, Task, TaskGoal};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1::vehicle_command::Command;
use kittiwake_proto::v1::{self, SkillOutcome, TaskState};

use crate::stories::support::autopilot::Autopilot;
use crate::stories::support::rig::{Rig, fly_to};

const LIMIT_S: f64 = 20.0;

fn winch(interrupt_s: f64) -> Goal {
    Goal::Task(Arc::new(task(Stance::Hovers, interrupt_s)))
}

fn task(stance: Stance, interrupt_s: f64) -> TaskGoal {
    TaskGoal {
        stance,
        over: Ned::new(0.0, 0.0, -10.0),
        task: Task { skill: "winch".into(), inputs: vec![("length_m".into(), 5.0.into())] },
        estimate_s: 5.0,
        power_w: 0.0,
        limit_s: LIMIT_S,
        interrupt_s,
        succeeds_as: vec!["done".into()],
    }
}

fn hovering() -> Rig {
    let mut rig = Rig::new(Autopilot::flying());
    rig.run(2.0);
    rig
}

fn report(rig: &mut Rig, state: TaskState, outcome: &str) {
    let request_id = rig.task_orders.first().map(|it| it.request_id.clone()).unwrap_or_default();
    let mut report = v1::TaskReport { skill: "winch".into(), version: 1, request_id, ..Default::default() };
    report.set_state(state);
    report.outcome = outcome.into();
    report.results = vec![v1::TaskValue { name: "depth_m".into(), value: 4.5, ..Default::default() }];
    rig.deliver(Message::TaskReport(report));
}

/// Reports once a second for as long.
fn runs(rig: &mut Rig, seconds: u32) {
    for _ in 0..seconds {
        report(rig, TaskState::Running, "");
        rig.run(1.0);
    }
}

#[test]
fn it_ends_as_the_process_says_and_commands_nothing() {
    #[track_caller]
    fn check(outcome: &str, expected: SkillOutcome, reason: &str) {
        let mut rig = hovering();
        let skill = rig.start(winch(0.0));
        rig.run(0.9);
        assert_eq!(rig.task_orders.len(), 2, "it is repeated until it is heard");
        assert_eq!(rig.task_orders[0].inputs[0].value, 5.0);
        runs(&mut rig, 4);
        assert_eq!(rig.task_orders.len(), 2);
        report(&mut rig, TaskState::Ended, outcome);
        report(&mut rig, TaskState::Ended, "something else");
        assert_eq!(rig.outcome(skill), expected);
        assert_eq!(rig.reason(skill), reason);
        assert_eq!(rig.autopilot.commands, []);
    }
    check("done", SkillOutcome::Succeeded, "done, depth_m 4.5");
    check("snagged", SkillOutcome::Failed, "winch ended as `snagged`");
}

#[test]
fn a_process_that_misbehaves_fails_it() {
    #[track_caller]
    fn check(runs_s: u32, expected: SkillOutcome, reason: &str) {
        let mut rig = hovering();
        let skill = rig.start(winch(0.0));
        rig.run(0.1);
        runs(&mut rig, runs_s);
        assert_eq!(rig.outcome(skill), expected);
        assert_eq!(rig.reason(skill), reason);
        rig.run(3.0);
        assert!(rig.task_orders.last().is_some_and(|it| it.cancel), "it may go on");
    }
    check(0, SkillOutcome::Rejected, "the process of winch does not answer");
    check(3, SkillOutcome::Failed, "the process of winch has fallen silent");
    check(LIMIT_S as u32 + 1, SkillOutcome::TimedOut, "winch has not ended after 20 s");
}

#[test]
fn another_skill_begins_once_the_process_has_made_an_interruption_safe_or_its_time_is_over() {
    /// The process says that it is safe after `answers_s`; the next skill is commanded after about as long as expected.
    #[track_caller]
    fn check(interrupt_s: f64, answers_s: f64, expected_s: f64) {
        let mut rig = hovering();
        let skill = rig.start(winch(interrupt_s));
        rig.run(0.1);
        runs(&mut rig, 2);
        rig.start(fly_to(50.0));
        rig.run(0.05);
        assert!(rig.task_orders.last().is_some_and(|it| it.cancel));
        let begun = rig.now;
        let mut answered = false;
        while rig.autopilot.commands.is_empty() {
            let passed_s = (rig.now - begun).as_secs_f64();
            assert!(passed_s < 15.0, "it never begins");
            if answers_s <= passed_s && !std::mem::replace(&mut answered, true) {
                report(&mut rig, TaskState::Ended, "cancelled");
            }
            rig.run(0.05);
        }
        let passed_s = (rig.now - begun).as_secs_f64();
        assert!((passed_s - expected_s).abs() < 0.6, "{passed_s} s, expected {expected_s} s");
        assert_eq!(rig.outcome(skill), SkillOutcome::Aborted);
    }
    check(0.0, 100.0, 0.0);
    check(4.0, 1.0, 1.0);
    check(4.0, 100.0, 4.0);
}

/// As after the death of the skill manager that had ordered it.
#[test]
fn a_task_that_nobody_here_has_ordered_gets_the_order_to_end() {
    let mut rig = hovering();
    runs(&mut rig, 8);
    assert_eq!(rig.task_orders.len(), 5, "so often, and no more");
    assert!(rig.task_orders.iter().all(|it| it.cancel && it.skill == "winch"));
}

#[test]
fn a_process_that_was_started_again_has_lost_its_task() {
    let mut rig = hovering();
    let skill = rig.start(winch(0.0));
    rig.run(0.1);
    runs(&mut rig, 2);
    let ready = v1::TaskReport { skill: "winch".into(), state: TaskState::Ready as i32, ..Default::default() };
    rig.deliver(Message::TaskReport(ready));
    assert_eq!(rig.outcome(skill), SkillOutcome::Failed);
    assert_eq!(rig.reason(skill), "the process of winch was started again, and knows nothing of its task");
}

#[test]
fn it_does_not_begin_where_the_vehicle_does_not_hover() {
    let mut rig = hovering();
    rig.start(fly_to(50.0));
    rig.run(2.0);
    let skill = rig.start(winch(0.0));
    assert_eq!(rig.outcome(skill), SkillOutcome::Failed);
    assert_eq!(rig.reason(skill), "the vehicle does not hover: its mode is offboard");
    assert!(rig.task_orders.is_empty());
}

/// How the task along a flight has ended, if it has.
fn ended_along(rig: &Rig) -> Option<(SkillOutcome, &str)> {
    let ended = rig.events.iter().find(|it| it.along == "winch" && it.state() == v1::SkillState::Ended)?;
    Some((ended.outcome(), ended.reason.as_str()))
}

/// An order, and whether it is the one to end.
fn orders(rig: &Rig) -> Vec<bool> {
    let mut orders: Vec<bool> = rig.task_orders.iter().map(|it| it.cancel).collect();
    orders.dedup();
    orders
}

#[test]
fn along_a_flight_it_begins_and_ends_with_that() {
    let (mut rig, along) = (hovering(), task(Stance::Flies, 0.0));
    let first = rig.start_with(fly_to(20.0), &along);
    rig.run(0.5);
    runs(&mut rig, 2);
    // The next flight has it too: its process hears nothing.
    let second = rig.start_with(fly_to(60.0), &along);
    runs(&mut rig, 2);
    assert_eq!((rig.outcome(first), orders(&rig)), (SkillOutcome::Aborted, vec![false]));
    while rig.ending(second).is_none() {
        runs(&mut rig, 1);
    }
    assert_eq!(rig.outcome(second), SkillOutcome::Succeeded);
    rig.run(1.0);
    assert_eq!(orders(&rig), [false, true]);
    assert_eq!(ended_along(&rig), Some((SkillOutcome::Cancelled, "the leg has ended")));
}

#[test]
fn a_task_along_a_flight_that_fails_or_is_interrupted_keeps_nobody_waiting() {
    let (mut rig, along) = (hovering(), task(Stance::Flies, 5.0));
    let flight = rig.start_with(fly_to(500.0), &along);
    rig.run(0.5);
    runs(&mut rig, 1);
    rig.run(3.0);
    assert_eq!(ended_along(&rig), Some((SkillOutcome::Failed, "the process of winch has fallen silent")));
    assert!(rig.ending(flight).is_none(), "the flight goes on");

    let mut rig = hovering();
    rig.start_with(fly_to(500.0), &along);
    rig.run(0.5);
    runs(&mut rig, 1);
    rig.start(Goal::Land);
    rig.run(0.2);
    assert_eq!(rig.autopilot.commands.last(), Some(&Command::Land(v1::LandCommand::default())));
    assert_eq!(orders(&rig), [false, true]);
}

/// Both may use one payload. The winch answers after `answers_s`.
#[test]
fn a_task_begins_once_those_along_the_leg_have_ended_or_do_not_answer() {
    #[track_caller]
    fn check(answers_s: f64, expected_s: f64) {
        let (mut rig, along) = (hovering(), task(Stance::Flies, 0.0));
        let flight = rig.start_with(fly_to(20.0), &along);
        rig.run(0.5);
        while rig.ending(flight).is_none() {
            runs(&mut rig, 1);
        }
        let stop = rig.start(Goal::Stop);
        while !rig.task_orders.iter().any(|it| it.cancel) {
            rig.run(0.05);
        }
        let ended = rig.now;
        while rig.ending(stop).is_none() {
            rig.run(0.05);
        }
        let over = Ned::new(20.0, 0.0, -10.0);
        let winch = rig.start(Goal::Task(Arc::new(TaskGoal { over, ..task(Stance::Hovers, 0.0) })));
        let mut answered = false;
        let begins = |rig: &Rig| rig.task_orders.last().is_some_and(|it| !it.cancel);
        while !begins(&rig) {
            let passed_s = (rig.now - ended).as_secs_f64();
            assert!(passed_s < 15.0 && rig.ending(winch).is_none(), "it does not begin: {:?}", rig.ending(winch));
            if answers_s <= passed_s && !std::mem::replace(&mut answered, true) {
                report(&mut rig, TaskState::Ended, "cancelled");
            }
            rig.run(0.05);
        }
        let passed_s = (rig.now - ended).as_secs_f64();
        assert!((passed_s - expected_s).abs() < 0.6, "{passed_s} s, expected {expected_s} s");
    }
    check(1.0, 1.0);
    check(100.0, 2.0);
}

#[test]
fn on_the_ground_nothing_is_commanded_for_it() {
    #[track_caller]
    fn check(is_cancelled: bool, expected: SkillOutcome) {
        let mut rig = Rig::new(Autopilot::default());
        rig.run(2.0);
        let skill = rig.start(Goal::Task(Arc::new(task(Stance::Stands, 0.0))));
        rig.run(0.1);
        runs(&mut rig, 5);
        if is_cancelled {
            rig.cancel(skill).unwrap();
        } else {
            report(&mut rig, TaskState::Ended, "done");
        }
        assert_eq!(rig.outcome(skill), expected);
        rig.run(1.0);
        assert_eq!(rig.autopilot.commands, []);
        assert_eq!(rig.task_orders.last().is_some_and(|it| it.cancel), is_cancelled);
    }
    check(false, SkillOutcome::Succeeded);
    check(true, SkillOutcome::Cancelled);
    let mut rig = hovering();
    let skill = rig.start(Goal::Task(Arc::new(task(Stance::Stands, 0.0))));
    assert_eq!(rig.outcome(skill), SkillOutcome::Failed);
    assert_eq!(rig.reason(skill), "the vehicle does not stand on the ground");
}
