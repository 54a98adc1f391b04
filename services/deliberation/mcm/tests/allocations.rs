//! What a wake costs: memory, and bytes on the link.

use crate::stories::rig::{Rig, plan, shipped_table, step};
use crate::stories::under_way;
use counting_allocator::allocations;
use domain::skill::Goal;
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1::FlightMode::Takeoff;

/// The tree is published at the reporting rate, twice a second, not with each of the hundred ticks a second.
#[test]
fn the_tree_costs_memory_when_it_is_reported_and_not_when_it_is_ticked() {
    let mut rig = Rig::new();
    rig.plan(plan(&[step(1, Goal::Takeoff { climb_m: 10.0 }, &[])]));
    rig.execute();
    rig.vehicle(true, Takeoff, (0.0, 0.0, 5.0));
    // At the time of a report; the next one is due half a second later.
    rig.wait(0.5);
    let between = allocations(|| rig.wait(0.4));
    assert_eq!(between, 8, "four times two events, each with the vehicle's name");
    let nodes = rig.tree.nodes.len() as u64;
    let reported = allocations(|| rig.wait(0.1));
    println!("a report of {nodes} nodes: {reported} allocations");
    assert!(nodes < 40 && reported < 250, "{reported} allocations for {nodes} nodes");
}

/// The link drops what is larger, without a word.
#[test]
fn the_tree_fits_the_shipped_link_whatever_is_answered() {
    let link = include_str!("../../../../config/zenoh/link.toml");
    let limit = link.lines().find_map(|it| it.strip_prefix("largest_message_bytes = ")).unwrap();
    let (_, table) = shipped_table();
    let sizes = table.rows().iter().map(|row| {
        let (mut rig, _) = under_way();
        rig.flag(&row.flag, true);
        rig.wait(1.0);
        Message::from(rig.tree.clone()).encode().len()
    });
    let largest = sizes.max().unwrap();
    println!("the largest tree takes {largest} bytes");
    assert!(largest < limit.parse().unwrap(), "{largest} bytes, {limit} pass");
}

#[test]
fn a_wake_with_nothing_new_allocates_nothing() {
    let mut rig = Rig::new();
    rig.plan(plan(&[step(1, Goal::Takeoff { climb_m: 10.0 }, &[])]));
    rig.execute();
    let say = |rig: &mut Rig| rig.vehicle(true, Takeoff, (0.0, 0.0, 5.0));
    say(&mut rig);
    // The only ones are the vehicle's name in two events, which the test makes each time.
    assert_eq!(allocations(|| say(&mut rig)), 2);
}
