//! After a tick that failed, the tree names the node that decided it and why.

use std::time::Duration;

use behavior_tree::{
    BuildError, Cause, Leaf, LeafResult, Library, Port, Ports, Registry, Status, Template, Tree, Value,
};

use crate::stories::support::{Events, file, registry, tree_of};

/// A leaf that gives a reason in its first failure and none in later ones.
struct Once {
    has_failed: bool,
}

impl Leaf<Events> for Once {
    fn tick(&mut self, _: &mut Events, ports: &mut Ports<'_>) -> LeafResult {
        if !self.has_failed {
            ports.because("battery above reserve", 17.5, 20);
        }
        self.has_failed = true;
        Ok(Status::Failure)
    }
}

/// A leaf that runs, and panics when it is halted.
struct BadHalt;

impl Leaf<Events> for BadHalt {
    fn tick(&mut self, _: &mut Events, _: &mut Ports<'_>) -> LeafResult {
        Ok(Status::Running)
    }

    fn halt(&mut self, _: &mut Events, _: &mut Ports<'_>) {
        panic!("halt")
    }
}

/// A leaf that holds a tree.
struct Holder(Tree<Events>);

impl Holder {
    fn of(held: &Template<Events>) -> Result<Self, BuildError> {
        held.instantiate(&[]).map(Holder).map_err(|error| BuildError::new(error.to_string()))
    }
}

impl Leaf<Events> for Holder {
    fn tick(&mut self, events: &mut Events, ports: &mut Ports<'_>) -> LeafResult {
        Ok(ports.tick_tree(&mut self.0, events))
    }

    fn subtree(&self) -> Option<&Tree<Events>> {
        Some(&self.0)
    }
}

/// The leaves of [`registry`], those above, and a condition that fails and says `why`.
fn leaves() -> Registry<Events> {
    let mut registry = registry();
    registry.condition("Because", [Port::input::<String>("why")], |_, ports| {
        let why = ports.get::<String>("why")?;
        ports.because_of(why);
        Ok(false)
    });
    registry.action("Once", [], |_| Ok(Once { has_failed: false }));
    registry.action("BadHalt", [], |_| Ok(BadHalt));
    registry
}

fn deciders(tree: &mut Tree<Events>, ticks: usize) -> String {
    let mut story = Vec::new();
    for tick in 0..ticks {
        let status = tree.tick_exactly_once(Duration::from_millis(tick as u64), &mut Events::new());
        let failure = tree.last_failure();
        assert_eq!(failure.is_some(), status == Status::Failure, "only a failed tick has a decider");
        story.push(failure.map_or_else(|| status.to_string(), |node| node.name.to_owned()));
    }
    story.join(", ")
}

/// Ticks the tree with this root as often as `expected` has entries: the name of the node that decided a failed tick, or
/// the status of any other tick.
#[track_caller]
fn check(root: &str, expected: &str) {
    let mut tree = tree_of(&leaves(), &file(root, ""));
    assert_eq!(deciders(&mut tree, expected.split(", ").count()), expected, "{root}");
}

/// A scripted leaf with a name.
fn leaf(name: &str, script: &str) -> String {
    format!(r#"<L name="{name}" id="{name}" s="{script}"/>"#)
}

/// Skipped, after its condition has failed.
fn skipped_with_a_failure_inside() -> String {
    format!("<IfThenElse>{}<AlwaysSuccess/>{}</IfThenElse>", leaf("asked", "F"), leaf("else", "K"))
}

/// The first tag around the second, and so on, around `inner`.
fn within(tags: &[&str], inner: &str) -> String {
    let close = |tag: &str| format!("</{}>", tag.split(' ').next().unwrap_or_default());
    tags.iter().rev().fold(inner.to_owned(), |inner, tag| format!("<{tag}>{inner}{}", close(tag)))
}

#[test]
fn a_leaf_decides_for_all_its_parents() {
    let (a, b) = (leaf("a", "F"), leaf("b", "S"));
    check(&within(&["Sequence", "ReactiveSequence", "Repeat num_cycles=\"2\""], &a), "a");
    check(&within(&["KeepRunningUntilFailure", "SuccessIsRunning", "Delay delay_msec=\"0\""], &a), "a");
    check(&within(&["SequenceWithMemory", "Timeout msec=\"9\""], &a), "a");
    check(&within(&["Inverter name=\"outer\"", "Inverter"], &a), "outer");
    check(&format!("<SequenceWithMemory>{b}{a}</SequenceWithMemory>"), "running, a");
    check(&format!("<Switch2 variable=\"1\" case_1=\"1\" case_2=\"2\">{a}{b}<AlwaysSuccess/></Switch2>"), "a");
    check(&format!(r#"<SubTree ID="s"/></BehaviorTree><BehaviorTree ID="s">{a}"#), "a");
}

#[test]
fn a_failure_after_which_a_fallback_succeeded_does_not_decide() {
    let rescued = format!("<Fallback>{}{}</Fallback>", leaf("a", "F"), leaf("b", "S"));
    check(&format!("<Sequence>{rescued}{}</Sequence>", leaf("c", "F")), "c");
    check(&format!("<Sequence>{rescued}<Inverter>{}</Inverter></Sequence>", leaf("c", "S")), "Inverter");
    check(&format!("<ReactiveSequence>{rescued}{}</ReactiveSequence>", leaf("c", "RRF")), "running, running, c");
    check(&format!("<Parallel>{}{rescued}</Parallel>", leaf("c", "RF")), "running, c");
    check(&format!("<ParallelAll>{}{rescued}</ParallelAll>", leaf("c", "F")), "c");
    check(&format!("<Fallback>{}{rescued}</Fallback>", leaf("c", "F")), "success");
}

#[test]
fn the_last_alternative_that_failed_decides() {
    let (a, b) = (leaf("a", "F"), leaf("b", "F"));
    let skipped = skipped_with_a_failure_inside();
    for tag in ["Fallback", "ReactiveFallback"] {
        check(&format!("<{tag}>{a}{b}</{tag}>"), "b");
        check(&format!("<{tag}>{a}{skipped}</{tag}>"), "a");
    }
    check(&format!("<AsyncFallback>{a}{b}</AsyncFallback>"), "running, b");
    // The second child is skipped when it has run: the first one failed in an earlier tick.
    let stops = format!("<Fallback>{a}{}</Fallback>", leaf("b", "RK"));
    let busy = format!("<Fallback>{}{}</Fallback>", leaf("c", "F"), leaf("d", "RRR"));
    check(&format!("<Parallel success_count=\"-1\">{stops}{busy}</Parallel>"), "running, a");
}

#[test]
fn a_parallel_names_the_child_whose_failure_ended_it() {
    let tolerant = |children: &str| format!("<Parallel failure_count=\"2\" success_count=\"1\">{children}</Parallel>");
    check(&tolerant(&(leaf("a", "F") + &leaf("b", "F") + &leaf("c", "R"))), "b");
    check(&tolerant(&(leaf("a", "RF") + &leaf("b", "F") + &leaf("c", "R"))), "running, a");
    // No failure is tolerated at all, so no child decided.
    let strict = format!("<Parallel name=\"p\" failure_count=\"0\">{}{}</Parallel>", leaf("a", "S"), leaf("b", "S"));
    check(&strict, "p");
    let ends = format!("<SuccessIsRunning>{}</SuccessIsRunning>", leaf("a", "S"));
    let beside = format!("<Parallel success_count=\"1\" failure_count=\"1\">{ends}{}</Parallel>", leaf("b", "RF"));
    check(&beside, "running, b");
}

#[test]
fn a_parallel_all_remembers_the_failure_that_reached_its_limit() {
    let slow = format!("<Sequence><Fallback>{}{}</Fallback></Sequence>", leaf("b", "RF"), leaf("c", "S"));
    check(&format!("<ParallelAll>{}{slow}</ParallelAll>", leaf("a", "F")), "running, a");
    let two = format!("{}{}{}{slow}", leaf("x", "F"), leaf("y", "F"), leaf("z", "F"));
    check(&format!("<ParallelAll max_failures=\"2\">{two}</ParallelAll>"), "running, y");
    let none = format!("<ParallelAll name=\"p\" max_failures=\"0\">{}</ParallelAll>", leaf("a", "S"));
    check(&none, "p");
}

#[test]
fn a_guard_decides_and_not_the_action_it_halts() {
    let guard = r#"<C name="guard" id="1" s="SF"/>"#;
    check(&format!("<ReactiveSequence>{guard}{}</ReactiveSequence>", leaf("a", "R")), "running, guard");
    check(&format!("<WhileDoElse>{guard}{}</WhileDoElse>", leaf("a", "R")), "running, guard");
    check(&format!("<IfThenElse>{}{}{}</IfThenElse>", leaf("a", "F"), leaf("b", "S"), leaf("c", "F")), "c");
    let unhaltable = format!("<ReactiveSequence>{guard}<BadHalt/></ReactiveSequence>");
    check(&unhaltable, "running, guard");
}

#[test]
fn a_node_that_fails_by_itself_is_named() {
    check("<AlwaysFailure/>", "AlwaysFailure");
    check(&format!("<ForceFailure>{}</ForceFailure>", leaf("a", "S")), "ForceFailure");
    check(&format!("<ForceFailure>{}</ForceFailure>", leaf("a", "F")), "a");
    check("<Sequence><ScriptCondition name=\"asked\" code=\"1 &gt; 2\"/></Sequence>", "asked");
    check("<Precondition if=\"1 &gt; 2\"><AlwaysSuccess/></Precondition>", "Precondition");
    check("<Sequence><AlwaysSuccess name=\"a\" _failureIf=\"true\"/></Sequence>", "a");
    check(
        &format!(
            "<Sequence name=\"s\" _onSuccess=\"x := y\">{}<Script code=\"y := 1\" _skipIf=\"true\"/></Sequence>",
            leaf("a", "S")
        ),
        "s",
    );
    check(
        &format!("<RetryUntilSuccessful num_attempts=\"0\">{}</RetryUntilSuccessful>", leaf("a", "F")),
        "RetryUntilSuccessful",
    );
}

#[test]
fn loops_and_memories_name_the_leaf_of_the_attempt_that_counts() {
    check(&format!("<RetryUntilSuccessful num_attempts=\"2\">{}</RetryUntilSuccessful>", leaf("a", "F")), "running, a");
    let once = format!("<RunOnce then_skip=\"false\">{}</RunOnce>", leaf("a", "F"));
    check(&format!("<Fallback><Sequence>{}{once}</Sequence>{}</Fallback>", leaf("b", "S"), leaf("c", "K")), "a, a");
    // The condition is an action that keeps its failure while the other branch runs.
    let keeps = format!("<WhileDoElse>{}{}{}</WhileDoElse>", leaf("a", "F"), leaf("b", "S"), leaf("c", "RK"));
    check(&keeps, "running, skipped");
}

#[test]
fn a_timeout_decides_and_says_so() {
    let mut tree = tree_of(&leaves(), &file(&format!("<Timeout msec=\"1\">{}</Timeout>", leaf("a", "R")), ""));
    assert_eq!(deciders(&mut tree, 2), "running, Timeout");
    let why = tree.last_failure().and_then(|node| node.why).expect("a reason");
    assert_eq!(why.cause.to_string(), "not finished within 1 ms");
}

#[test]
fn a_reason_is_that_of_the_latest_failure() {
    let mut tree = tree_of(&leaves(), &file(r#"<Once name="a"/>"#, ""));
    let mut why = || {
        tree.tick_exactly_once(Duration::ZERO, &mut Events::new());
        tree.last_failure().map(|node| (node.name.to_owned(), node.why.map(|record| record.cause.to_string())))
    };
    let reason = "not met: battery above reserve (found 17.5, limit 20)".to_owned();
    assert_eq!(why(), Some(("a".to_owned(), Some(reason))));
    assert_eq!(why(), Some(("a".to_owned(), None)), "it gave no reason this time");
}

#[test]
fn a_precondition_of_an_earlier_tick_does_not_explain_a_later_failure() {
    let root = format!(
        r#"<Sequence><Script code="n := 0" _skipIf="true"/><Script code="n += 1" _onSuccess="n := n"/>
        <Sequence name="s" _failureIf="n == 1">{}</Sequence></Sequence>"#,
        leaf("a", "F")
    );
    let mut registry = leaves();
    registry.global::<i64>("n");
    let mut tree = tree_of(&registry, &file(&root, ""));
    tree.set("n", 0).expect("a global");
    assert_eq!(deciders(&mut tree, 2), "s, a");
    let sequence = tree.find("s").expect("the node");
    assert_eq!(tree.why(sequence), None);
}

#[test]
fn a_tree_that_a_leaf_holds_passes_its_reason_on() {
    let because = |name: &str| format!(r#"<Because name="{name}" why="{name}"/>"#);
    let held = format!(
        "<ReactiveSequence><Fallback>{}<AlwaysSuccess/></Fallback>{}{}</ReactiveSequence>",
        because("recovered"),
        leaf("b", "RS"),
        because("decides")
    );
    let library = Library::load(&leaves(), [("held.xml", file(&held, ""))]);
    let template = library.unwrap_or_else(|errors| panic!("{errors}")).template("m").expect("the tree");
    let mut registry = leaves();
    registry.action("Holder", [], move |_| Holder::of(&template));
    let root = format!("<Sequence><Fallback>{}<AlwaysSuccess/></Fallback><Holder/></Sequence>", because("outside"));
    let mut tree = tree_of(&registry, &file(&root, ""));
    assert_eq!(deciders(&mut tree, 2), "running, Holder");
    let failure = tree.last_failure().expect("it failed");
    assert_eq!(failure.why.map(|record| record.cause.to_string()).as_deref(), Some("not met: decides"));
    let inside = tree.held_by(failure.id).and_then(Tree::last_failure).expect("the held tree failed");
    assert_eq!(inside.name, "decides");
}

#[test]
fn a_leaf_learns_why_the_sibling_before_it_failed() {
    let mut registry = leaves();
    registry.sync_action("Handle", [], |events: &mut Events, ports| {
        events.push_str(&ports.last_failure().map_or_else(|| "no reason".to_owned(), Cause::to_string));
        Ok(true)
    });
    let because = |why: &str| format!(r#"<Because name="{why}" why="{why}"/>"#);
    let reason = |failing: &str| {
        let root = format!("<Fallback><Sequence>{failing}</Sequence><Handle/></Fallback>");
        let (mut tree, mut events) = (tree_of(&registry, &file(&root, "")), Events::new());
        tree.tick_exactly_once(Duration::ZERO, &mut events);
        events
    };
    let rescued = format!("<Fallback>{}<AlwaysSuccess/></Fallback>", because("recovered"));
    assert_eq!(reason(&format!("{rescued}{}", because("decides"))), "not met: decides");
    assert_eq!(reason(&format!("{rescued}<AlwaysFailure/>")), "no reason");
}

#[test]
fn an_error_is_the_reason_of_its_node() {
    let mut tree = tree_of(&leaves(), &file(&format!("<Parallel>{}<BadHalt/></Parallel>", leaf("a", "E")), ""));
    assert_eq!(deciders(&mut tree, 1), "a");
    let why = |tree: &Tree<Events>| tree.last_failure().and_then(|node| node.why.map(|it| it.cause.to_string()));
    assert_eq!(why(&tree).as_deref(), Some("the script says so"));

    let mut tree = tree_of(&leaves(), &file(&format!("<Parallel><BadHalt/>{}</Parallel>", leaf("a", "P")), ""));
    assert_eq!(deciders(&mut tree, 1), "a");
    assert_eq!(why(&tree).as_deref(), Some("panicked: the script says so"));
    assert_eq!(tree.errors().len(), 2, "the halted leaf's panic is recorded too");
}

#[test]
fn causes_are_sentences() {
    let unmet = |value: Option<Value>, threshold: Option<Value>| {
        Cause::Unmet { condition: "the way is clear".into(), value, threshold }.to_string()
    };
    assert_eq!(unmet(None, None), "not met: the way is clear");
    assert_eq!(unmet(Some(3.into()), Some(5.0.into())), "not met: the way is clear (found 3, limit 5)");
    assert_eq!(unmet(Some("B".into()), Some("none".into())), "not met: the way is clear (found B, expected none)");
    assert_eq!(unmet(Some("B".into()), None), "not met: the way is clear (found B)");
    assert_eq!(unmet(None, Some("none".into())), "not met: the way is clear (expected none)");
    let expression = |holds, compared| Cause::Expression { text: "a < b".into(), holds, compared }.to_string();
    assert_eq!(expression(true, None), "`a < b` is true");
    assert_eq!(expression(false, Some((2.into(), 1.into()))), "`a < b` is false (compared 2 with 1)");
    assert_eq!(Cause::Happened("the motor stopped".into()).to_string(), "the motor stopped");
}

#[test]
fn a_leaf_explains_a_failure_in_its_own_words() {
    let mut registry = leaves();
    registry.condition("Explains", [], |_, ports| {
        ports.explain(format!("rejected after {} s", 3));
        Ok(false)
    });
    let mut tree = tree_of(&registry, &file("<Explains/>", ""));
    assert_eq!(deciders(&mut tree, 1), "Explains");
    let why = tree.last_failure().and_then(|node| node.why).expect("a reason");
    assert_eq!(why.cause, Cause::Happened("rejected after 3 s".to_owned().into()));
}
