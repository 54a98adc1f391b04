//! BehaviorTree.CPP 4.10.0 and this engine behave in the same way on thousands of random trees.
//!
//! `BT_TRACES=<file>` runs another corpus of the same format, plain or compressed with gzip.

use std::fmt::Write;
use std::io::Read;
use std::path::PathBuf;
use std::time::Duration;

use behavior_tree::{Leaf, LeafResult, Library, NodeStatus, Port, Ports, Registry, Status, Tree};

/// Returns the statuses of its script in turn, and writes down how it is called.
struct Scripted {
    id: i64,
    script: Vec<u8>,
    position: usize,
}

impl Scripted {
    fn next(&mut self, events: &mut String, event: char) -> Status {
        let _ = write!(events, "{event}{}", self.id);
        let letter = self.script[self.position % self.script.len()];
        self.position += 1;
        match letter {
            b'S' => Status::Success,
            b'F' => Status::Failure,
            _ => Status::Running,
        }
    }
}

impl Leaf<String> for Scripted {
    fn start(&mut self, events: &mut String, _: &mut Ports<'_>) -> LeafResult {
        Ok(self.next(events, 's'))
    }

    fn tick(&mut self, events: &mut String, _: &mut Ports<'_>) -> LeafResult {
        Ok(self.next(events, 'r'))
    }

    fn halt(&mut self, events: &mut String, _: &mut Ports<'_>) {
        let _ = write!(events, "h{}", self.id);
    }
}

fn registry() -> Registry<String> {
    let mut registry = Registry::new();
    registry.action("L", [Port::input::<i64>("id"), Port::input::<String>("s")], |spec| {
        let id = spec.constant::<i64>("id")?.unwrap_or_default();
        let script = spec.constant::<String>("s")?.unwrap_or_default().into_bytes();
        Ok(Scripted { id, script, position: 0 })
    });
    registry
}

fn trace(tree: &mut Tree<String>, operations: &str) -> String {
    let mut trace = String::new();
    for operation in operations.chars() {
        let mut events = String::new();
        if operation == 't' {
            let letter = match tree.tick_exactly_once(Duration::ZERO, &mut events) {
                Status::Running => 'R',
                Status::Success => 'S',
                Status::Failure => 'F',
                Status::Skipped => 'K',
            };
            let _ = write!(trace, "T{events}{letter}");
        } else {
            tree.halt(Duration::ZERO, &mut events);
            let _ = write!(trace, "H{events}");
        }
        trace.push('[');
        trace.extend(tree.statuses().iter().map(|status| match status {
            NodeStatus::Idle => 'I',
            NodeStatus::Running => 'R',
            NodeStatus::Success => 'S',
            NodeStatus::Failure => 'F',
        }));
        trace.push(']');
    }
    trace
}

fn corpus() -> String {
    let here = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    // Cargo runs tests in the crate's folder, but the path may be relative to the root of the workspace.
    let given = std::env::var_os("BT_TRACES").map(|path| [path.clone().into(), here.join("../..").join(path)]);
    let given = given.map(|[as_is, from_root]| if as_is.exists() { as_is } else { from_root });
    let path: PathBuf = given.unwrap_or_else(|| here.join("tests/data/behavior_tree_traces.tsv.gz"));
    let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut text = String::new();
    let read = if bytes.starts_with(&[0x1f, 0x8b]) {
        flate2::read::MultiGzDecoder::new(&*bytes).read_to_string(&mut text)
    } else {
        bytes.as_slice().read_to_string(&mut text)
    };
    read.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    text
}

#[test]
fn conformance_every_trace_matches() {
    let registry = registry();
    let corpus = corpus();
    let mut cases = 0;
    let mut differences = Vec::new();
    for (number, line) in corpus.lines().enumerate().filter(|(_, line)| !line.is_empty()) {
        let [operations, xml, expected] = line.split('\t').collect::<Vec<_>>()[..] else {
            panic!("line {}: three columns expected", number + 1);
        };
        cases += 1;
        let library = Library::load(&registry, [("trace.xml", xml)]).unwrap_or_else(|errors| panic!("{xml}\n{errors}"));
        let mut tree = library.instantiate("m", &[]).expect("a tree without parameters");
        let found = trace(&mut tree, operations);
        if found != expected {
            differences.push(format!("line {}\n{xml}\nexpected {expected}\nfound    {found}", number + 1));
        }
    }
    assert!(0 < cases, "the corpus is empty");
    assert!(
        differences.is_empty(),
        "{} of {cases} traces differ, the first one:\n{}",
        differences.len(),
        differences[0]
    );
}
