//! The record of a wake, from which `kittiwake kpi` computes its figures. The kinds and paths of the leaves are a
//! contract.

use kittiwake_proto::v1::NodeStatus::{Failure, Idle, Running, Success};
use kittiwake_proto::v1::SkillOutcome::{Failed, Succeeded};
use kittiwake_proto::v1::{LeafChange, NodeStatus};

use crate::stories::rig::{Rig, plan, step};
use crate::stories::{fly, under_way};

/// How leaves of these kinds changed in the last wake with a record.
fn changes<'a>(rig: &'a Rig, kinds: &[&str]) -> Vec<(&'a str, NodeStatus, NodeStatus)> {
    let wanted = rig.timing.changes.iter().filter(|it| kinds.contains(&it.kind.as_str()));
    wanted.map(|it| (it.kind.as_str(), it.before(), it.after())).collect()
}

#[test]
fn a_step_that_follows_another_shows_in_one_record() {
    let (mut rig, skill) = under_way();
    rig.end(&skill, Succeeded, "");
    let expected = [
        ("NominalExecutor", Running, Success),
        ("NextStep", Idle, Success),
        ("NominalExecutor", Success, Idle),
        ("NextStep", Success, Idle),
        ("NominalExecutor", Idle, Running),
    ];
    assert_eq!(changes(&rig, &["NominalExecutor", "NextStep"]), expected);
}

#[test]
fn a_step_that_fails_and_the_plan_after_it_show() {
    let (mut rig, skill) = under_way();
    rig.end(&skill, Failed, "x");
    let expected = [
        ("NominalExecutor", Running, Failure),
        ("NominalExecutor", Failure, Idle),
        ("TransitionExecutor", Idle, Running),
    ];
    assert_eq!(changes(&rig, &["NominalExecutor", "TransitionExecutor"]), expected);
    rig.plan(plan(&[step(3, fly(100.0), &[])]));
    let expected = [("Replan", Running, Success), ("Replan", Success, Idle), ("NominalExecutor", Idle, Running)];
    assert_eq!(changes(&rig, &["Replan", "NominalExecutor"]), expected);
}

#[test]
fn a_flag_and_the_action_that_answers_it_are_found_by_their_paths() {
    let (mut rig, _) = under_way();
    rig.flag("obstacle", true);
    let ended = |tail: &str| {
        let found = rig.timing.changes.iter().find(|it| it.path.ends_with(tail)).expect("the leaf has changed");
        (found.after(), found.at_ns)
    };
    let (raised, raised_ns) = ended("/obstacle/Responds");
    let (action, action_ns) = ended("/obstacle 1: stop, 3 tries/Sequence/Fallback/stop/Stop");
    assert_eq!((raised, action), (Success, Running));
    let moments = [rig.timing.woken_ns, rig.timing.ticked_ns, raised_ns, action_ns, rig.timing.decided_ns];
    assert!(moments.is_sorted(), "{moments:?}");
    assert_eq!(rig.timing.lost_changes, 0);
}

#[test]
fn a_leaf_s_path_is_its_own() {
    let (mut rig, _) = under_way();
    rig.flag("obstacle", true);
    let at_once = |change: &LeafChange| (change.path.clone(), change.before, change.after);
    let mut changes: Vec<_> = rig.timing.changes.iter().map(at_once).collect();
    let count = changes.len();
    changes.sort();
    changes.dedup();
    assert_eq!(changes.len(), count, "no two leaves share a path");
}
