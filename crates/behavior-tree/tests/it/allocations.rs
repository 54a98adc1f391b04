//! The memory that ticks and steps take.

use std::time::Duration;

use behavior_tree::{Library, NodeStatus, Status};

use crate::stories::reference::{World, conditions_xml, flying, goal, registry, step_xml, template};
use counting_allocator::{allocations, peak};

#[test]
fn a_steady_tick_allocates_nothing() {
    let (mut tree, mut world) = flying(false);
    tree.record_changes(256, || 7);
    let mut snapshot = vec![NodeStatus::Idle; tree.len()];
    let mut recorded = 0;
    let counted = allocations(|| {
        for number in 0..1000 {
            assert_eq!(tree.tick_once(Duration::from_millis(number), &mut world), Status::Running);
            snapshot.copy_from_slice(tree.statuses());
            tree.take_changes(|change| recorded += change.stamp);
        }
    });
    assert_eq!(counted, 0);
    assert!(7_000 <= recorded, "every tick changes a status: {recorded}");
}

#[test]
fn a_condition_that_fails_at_every_tick_with_its_reason_allocates_nothing() {
    let root = r#"<Sequence><Script code="level := 17.5"/>
        <ReactiveFallback><ScriptCondition code="20 &lt; level"/><L id="1" s="R"/></ReactiveFallback></Sequence>"#;
    let mut tree = crate::stories::support::tree_of(
        &crate::stories::support::registry(),
        &crate::stories::support::file(root, ""),
    );
    let mut events = String::with_capacity(1 << 16);
    tree.tick_once(Duration::ZERO, &mut events);
    let counted = allocations(|| {
        for _ in 0..1000 {
            tree.tick_once(Duration::ZERO, &mut events);
        }
    });
    assert_eq!(counted, 0);
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

#[test]
fn loading_takes_memory_in_proportion_to_the_file() {
    let registry = registry();
    let costs = |nodes: usize| {
        let xml = conditions_xml(nodes);
        let load = || drop(Library::load(&registry, [("wide.xml", xml.as_str())]).map_err(|errors| panic!("{errors}")));
        (allocations(load) as f64, peak(load) as f64)
    };
    let (small, large) = (costs(1_000), costs(10_000));
    // Names are kept in one piece, and the file is read in place: nothing is allocated for a node by itself.
    assert!(large.0 < 200.0, "{} allocations", large.0);
    // Vectors grow by doubling, so the peak may be twice as high.
    assert!(large.1 < 20.0 * small.1, "{} and {} bytes", small.1, large.1);
}
