//! Whatever is in a file, loading it ends soon, without a panic and without filling the memory.
//!
//! The expressions have a target of their own in `src/script/tests.rs`.

use std::time::Duration;

use behavior_tree::Library;

use crate::counting::peak;
use crate::support::registry;

/// What tree files are made of, and a few things they are not.
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

/// The first bytes choose parts, so that a good share of the files is nearly right.
fn text_of(bytes: &[u8]) -> String {
    let parts = bytes.iter().map(|byte| PARTS[usize::from(*byte) % PARTS.len()]);
    let inside: String = parts.collect();
    // Half of the files have their outer parts in order.
    match bytes.first() {
        Some(first) if first % 2 == 0 => format!(
            "<root BTCPP_format=\"4\"><BehaviorTree ID=\"a\"><Sequence>{inside}</Sequence></BehaviorTree>\
             <BehaviorTree ID=\"b\"><L id=\"{{x}}\" s=\"{{y}}\"/></BehaviorTree></root>"
        ),
        _ => inside,
    }
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

#[test]
fn loading_any_file_ends_without_panic_and_in_bounded_memory() {
    bolero::check!().with_iterations(100_000).with_max_len(48).with_type::<Vec<u8>>().for_each(|bytes| {
        let text = text_of(bytes);
        let most = peak(|| load_and_tick(&text));
        assert!(most < 1 << 20, "{most} bytes for\n{text}");
    });
}

#[test]
fn bytes_that_are_no_text_of_a_tree_are_refused() {
    bolero::check!().with_iterations(100_000).with_max_len(256).with_type::<Vec<u8>>().for_each(|bytes| {
        let text = String::from_utf8_lossy(bytes);
        assert!(peak(|| load_and_tick(&text)) < 1 << 20);
    });
}
