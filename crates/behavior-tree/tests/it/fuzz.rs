//! Loading any file ends soon, without a panic and without filling the memory.
//!
//! `KITTIWAKE_SWEEP=all` tries eight times as many files. Expressions have their own test in `src/script/tests.rs`.

use std::time::Duration;

use behavior_tree::Library;
use proptest::collection::vec;
use proptest::prelude::*;

use crate::stories::support::registry;
use counting_allocator::peak;

/// Parts of tree files, and a few texts that belong in no tree file.
const PARTS: &[&str] = &[
    "<root BTCPP_format=\"4\">",
    "</root>",
    "<BehaviorTree ID=\"a\">",
    "<BehaviorTree ID=\"b\">",
    "</BehaviorTree>",
    "<Sequence>",
    "</Sequence>",
    "<Fallback name=\"n\">",
    "</Fallback>",
    "<Inverter>",
    "</Inverter>",
    "<Parallel>",
    "</Parallel>",
    "<L id=\"1\" s=\"SFRKE\"/>",
    "<L id=\"{x}\" s=\"{y}\"/>",
    "<SubTree ID=\"a\"/>",
    "<SubTree ID=\"b\" x=\"{=}\"/>",
    "<SubTree ID=\"b\" _autoremap=\"true\" y=\"1\"/>",
    "<Script code=\"x := 'S'; y := x\"/>",
    "<Script code=\"x += 1\"/>",
    "<AlwaysSuccess _skipIf=\"x\" _while=\"y\"/>",
    "<Switch2 variable=\"{x}\" case_1=\"1\" case_2=\"2\">",
    "</Switch2>",
    "<Repeat num_cycles=\"-1\">",
    "<Repeat num_cycles=\"{x}\">",
    "</Repeat>",
    "<Timeout msec=\"5\">",
    "</Timeout>",
    "<TreeNodesModel>",
    "</TreeNodesModel>",
    "<input_port name=\"x\" type=\"int\" default=\"3\"/>",
    "<SubTree ID=\"a\">",
    "</SubTree>",
    "<include path=\"t.xml\"/>",
    "<!--",
    "-->",
    "<![CDATA[",
    "]]>",
    "<!DOCTYPE a [<!ENTITY b \"&b;&b;\">]>",
    "&b;",
    "&#0;",
    "&amp;",
    "\"",
    "'",
    "<",
    ">",
    "/>",
    "=",
    "{",
    "}",
    " ",
    "\n",
    "\u{0}",
    "\u{fffd}",
    "ä",
    "x",
    "_skipIf=\"",
];

/// Nodes without children.
const LEAVES: &[&str] = &[
    r#"<L id="1" s="SFRKE"/>"#,
    r#"<C id="1" s="FKSE"/>"#,
    r#"<SubTree ID="b" x="1" y="S"/>"#,
    r#"<SubTree ID="b" _autoremap="true"/>"#,
    r#"<SubTree ID="b" x="{=}" y="{x}"/>"#,
    r#"<Script code="x := 'S'; y := x"/>"#,
    r#"<Script code="n := 1; n += 1"/>"#,
    r#"<ScriptCondition code="n &gt; 1"/>"#,
    r#"<Sleep msec="5"/>"#,
    r#"<AlwaysFailure/>"#,
    r#"<AlwaysSuccess _skipIf="n == 2" _post="n = 0"/>"#,
    r#"<L id="2" s="R" _while="n &lt; 2" _onHalted="n *= 2"/>"#,
];

/// Nodes with children.
const BRANCHES: &[&str] = &[
    "Sequence",
    "Fallback name=\"n\"",
    "ReactiveSequence",
    "ReactiveFallback",
    "Parallel",
    "ParallelAll max_failures=\"-1\"",
    "SequenceWithMemory",
    "AsyncFallback",
    "IfThenElse",
    "WhileDoElse",
    "Inverter",
    "Repeat num_cycles=\"-1\"",
    "RetryUntilSuccessful num_attempts=\"{n}\"",
    "Timeout msec=\"5\"",
    "Delay delay_msec=\"0\"",
    "RunOnce",
    "KeepRunningUntilFailure",
    "SuccessIsRunning",
    "Precondition if=\"n\" else=\"SKIPPED\"",
    "Switch2 variable=\"{n}\" case_1=\"1\" case_2=\"2\"",
];

/// A well-formed node. Every byte makes a choice.
fn node(bytes: &mut impl Iterator<Item = u8>, depth: usize) -> String {
    let chosen = usize::from(bytes.next().unwrap_or(0));
    if depth == 0 || chosen % 3 == 0 {
        return LEAVES[chosen / 3 % LEAVES.len()].to_owned();
    }
    let branch = BRANCHES[chosen / 3 % BRANCHES.len()];
    let tag = branch.split(' ').next().unwrap_or_default();
    let is_decorator = 10 <= chosen / 3 % BRANCHES.len() && tag != "Switch2";
    let children = if is_decorator { 1 } else { 3 };
    let inside: String = (0..children).map(|_| node(bytes, depth - 1)).collect();
    format!("<{branch}>{inside}</{tag}>")
}

/// A third of the files is well-formed, and a third only in its outer parts.
fn text_of(bytes: &[u8]) -> String {
    let random = || -> String { bytes.iter().map(|byte| PARTS[usize::from(*byte) % PARTS.len()]).collect() };
    let inside = match bytes.first().map(|first| first % 3) {
        Some(0) => node(&mut bytes.iter().copied().skip(1), 4),
        Some(1) => format!("<Sequence>{}</Sequence>", random()),
        _ => return random(),
    };
    format!(
        r#"<root BTCPP_format="4"><BehaviorTree ID="a"><Sequence><Script code="x := 'a'; y := 'b'; n := 1"/>{inside}</Sequence>
        </BehaviorTree><BehaviorTree ID="b"><ScriptCondition code="x == y"/></BehaviorTree></root>"#
    )
}

fn load_and_tick(text: &str) {
    let Ok(library) = Library::load(&registry(), [("t.xml", text)]) else {
        return;
    };
    for id in library.ids().map(str::to_owned).collect::<Vec<_>>() {
        if let Ok(mut tree) = library.instantiate(&id, &[]) {
            let mut events = String::new();
            tree.tick_exactly_once(Duration::ZERO, &mut events);
            tree.tick_once(Duration::from_secs(1), &mut events);
            tree.halt(Duration::from_secs(2), &mut events);
        }
    }
}

/// The test draws an eighth of `all` cases, or all of them with `KITTIWAKE_SWEEP=all`, as `.ci/long sweeps` does.
pub(crate) fn cases(all: u32) -> ProptestConfig {
    let cases = if std::env::var("KITTIWAKE_SWEEP").is_ok_and(|it| it == "all") { all } else { all / 8 };
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(cases(200_000))]

    #[test]
    fn loading_any_file_ends_without_panic_and_in_bounded_memory(bytes in vec(any::<u8>(), 0..=48)) {
        let text = text_of(&bytes);
        let most = peak(|| load_and_tick(&text));
        prop_assert!(most < 1 << 20, "{most} bytes for\n{text}");
    }
}

proptest! {
    #![proptest_config(cases(100_000))]

    #[test]
    fn bytes_that_are_not_a_tree_file_are_refused(bytes in vec(any::<u8>(), 0..=256)) {
        let text = String::from_utf8_lossy(&bytes);
        prop_assert!(peak(|| load_and_tick(&text)) < 1 << 20);
    }
}
