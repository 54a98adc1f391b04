//! A memory that is lost or cannot be written: on the ground an operator's start is awaited, in the air an operator's
//! resume, and a failed write changes nothing in flight.

use domain::memory::MemoryLoss;
use domain::skill::Goal;
use kittiwake_proto::v1;
use kittiwake_proto::v1::FlightMode::{Land, Loiter, Offboard};
use kittiwake_proto::v1::SkillOutcome::Succeeded;
use v1::operator_command::Verb;

use crate::stories::rig::{Rig, plan, step};
use crate::stories::{fly, under_way};

const START: Verb = Verb::Start(v1::StartMission {});
const RESUME: Verb = Verb::Resume(v1::ResumeMission {});
const GROUND: (f64, f64, f64) = (0.0, 0.0, 0.0);

/// A manager that has lost its memory and has not heard of the vehicle yet.
fn forgetful() -> Rig {
    let mut rig = Rig::without_vehicle();
    rig.mcm.memory_lost(MemoryLoss { id: 5, why: "mcm.0 is garbled".into() });
    rig.mcm.memory_written(Ok(()), Some(5));
    rig
}

fn flags(rig: &mut Rig) -> Vec<(String, String)> {
    rig.status().contingencies.into_iter().map(|it| (it.flag, it.reason)).collect()
}

fn flag(name: &str, reason: &str) -> (String, String) {
    (name.into(), reason.into())
}

/// Lets the stop that a row asks for succeed.
fn stop(rig: &mut Rig) {
    rig.execute();
    rig.end_present(Succeeded);
}

#[test]
fn on_the_ground_it_waits_for_a_start() {
    let mut rig = forgetful();
    rig.vehicle(false, Loiter, GROUND);
    rig.wait(1.0);
    stop(&mut rig);
    rig.wait(60.0);
    assert!(!rig.story().contains("replan"));
    assert_eq!(flags(&mut rig), [flag("memory_unusable", "mcm.0 is garbled")]);
    assert!(rig.status().start_awaited);
    assert_eq!(rig.status().memory.unwrap().loss.unwrap().id, 5);
    assert!(!rig.command(RESUME).done);
    let reply = rig.command(START);
    assert_eq!((reply.done, &*reply.text), (true, "the mission starts"));
    rig.wait(0.5);
    assert_eq!(rig.story(), "replan after 0 () []");
    assert_eq!(flags(&mut rig), []);
}

#[test]
fn a_further_restart_forgets_neither_the_loss_nor_the_start() {
    let mut rig = forgetful().started_again();
    rig.vehicle(false, Loiter, GROUND);
    rig.wait(1.0);
    assert!(!rig.story().contains("replan") && rig.status().start_awaited);
    stop(&mut rig);
    assert!(rig.command(START).done);
    let mut rig = rig.started_again();
    rig.wait(1.0);
    assert_eq!(rig.story(), "replan after 0 () []");
}

#[test]
fn a_landing_that_touches_the_ground_is_not_stopped_before_it_is_seen() {
    let mut rig = forgetful();
    rig.silence(0.1);
    assert_eq!(rig.story(), "");
    rig.vehicle(true, Land, (0.0, 50.0, 0.05));
    rig.wait(0.1);
    assert_eq!(rig.story(), "start land");
    // A monitor that was started with it speaks, and waits for the land detector itself.
    let mut rig = forgetful();
    let speaks = |rig: &mut Rig, times: u32| {
        for _ in 0..times {
            rig.silence(0.1);
            rig.say(v1::Introspection::default());
        }
        rig.story()
    };
    assert_eq!((&*speaks(&mut rig, 28), &*speaks(&mut rig, 4)), ("", "start stop"));
    // Where it does not speak at all, the vehicle is stopped.
    let mut rig = forgetful();
    rig.silence(0.1);
    rig.silence(0.5);
    assert_eq!(rig.story(), "start stop");
}

#[test]
fn in_the_air_it_holds_until_an_operator_resumes() {
    let mut rig = forgetful();
    rig.vehicle(true, Offboard, (0.0, 50.0, 10.0));
    rig.wait(1.0);
    assert_eq!(rig.story(), "start stop");
    stop(&mut rig);
    rig.wait(60.0);
    assert_eq!(rig.story(), "");
    let reply = rig.command(RESUME);
    assert!(
        reply.done
            && reply.text.starts_with("goes on with a new plan; an earlier order, such as an abort, may be forgotten"),
        "{reply:?}"
    );
    rig.wait(0.5);
    assert!(rig.story().starts_with("replan after 0 () []"));
}

#[test]
fn in_the_air_it_answers_what_is_more_severe() {
    let mut rig = forgetful();
    rig.vehicle(true, Offboard, (0.0, 50.0, 10.0));
    rig.flag("battery_critical", true);
    assert_eq!(rig.story(), "start stop\nstart land");
    rig.execute();
    rig.vehicle(false, Land, (0.0, 50.0, 0.0));
    rig.end_present(Succeeded);
    rig.wait(60.0);
    assert!(rig.story().starts_with("report Emergency"), "it is down and stays down");
}

#[test]
fn nothing_begins_when_the_first_write_fails() {
    let mut rig = Rig::without_vehicle();
    rig.mcm.memory_written(Err("no space".into()), Some(9));
    rig.vehicle(false, Loiter, GROUND);
    rig.wait(1.0);
    assert!(!rig.story().contains("replan"));
    // A process before may have failed to write what it knew: that is lost.
    assert_eq!(flags(&mut rig), [flag("memory_unusable", "no space"), flag("memory_unwritable", "no space")]);
    let reply = rig.command(START);
    let words = "what happens could not be remembered: no space; make it writable, then start";
    assert_eq!((reply.done, &*reply.text), (false, words));
    rig.mcm.memory_written(Ok(()), None);
    stop(&mut rig);
    rig.wait(60.0);
    assert!(!rig.story().contains("replan") && rig.status().start_awaited);
    assert!(rig.command(START).done);
    rig.wait(0.5);
    assert_eq!(rig.story(), "replan after 0 () []");
}

#[test]
fn a_later_write_that_fails_changes_nothing_in_flight_and_prevents_a_takeoff() {
    let (mut rig, _) = under_way();
    rig.mcm.memory_written(Ok(()), Some(9));
    rig.mcm.memory_written(Err("no space".into()), None);
    rig.wait(10.0);
    assert_eq!(rig.story(), "");
    assert_eq!(flags(&mut rig), [flag("memory_unwritable", "no space")]);

    let mut rig = Rig::new();
    rig.story();
    rig.mcm.memory_written(Ok(()), Some(9));
    rig.mcm.memory_written(Err("no space".into()), None);
    rig.wait(1.0);
    rig.plan(plan(&[step(1, Goal::Takeoff { climb_m: 10.0 }, &[]), step(2, fly(100.0), &[])]));
    rig.wait(10.0);
    assert_eq!(rig.story(), "start stop");
    stop(&mut rig);
    rig.mcm.memory_written(Ok(()), None);
    rig.wait(1.0);
    assert_eq!(rig.story(), "replan after 0 () []", "nothing was lost: it begins by itself");
}
