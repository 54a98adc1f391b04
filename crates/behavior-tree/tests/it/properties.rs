//! Properties of every tree, tried on random ones.

use std::collections::BTreeMap;
use std::time::Duration;

use behavior_tree::{Element, Leaf, LeafResult, Library, NodeId, NodeStatus, Port, Ports, Registry, Status, Tree};
use proptest::prelude::*;

/// What is known about the leaves.
#[derive(Default)]
struct World {
    /// Whether each leaf runs.
    running: BTreeMap<i64, bool>,
    /// The latest status that each leaf returned.
    returned: BTreeMap<i64, Status>,
    violations: Vec<String>,
    trace: String,
}

impl World {
    fn note(&mut self, event: char, id: i64, must_be_running: bool, is_running_after: bool) {
        self.trace += &format!("{event}{id}");
        let was_running = self.running.insert(id, is_running_after).unwrap_or_default();
        if was_running != must_be_running {
            self.violations.push(format!("{event}{id} while it {} running", if was_running { "is" } else { "is not" }));
        }
    }
}

struct Watched {
    id: i64,
    script: Vec<u8>,
    position: usize,
}

impl Watched {
    fn next(&mut self, world: &mut World) -> Status {
        let letter = self.script[self.position % self.script.len()];
        self.position += 1;
        let status = match letter {
            b'S' => Status::Success,
            b'F' => Status::Failure,
            b'K' => Status::Skipped,
            _ => Status::Running,
        };
        world.returned.insert(self.id, status);
        status
    }
}

impl Leaf<World> for Watched {
    fn start(&mut self, world: &mut World, _: &mut Ports<'_>) -> LeafResult {
        let status = self.next(world);
        world.note('s', self.id, false, status == Status::Running);
        Ok(status)
    }

    fn tick(&mut self, world: &mut World, _: &mut Ports<'_>) -> LeafResult {
        let status = self.next(world);
        // A leaf that skips while it runs is still running.
        world.note('r', self.id, true, matches!(status, Status::Running | Status::Skipped));
        Ok(status)
    }

    fn halt(&mut self, world: &mut World, _: &mut Ports<'_>) {
        world.note('h', self.id, true, false);
    }
}

fn registry() -> Registry<World> {
    let mut registry = Registry::new();
    registry.action("L", [Port::input::<i64>("id"), Port::input::<String>("s")], |spec| {
        let script = spec.constant::<String>("s")?.unwrap_or_default().into_bytes();
        Ok(Watched { id: spec.constant("id")?.unwrap_or_default(), script, position: 0 })
    });
    registry
}

/// A random tree whose leaves return the given statuses.
fn any_tree(letters: &'static str) -> impl Strategy<Value = Element> {
    let leaf = proptest::string::string_regex(&format!("[{letters}]{{1,5}}")).expect("a regex");
    let leaf = leaf.prop_map(|script| Element::new("L").attribute("s", &script));
    leaf.prop_recursive(4, 40, 4, |inner| {
        let some = || prop::collection::vec(inner.clone(), 1..4);
        let control = prop::sample::select(vec![
            "Sequence", "AsyncSequence", "SequenceWithMemory", "ReactiveSequence", "Fallback", "AsyncFallback",
            "ReactiveFallback", "Parallel", "ParallelAll",
        ]);
        let decorator = prop::sample::select(vec![
            "Inverter", "ForceSuccess", "ForceFailure", "KeepRunningUntilFailure", "SuccessIsRunning",
        ]);
        // With its default it skips.
        let once = inner.clone().prop_map(|child| Element::new("RunOnce").attribute("then_skip", "false").child(child));
        let branch = prop::sample::select(vec!["IfThenElse", "WhileDoElse"]);
        let loops = prop::sample::select(vec![("Repeat", "num_cycles"), ("RetryUntilSuccessful", "num_attempts")]);
        prop_oneof![
            4 => (control, some()).prop_map(|(tag, children)| Element::new(tag).children(children)),
            2 => (decorator, inner.clone()).prop_map(|(tag, child)| Element::new(tag).child(child)),
            1 => once,
            1 => (branch, prop::collection::vec(inner.clone(), 2..4))
                .prop_map(|(tag, children)| Element::new(tag).children(children)),
            1 => (loops, -1..4i32, inner.clone())
                .prop_map(|((tag, port), count, child)| Element::new(tag).attribute(port, &count.to_string()).child(child)),
        ]
    })
}

fn numbered(element: &Element, next: &mut i64) -> Element {
    let mut copy = Element::new(element.tag());
    if element.tag() == "L" {
        copy = copy.attribute("id", &next.to_string()).attribute("name", &format!("leaf {next}"));
        *next += 1;
    }
    copy = element.attributes().fold(copy, |copy, (name, value)| copy.attribute(name, value));
    copy.children(element.child_elements().map(|child| numbered(child, next)).collect::<Vec<_>>())
}

fn tree_of(root: &Element) -> Tree<World> {
    let xml = behavior_tree::Document::new().tree("m", numbered(root, &mut 0)).to_xml();
    let library = Library::load(&registry(), [("random.xml", xml.as_str())]);
    let library = library.unwrap_or_else(|errors| panic!("{xml}\n{errors}"));
    library.instantiate("m", &[]).expect("no parameters")
}

/// Ticks and halts a tree, and calls `look` after every step.
fn run(
    root: &Element,
    operations: &[bool],
    look: impl Fn(&Tree<World>, &World, Option<Status>) -> Result<(), TestCaseError>,
) -> Result<String, TestCaseError> {
    let (mut tree, mut world) = (tree_of(root), World::default());
    for is_tick in operations {
        if *is_tick {
            let status = tree.tick_exactly_once(Duration::ZERO, &mut world);
            world.trace += &format!("T{status}");
            look(&tree, &world, Some(status))?;
        } else {
            tree.halt(Duration::ZERO, &mut world);
            world.trace += "H";
            look(&tree, &world, None)?;
        }
        prop_assert!(world.violations.is_empty(), "{:?}\n{}", world.violations, world.trace);
    }
    prop_assert!(tree.errors().is_empty());
    Ok(world.trace)
}

fn nothing_runs_after_a_halt(tree: &Tree<World>, _: &World, status: Option<Status>) -> Result<(), TestCaseError> {
    if status.is_none() {
        let idle = tree.statuses().iter().all(|status| *status == NodeStatus::Idle);
        prop_assert!(idle, "after a halt:\n{}", tree.to_text());
    }
    Ok(())
}

fn statuses_of(tree: &Tree<World>, children: &[NodeId]) -> Vec<NodeStatus> {
    children.iter().map(|child| tree.statuses()[child.index()]).collect()
}

/// If no leaf skips, a running parent has the running children that its rule allows, and any other has none.
fn parents_follow_from_children(tree: &Tree<World>, _: &World, _: Option<Status>) -> Result<(), TestCaseError> {
    use NodeStatus::{Failure, Idle, Running, Success};
    for node in tree.nodes() {
        let children: Vec<NodeId> = tree.children(node.id).collect();
        let children = statuses_of(tree, &children);
        let running = children.iter().filter(|status| **status == Running).count();
        if node.status != Running {
            prop_assert_eq!(running, 0, "below {}:\n{}", node.tag, tree.to_text());
            continue;
        }
        let place = children.iter().position(|status| *status == Running);
        let (before, after) = match place {
            Some(place) => (&children[..place], &children[place + 1..]),
            None => (children.as_slice(), [].as_slice()),
        };
        let all = |statuses: &[NodeStatus], wanted| statuses.iter().all(|status| *status == wanted);
        let holds = match node.tag {
            "L" => true,
            "Sequence" => running == 1 && all(before, Success) && all(after, Idle),
            "Fallback" => running == 1 && all(before, Failure) && all(after, Idle),
            // It may be between two children. After a halt, those before its place are idle too.
            "AsyncSequence" | "SequenceWithMemory" | "AsyncFallback" => running <= 1 && all(after, Idle),
            "ReactiveSequence" | "ReactiveFallback" => running == 1 && all(before, Idle) && all(after, Idle),
            "Parallel" | "ParallelAll" => 1 <= running && !children.contains(&Idle),
            "IfThenElse" => running == 1,
            // The condition may run again while a branch does.
            "WhileDoElse" => running == 1 || (running == 2 && children[0] == Running),
            "Inverter" | "ForceSuccess" | "ForceFailure" | "RunOnce" => children == [Running],
            "KeepRunningUntilFailure" | "SuccessIsRunning" | "Repeat" | "RetryUntilSuccessful" => {
                children == [Running] || children == [Idle]
            }
            other => panic!("no rule for {other}"),
        };
        prop_assert!(holds, "{} runs:\n{}", node.tag, tree.to_text());
    }
    Ok(())
}

/// A failed tick was decided by a leaf that failed, or by a node that fails although its child succeeded.
fn a_failure_has_a_decider(tree: &Tree<World>, world: &World, status: Option<Status>) -> Result<(), TestCaseError> {
    if status.is_none() {
        return Ok(());
    }
    let decider = tree.last_failure();
    prop_assert_eq!(decider.is_some(), status == Some(Status::Failure));
    match decider.map(|node| (node.tag, node.name)) {
        Some(("L", name)) => {
            let id = name.strip_prefix("leaf ").and_then(|id| id.parse().ok()).expect("a numbered leaf");
            prop_assert_eq!(world.returned.get(&id), Some(&Status::Failure), "{} decided", name);
        }
        Some((tag, _)) => {
            let may_decide = ["Inverter", "ForceFailure", "RetryUntilSuccessful"].contains(&tag);
            prop_assert!(may_decide, "{} decided", tag);
        }
        None => {}
    }
    Ok(())
}

fn operations() -> impl Strategy<Value = Vec<bool>> {
    prop::collection::vec(prop::bool::weighted(0.85), 1..16)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_status_of_a_parent_follows_from_its_children(root in any_tree("SFR"), operations in operations()) {
        run(&root, &operations, parents_follow_from_children)?;
    }

    #[test]
    fn nothing_runs_after_a_halt_and_only_what_ran_is_halted(root in any_tree("SFRK"), operations in operations()) {
        run(&root, &operations, nothing_runs_after_a_halt)?;
    }

    #[test]
    fn a_failed_tick_has_a_decider(root in any_tree("SFRK"), operations in operations()) {
        run(&root, &operations, a_failure_has_a_decider)?;
    }

    #[test]
    fn the_same_inputs_give_the_same_trace(root in any_tree("SFRK"), operations in operations()) {
        let first = run(&root, &operations, |_, _, _| Ok(()))?;
        let second = run(&root, &operations, |_, _, _| Ok(()))?;
        prop_assert_eq!(first, second);
    }

    #[test]
    fn a_running_root_has_returned_running(root in any_tree("SFR"), operations in operations()) {
        run(&root, &operations, |tree, _, status| {
            let runs = tree.status() == NodeStatus::Running;
            prop_assert_eq!(runs, status == Some(Status::Running));
            Ok(())
        })?;
    }
}
