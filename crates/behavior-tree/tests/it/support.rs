//! Leaves that follow a script, and the story of a tree as one line of text.

#![expect(unreachable_pub, reason = "no other crate uses a test: here `pub` means outside of the module")]

use std::fmt::Write;
use std::time::Duration;

use behavior_tree::{
    BuildError, Leaf, LeafClass, LeafResult, Library, NodeSpec, NodeStatus, Port, Ports, Registry, Status, Tree,
};

/// How leaves were called, in order: `s1` leaf 1 was started, `r1` ticked again, `h1` halted.
pub type Events = String;

/// Returns the statuses of its script in turn: Success, Failure, Running, sKipped, Error, Panic, Again (running, and asks
/// for another tick at once).
pub struct Scripted {
    id: String,
    script: Vec<u8>,
    position: usize,
}

impl Scripted {
    pub fn build(spec: &NodeSpec<'_>) -> Result<Self, BuildError> {
        let id = spec.constant::<String>("id")?.unwrap_or_default();
        let script = spec.constant::<String>("s")?.unwrap_or_default().into_bytes();
        if script.is_empty() {
            return Err(BuildError::new("a script has at least one letter"));
        }
        Ok(Scripted { id, script, position: 0 })
    }

    fn next(&mut self, events: &mut Events, event: char, ports: &mut Ports<'_>) -> LeafResult {
        let _ = write!(events, "{event}{}", self.id);
        let letter = self.script[self.position % self.script.len()];
        self.position += 1;
        match letter {
            b'S' => Ok(Status::Success),
            b'F' => Ok(Status::Failure),
            b'R' => Ok(Status::Running),
            b'K' => Ok(Status::Skipped),
            b'E' => Err("the script says so".into()),
            b'P' => panic!("the script says so"),
            b'A' => {
                ports.tick_again();
                Ok(Status::Running)
            }
            other => Err(format!("unknown letter `{}`", char::from(other)).into()),
        }
    }
}

impl Leaf<Events> for Scripted {
    fn start(&mut self, events: &mut Events, ports: &mut Ports<'_>) -> LeafResult {
        self.next(events, 's', ports)
    }

    fn tick(&mut self, events: &mut Events, ports: &mut Ports<'_>) -> LeafResult {
        self.next(events, 'r', ports)
    }

    fn halt(&mut self, events: &mut Events, _: &mut Ports<'_>) {
        let _ = write!(events, "h{}", self.id);
    }
}

/// `L` is a scripted action, `C` a scripted condition.
pub fn registry() -> Registry<Events> {
    let ports = || [Port::input::<String>("id"), Port::input::<String>("s")];
    let mut registry = Registry::new();
    registry.action("L", ports(), Scripted::build);
    registry.leaf(LeafClass::Condition, "C", ports(), Scripted::build);
    registry
}

/// A file with one tree `m` with this root, and `more` after it.
pub fn file(root: &str, more: &str) -> String {
    format!(
        r#"<root BTCPP_format="4" main_tree_to_execute="m"><BehaviorTree ID="m">{root}</BehaviorTree>{more}</root>"#
    )
}

#[track_caller]
pub fn tree_of(registry: &Registry<Events>, xml: &str) -> Tree<Events> {
    let library = Library::load(registry, [("test.xml", xml)]).unwrap_or_else(|errors| panic!("{xml}\n{errors}"));
    library.instantiate("m", &[]).unwrap_or_else(|error| panic!("{xml}\n{error}"))
}

/// Every node's status as a letter.
pub fn letters<Ctx>(tree: &Tree<Ctx>) -> String {
    let of_status = |status: &NodeStatus| match status {
        NodeStatus::Idle => 'I',
        NodeStatus::Running => 'R',
        NodeStatus::Success => 'S',
        NodeStatus::Failure => 'F',
    };
    tree.statuses().iter().map(of_status).collect()
}

fn letter(status: Status) -> char {
    match status {
        Status::Running => 'R',
        Status::Success => 'S',
        Status::Failure => 'F',
        Status::Skipped => 'K',
    }
}

/// Performs operations. Returns the calls of leaves, the tree's status and all statuses after each of them. `t` ticks
/// exactly once, `o` ticks once with further ticks, `h` halts, a digit lets as many milliseconds pass (0 is ten).
pub fn story(tree: &mut Tree<Events>, operations: &str) -> String {
    let mut story = Vec::new();
    let mut now = Duration::ZERO;
    for operation in operations.chars() {
        let mut events = String::new();
        let result = match operation {
            't' => letter(tree.tick_exactly_once(now, &mut events)).to_string(),
            'o' => letter(tree.tick_once(now, &mut events)).to_string(),
            'h' => {
                tree.halt(now, &mut events);
                "H".to_owned()
            }
            digit => {
                let milliseconds = digit.to_digit(10).expect("an operation");
                now += Duration::from_millis(if milliseconds == 0 { 10 } else { u64::from(milliseconds) });
                continue;
            }
        };
        story.push(format!("{events} {result}[{}]", letters(tree)).trim_start().to_owned());
    }
    story.join(", ")
}

/// The tree with this root has this story.
#[track_caller]
pub fn check(root: &str, operations: &str, expected: &str) {
    let mut tree = tree_of(&registry(), &file(root, ""));
    assert_eq!(story(&mut tree, operations), expected, "{root}");
}
