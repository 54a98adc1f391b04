//! Observing a tree: as text, its nodes, the record of changes, the log for Groot2.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use behavior_tree::{BtlogWriter, NodeId, NodeStatus, Status, Tree};

use crate::stories::reference;
use crate::stories::support::{Events, file, registry, tree_of};

fn example() -> Tree<Events> {
    let root = r#"<Fallback name="top"><ScriptCondition name="enough &quot;fuel&quot;" code="fuel >= 20"/>
        <SubTree ID="Land" name="landing" where="here"/></Fallback>"#;
    let land =
        r#"<BehaviorTree ID="Land"><Sequence><L id="{where}" s="S"/><L id="2" s="R"/></Sequence></BehaviorTree>"#;
    let mut registry = registry();
    registry.global::<f64>("fuel");
    // The leaf reads its id as a constant only, so this key is only shown.
    let mut tree = tree_of(&registry, &file(root, land));
    tree.set("fuel", 12.5).expect("a global");
    assert_eq!(tree.tick_once(Duration::from_millis(3), &mut String::new()), Status::Running);
    tree
}

#[test]
fn a_tree_as_text() {
    let expected = "\
[running] Fallback \"top\"
[failure]   ScriptCondition \"enough \"fuel\"\" -- failed at 3ms: `fuel >= 20` is false (compared 12.5 with 20)
[running]   Land \"landing\"
[running]     Sequence
[success]       L
[running]       L
";
    assert_eq!(example().to_text(), expected);
}

#[test]
fn the_tree_a_leaf_holds_is_shown_below_it() {
    let (tree, _) = reference::flying(true);
    let text = tree.to_text();
    assert!(text.contains("[running]             Executor\n[running]               Parallel\n"), "{text}");
}

#[test]
fn nodes_know_their_place() {
    let tree = example();
    let landing = tree.find("landing").expect("the node");
    assert_eq!(tree.node(landing).expect("the node is in the tree").parent.map(NodeId::index), Some(0));
    let inside: Vec<_> = tree.children(landing).filter_map(|child| tree.node(child)).collect();
    assert_eq!((inside[0].tag, inside[0].path), ("Sequence", "landing"));
    assert_eq!(inside[0].parent, Some(landing), "an included tree is below the node that includes it");
    for child in tree.nodes() {
        let listed = child.parent.is_none_or(|parent| tree.children(parent).any(|it| it == child.id));
        assert!(listed, "{} is a child of its parent", child.name);
    }
    assert_eq!(tree.nodes().count(), 6);
}

#[test]
fn changes_are_recorded_with_their_times() {
    let mut tree = tree_of(&registry(), &file(r#"<Inverter><L id="1" s="RF"/></Inverter>"#, ""));
    tree.record_changes(100, || 0);
    tree.tick_once(Duration::from_millis(1), &mut String::new());
    tree.tick_once(Duration::from_millis(2), &mut String::new());
    let mut changes = Vec::new();
    let lost = tree.take_changes(|it| changes.push(format!("{:?} {} {}-{}", it.at, it.node.index(), it.from, it.to)));
    assert_eq!(lost, 0);
    let expected = [
        "1ms 0 idle-running",
        "1ms 1 idle-running",
        "2ms 1 running-failure",
        "2ms 1 failure-idle",
        "2ms 0 running-success",
        "2ms 0 success-idle",
    ];
    assert_eq!(changes, expected);
    assert_eq!(tree.take_changes(|_| panic!("all were taken")), 0);
}

#[test]
fn a_change_carries_the_stamp_of_its_moment() {
    static CLOCK: AtomicU64 = AtomicU64::new(10);
    let mut tree = tree_of(&registry(), &file(r#"<Inverter><L id="1" s="R"/></Inverter>"#, ""));
    tree.record_changes(100, || CLOCK.fetch_add(1, Ordering::Relaxed));
    tree.tick_once(Duration::ZERO, &mut String::new());
    tree.halt(Duration::ZERO, &mut String::new());
    let mut stamps = Vec::new();
    tree.take_changes(|change| stamps.push((change.stamp, change.node.index(), change.to)));
    let (running, idle) = (NodeStatus::Running, NodeStatus::Idle);
    assert_eq!(stamps, [(10, 0, running), (11, 1, running), (12, 1, idle), (13, 0, idle)]);
}

#[test]
fn changes_that_are_not_taken_in_time_are_counted() {
    let mut tree = tree_of(&registry(), &file(r#"<L id="1" s="S"/>"#, ""));
    tree.record_changes(4, || 0);
    for _ in 0..10 {
        tree.tick_once(Duration::ZERO, &mut String::new());
    }
    let mut taken = 0;
    assert_eq!(tree.take_changes(|_| taken += 1), 16);
    assert_eq!(taken, 4);
}

#[test]
fn a_log_has_the_tree_and_nine_bytes_for_each_change() {
    let mut tree = example();
    tree.halt(Duration::from_secs(1), &mut String::new());
    tree.record_changes(100, || 0);
    let mut file = Vec::new();
    let mut log =
        BtlogWriter::new(&mut file, &tree, Duration::from_micros(77), Duration::from_secs(1)).expect("memory");
    tree.tick_once(Duration::from_millis(1002), &mut String::new());
    assert_eq!(log.write_changes(&mut tree).expect("memory"), 0);

    let (magic, rest) = file.split_at(18);
    assert_eq!((magic, rest[0]), (b"BTCPP4-FileLogger2".as_slice(), 1));
    let length = u32::from_le_bytes(rest[1..5].try_into().expect("four bytes")) as usize;
    let (xml, rest) = rest[5..].split_at(length);
    let xml = std::str::from_utf8(xml).expect("text");
    assert!(xml.contains(r#"<SubTree ID="Land" _fullpath="landing" _uid="3" where="here"/>"#), "{xml}");
    assert!(xml.contains(r#"<BehaviorTree ID="Land" _fullpath="landing">"#), "{xml}");
    assert!(xml.contains(r#"<L name="L" _uid="6" id="2" s="R"/>"#), "{xml}");
    assert_eq!(rest[..8], 77i64.to_le_bytes());
    let records: Vec<_> = rest[8..].chunks(9).collect();
    // The root runs first, two milliseconds after the start.
    assert_eq!(records[0], [0xd0, 0x07, 0, 0, 0, 0, 1, 0, 1]);
    let last_of_six = records.iter().rev().find(|record| record[6] == 6).expect("a change of node 6");
    assert_eq!(last_of_six[8], NodeStatus::Running as u8);
}
