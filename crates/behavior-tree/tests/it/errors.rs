//! A leaf that panics or returns an error fails its node and is recorded, and the tree goes on.

use std::time::Duration;

use behavior_tree::{NodeErrorKind, Status};

use crate::stories::support::{check, file, registry, tree_of};

#[test]
fn an_error_or_panic_fails_the_node_and_halts_what_it_started() {
    check(r#"<Fallback><L id="1" s="E"/><L id="2" s="S"/></Fallback>"#, "t", "s1h1s2 S[III]");
    check(r#"<Fallback><L id="1" s="RP"/><L id="2" s="R"/></Fallback>"#, "tt", "s1 R[RRI], r1h1s2 R[RFR]");
    let parallel = r#"<Parallel><L id="1" s="R"/><L id="2" s="RE"/></Parallel>"#;
    check(parallel, "tt", "s1s2 R[RRR], r1r2h2h1 F[III]");
}

#[test]
fn errors_are_recorded_with_node_time_and_message() {
    let root = r#"<Sequence><ForceSuccess><L name="errs" id="1" s="E"/></ForceSuccess><L name="panics" id="2" s="P"/></Sequence>"#;
    let mut tree = tree_of(&registry(), &file(root, ""));
    assert_eq!(tree.tick_once(Duration::from_millis(7), &mut String::new()), Status::Failure);
    let (errors, lost) = tree.take_errors();
    let found: Vec<_> = errors.iter().map(|error| (tree.name(error.node), &error.kind)).collect();
    let (error, panic) =
        (NodeErrorKind::Returned("the script says so".into()), NodeErrorKind::Panic("the script says so".into()));
    assert_eq!(found, [("errs", &error), ("panics", &panic)]);
    assert!(errors.iter().all(|error| error.at == Duration::from_millis(7)));
    assert_eq!(lost, 0);
    assert!(tree.errors().is_empty());
}

#[test]
fn a_reason_is_forgotten_when_the_node_succeeds() {
    let mut tree = tree_of(&registry(), &file(r#"<C id="1" s="ES"/>"#, ""));
    tree.tick_once(Duration::ZERO, &mut String::new());
    let root = tree.find("C").expect("the root");
    assert_eq!(tree.why(root).map(|record| record.cause.to_string()).as_deref(), Some("the script says so"));
    tree.tick_once(Duration::ZERO, &mut String::new());
    assert_eq!(tree.why(root), None);
}

#[test]
fn a_condition_must_not_run() {
    check(r#"<C id="1" s="R"/>"#, "t", "s1h1 F[I]");
}

#[test]
fn a_leaf_that_always_errs_does_not_fill_the_memory() {
    let mut tree = tree_of(&registry(), &file(r#"<C id="" s="E"/>"#, ""));
    for _ in 0..1000 {
        tree.tick_once(Duration::ZERO, &mut String::new());
    }
    let (errors, lost) = tree.take_errors();
    assert_eq!((errors.len(), lost), (64, 936));
}
