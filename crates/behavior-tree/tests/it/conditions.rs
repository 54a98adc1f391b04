//! Pre- and postconditions and the expression language.

use std::time::Duration;

use behavior_tree::{Cause, NodeErrorKind, Status, Value};

use crate::stories::support::{check, file, registry, tree_of};

#[test]
fn preconditions_decide_before_an_idle_node_is_ticked() {
    check(r#"<L id="1" s="R" _failureIf="1 &lt; 2"/>"#, "t", "F[I]");
    check(r#"<L id="1" s="R" _successIf="true"/>"#, "t", "S[I]");
    check(r#"<L id="1" s="R" _skipIf="true"/>"#, "t", "K[I]");
    check(r#"<L id="1" s="R" _while="false"/>"#, "t", "K[I]");
    check(r#"<L id="1" s="R" _failureIf="false" _successIf="0" _skipIf="0.0" _while="1"/>"#, "t", "s1 R[R]");
}

#[test]
fn the_first_precondition_that_decides_wins() {
    check(r#"<L id="1" s="R" _skipIf="true" _successIf="true" _failureIf="true"/>"#, "t", "F[I]");
    check(r#"<L id="1" s="R" _while="false" _skipIf="true" _successIf="true"/>"#, "t", "S[I]");
}

#[test]
fn only_while_is_computed_for_a_running_node() {
    let root = |attribute: &str| {
        format!(
            r#"<Sequence><Script code="n := 0"/><Parallel success_count="2">
            <L id="1" s="R" {attribute}/><Sequence><L id="2" s="RS"/><Script code="n = 1"/><L id="3" s="R"/></Sequence>
            </Parallel></Sequence>"#
        )
    };
    let goes_on = "s1s2 R[RSRRRRII], r1r2s3 R[RSRRRSSR], r1r3 R[RSRRRSSR]";
    check(&root(r#"_skipIf="n == 1""#), "ttt", goes_on);
    let halts = "s1s2 R[RSRRRRII], r1r2s3 R[RSRRRSSR], h1r3 R[RSRIRSSR]";
    check(&root(r#"_while="n == 0""#), "ttt", halts);
}

#[test]
fn postconditions_run_when_a_node_has_finished_or_is_halted() {
    let root = r#"<Sequence><Script code="log := ''"/>
        <L id="1" s="S" _onSuccess="log += 's'" _onFailure="log += 'f'" _post="log += 'p'" _onHalted="log += 'h'"/>
        <ForceSuccess><L id="2" s="F" _onSuccess="log += 's'" _onFailure="log += 'f'" _post="log += 'p'"/></ForceSuccess>
        <L id="3" s="R" _onHalted="log += 'h'"/></Sequence>"#;
    let mut tree = tree_of(&registry(), &file(root, ""));
    tree.tick_once(Duration::ZERO, &mut String::new());
    assert_eq!(tree.get::<String>("log").as_deref(), Some("spfp"));
    tree.halt(Duration::ZERO, &mut String::new());
    assert_eq!(tree.get::<String>("log").as_deref(), Some("spfph"));
    tree.halt(Duration::ZERO, &mut String::new());
    assert_eq!(tree.get::<String>("log").as_deref(), Some("spfph"), "nothing ran");
}

#[test]
fn a_condition_that_fails_a_node_is_recorded_with_what_it_compared() {
    let root = r#"<Sequence><Script code="battery := 17.5"/><ScriptCondition name="reserve" code="20 &lt;= battery"/></Sequence>"#;
    let mut tree = tree_of(&registry(), &file(root, ""));
    assert_eq!(tree.tick_once(Duration::ZERO, &mut String::new()), Status::Failure);
    let record = tree.find("reserve").and_then(|node| tree.why(node)).expect("a cause");
    let compared = Some((Value::Int(20), Value::Float(17.5)));
    assert_eq!(record.cause, Cause::Expression { text: "20 <= battery".into(), holds: false, compared });
}

#[test]
fn a_precondition_node_asks_once_before_its_child_starts() {
    let root = |otherwise: &str| {
        format!(
            r#"<Sequence><Script code="n := 0"/><Precondition if="n == 0" else="{otherwise}">
            <L id="1" s="RS" _onSuccess="n = 1"/></Precondition><Script code="n = 1"/></Sequence>"#
        )
    };
    check(&root("FAILURE"), "tt", "s1 R[RSRRI], r1 S[IIIII]");
    let second = |otherwise| format!(r#"<Precondition if="false" else="{otherwise}"><L id="1" s="S"/></Precondition>"#);
    check(&second("SUCCESS"), "t", "S[II]");
    check(&second("SKIPPED"), "t", "K[II]");
    check(&second("RUNNING"), "t", "R[RI]");
}

#[test]
fn an_expression_that_cannot_be_computed_is_an_error() {
    let root = r#"<Sequence><L id="1" s="S" _skipIf="late == 1"/><Script code="late := 1"/></Sequence>"#;
    let mut tree = tree_of(&registry(), &file(root, ""));
    assert_eq!(tree.tick_once(Duration::ZERO, &mut String::new()), Status::Failure);
    let (errors, _) = tree.take_errors();
    let text = "expression `late == 1`: key `late` has no value yet";
    assert_eq!(errors[0].kind, NodeErrorKind::Expression(text.into()));
    let failure = tree.last_failure().expect("it failed");
    assert_eq!(failure.name, "L");
    assert_eq!(failure.why.map(|record| record.cause.to_string()).as_deref(), Some(text));
}

#[test]
fn names_for_numbers_come_from_the_registry() {
    let mut registry = registry();
    registry.constant("RED", 1);
    let root = r#"<Sequence><Script code="color := RED"/><Switch2 variable="{color}" case_1="GREEN" case_2="RED">
        <L id="1" s="S"/><L id="2" s="S"/><L id="3" s="S"/></Switch2></Sequence>"#;
    let mut tree = tree_of(&registry, &file(root, ""));
    let mut events = String::new();
    tree.tick_once(Duration::ZERO, &mut events);
    assert_eq!(events, "s2");
}
