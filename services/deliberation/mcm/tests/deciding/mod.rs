//! What is kept of a decision is never an old one: after whatever has happened it equals what would be decided from nothing.

use domain::skill::Goal;
use kittiwake_proto::topics::Request;
use kittiwake_proto::v1;
use proptest::prelude::*;
use v1::FlightMode::{Land, Loiter, Offboard, Takeoff};
use v1::SkillOutcome::{Failed, Succeeded};
use v1::operator_command::Verb;

use super::fly;
use super::rig::{Rig, plan, shipped_table, step};

#[derive(Debug, Clone)]
enum Happens {
    /// The flag of this row rises or falls.
    Flag(usize, bool),
    Vehicle(bool, v1::FlightMode, f64),
    Ordered(Verb),
    /// The planner answers.
    Plan(v1::replan_reply::Reply),
    SkillExecutes,
    SkillEnds(v1::SkillOutcome),
    Passes(f64),
    Restart,
}

fn anything(rows: usize) -> impl Strategy<Value = Happens> {
    let modes = prop::sample::select(vec![Land, Loiter, Offboard, Takeoff]);
    let verbs = vec![
        Verb::Start(v1::StartMission {}),
        Verb::Pause(v1::PauseMission { overrides: false }),
        Verb::Resume(v1::ResumeMission {}),
        Verb::Abort(v1::AbortMission { overrides: true }),
        Verb::Return(v1::ReturnHome { overrides: true }),
        Verb::Replan(v1::ReplanMission {}),
    ];
    let plans = vec![
        plan(&[step(1, Goal::Takeoff { climb_m: 10.0 }, &[]), step(2, fly(100.0), &[])]),
        plan(&[step(3, fly(200.0), &["A"]), step(4, Goal::Land, &[])]),
        v1::replan_reply::Reply::Hold(v1::HoldUntil::default()),
        v1::replan_reply::Reply::Finished(v1::Finished {}),
    ];
    prop_oneof![
        4 => (0..rows, any::<bool>()).prop_map(|(row, rises)| Happens::Flag(row, rises)),
        3 => (any::<bool>(), modes, 0.0..12.0).prop_map(|(flies, mode, height_m)| Happens::Vehicle(flies, mode, height_m)),
        2 => prop::sample::select(verbs).prop_map(Happens::Ordered),
        4 => prop::sample::select(plans).prop_map(Happens::Plan),
        3 => Just(Happens::SkillExecutes),
        2 => prop::sample::select(vec![Succeeded, Failed]).prop_map(Happens::SkillEnds),
        2 => prop::sample::select(vec![0.1, 3.0, 700.0]).prop_map(Happens::Passes),
        1 => Just(Happens::Restart),
    ]
}

fn after(mut rig: Rig, happens: Happens, flags: &[String]) -> Rig {
    match happens {
        Happens::Flag(row, rises) => rig.flag(&flags[row], rises),
        Happens::Vehicle(flies, mode, height_m) => {
            rig.vehicle(flies, mode, (0.0, 50.0, if flies { height_m } else { 0.0 }));
        }
        Happens::Ordered(verb) => drop(rig.command(verb)),
        Happens::Plan(reply) if rig.open().any(|it| matches!(it, Request::Replan(_))) => rig.plan(reply),
        Happens::SkillExecutes if rig.open().any(|it| matches!(it, Request::Skill(_))) => drop(rig.execute()),
        Happens::Plan(_) | Happens::SkillExecutes => {}
        Happens::SkillEnds(outcome) => rig.end_present(outcome),
        Happens::Passes(seconds) => rig.silence(seconds),
        Happens::Restart => return rig.started_again(),
    }
    rig
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, ..ProptestConfig::default() })]

    #[test]
    fn what_is_kept_of_a_decision_is_never_an_old_one(
        happens in prop::collection::vec(anything(shipped_table().1.rows().len()), 1..60),
    ) {
        let flags: Vec<String> = shipped_table().1.rows().iter().map(|it| it.flag.clone()).collect();
        let mut rig = Rig::new();
        for it in happens {
            rig = after(rig, it, &flags);
            let (kept, fresh) = rig.mcm.decided();
            prop_assert_eq!(kept, fresh);
        }
    }
}
