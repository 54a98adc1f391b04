//! Nodes that wait. Time is an argument, so nothing here waits.

use std::time::Duration;

use behavior_tree::{NextTick, Status};

use crate::stories::support::{check, file, registry, tree_of};

#[test]
fn a_timeout_halts_its_child_without_ticking_it() {
    let root = r#"<Timeout msec="5"><L id="1" s="R"/></Timeout>"#;
    check(root, "t4t1t", "s1 R[RR], r1 R[RR], h1 F[II]");
    check(r#"<Timeout msec="5"><L id="1" s="RS"/></Timeout>"#, "t4t0t", "s1 R[RR], r1 S[II], s1 R[RR]");
    check(r#"<Timeout msec="0"><L id="1" s="R"/></Timeout>"#, "t0t", "s1 R[RR], r1 R[RR]");
}

#[test]
fn a_halted_timeout_starts_from_zero() {
    check(r#"<Timeout msec="5"><L id="1" s="R"/></Timeout>"#, "t4ht4t", "s1 R[RR], h1 H[II], s1 R[RR], r1 R[RR]");
}

#[test]
fn a_delay_waits_before_every_start_of_its_child() {
    let root = r#"<Delay delay_msec="5"><L id="1" s="RS"/></Delay>"#;
    check(root, "t4t1tt", "R[RI], R[RI], s1 R[RR], r1 S[II]");
    check(root, "t5t1t1t", "R[RI], s1 R[RR], r1 S[II], R[RI]");
    check(r#"<Delay delay_msec="0"><L id="1" s="S"/></Delay>"#, "t", "s1 S[II]");
}

#[test]
fn a_sleep_succeeds_when_its_time_is_up() {
    check(r#"<Sleep msec="5"/>"#, "t4t1t", "R[R], R[R], S[I]");
    check(r#"<Sleep msec="0"/>"#, "t", "S[I]");
    check(r#"<Sequence><Sleep msec="5"/><L id="1" s="R"/></Sequence>"#, "t5tt", "R[RRI], s1 R[RSR], r1 R[RSR]");
}

#[test]
fn a_tree_knows_when_to_be_ticked_next() {
    let root = r#"<Parallel><Sleep msec="30"/><Timeout msec="20"><L id="1" s="R"/></Timeout></Parallel>"#;
    let mut tree = tree_of(&registry(), &file(root, ""));
    let mut events = String::new();
    assert_eq!(tree.next_tick(), NextTick::WhenWoken);
    tree.tick_once(Duration::from_secs(1), &mut events);
    assert_eq!(tree.next_tick(), NextTick::At(Duration::from_millis(1020)));
    assert_eq!(tree.tick_once(Duration::from_millis(1020), &mut events), Status::Failure);
    assert_eq!(tree.next_tick(), NextTick::At(Duration::from_millis(1030)));
    tree.halt(Duration::from_secs(2), &mut events);
    assert_eq!(tree.next_tick(), NextTick::WhenWoken);
}

#[test]
fn a_timeout_says_why_it_failed() {
    let mut tree = tree_of(&registry(), &file(r#"<Timeout name="limit" msec="5"><L id="1" s="R"/></Timeout>"#, ""));
    let mut events = String::new();
    tree.tick_once(Duration::ZERO, &mut events);
    tree.tick_once(Duration::from_millis(5), &mut events);
    let node = tree.find("limit").expect("the node");
    let record = tree.why(node).expect("a cause");
    assert_eq!(record.cause.to_string(), "not finished within 5 ms");
    assert_eq!(record.at, Duration::from_millis(5));
}
