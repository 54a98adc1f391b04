//! What a tick and a step cost in memory.

use std::time::Duration;

use behavior_tree::{NodeStatus, Status};

use crate::counting::allocations;
use crate::reference::{World, flying, goal, step_xml, template};

#[test]
fn a_steady_tick_allocates_nothing() {
    let (mut tree, mut world) = flying(false);
    tree.record_changes(256);
    let mut snapshot = vec![NodeStatus::Idle; tree.len()];
    let counted = allocations(|| {
        for number in 0..1000 {
            assert_eq!(tree.tick_once(Duration::from_millis(number), &mut world), Status::Running);
            tree.snapshot(&mut snapshot);
            tree.take_changes(|_| {});
        }
    });
    assert_eq!(counted, 0);
}

#[test]
fn a_condition_that_fails_at_every_tick_with_its_reason_allocates_nothing() {
    let root = r#"<Sequence><Script code="level := 17.5"/>
        <ReactiveFallback><ScriptCondition code="20 &lt; level"/><L id="1" s="R"/></ReactiveFallback></Sequence>"#;
    let mut tree = crate::support::tree_of(&crate::support::registry(), &crate::support::file(root, ""));
    let mut events = String::with_capacity(1 << 16);
    tree.tick_once(Duration::ZERO, &mut events);
    assert_eq!(allocations(|| (0..1000).for_each(|_| drop(tree.tick_once(Duration::ZERO, &mut events)))), 0);
}

#[test]
fn a_step_is_built_from_its_template_with_few_allocations() {
    for (with_requests, limit) in [(false, 8), (true, 11)] {
        let template = template(&step_xml(with_requests), "Step");
        let mut world = World::default();
        let parameters = [("goal", goal())];
        let counted = allocations(|| {
            let mut step = template.instantiate(&parameters).expect("it fits");
            step.tick_once(Duration::ZERO, &mut world);
        });
        assert!(counted <= limit, "{counted} allocations");
    }
}
