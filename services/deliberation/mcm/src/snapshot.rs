//! The tree for operators: every node in preorder, those of held trees below their leaf.
//!
//! Made at the reporting rate only: it allocates for every node.

use std::time::Duration;

use behavior_tree::Tree;
use kittiwake_proto::v1;

/// The tree with its statuses and the reasons of failures; `now` on the clock of its ticks.
pub(crate) fn snapshot<World>(tree: &Tree<World>, now: Duration) -> v1::TreeSnapshot {
    let mut nodes = Vec::with_capacity(tree.len());
    append(tree, 0, now, &mut nodes);
    v1::TreeSnapshot { nodes }
}

fn append<World>(tree: &Tree<World>, depth: u32, now: Duration, nodes: &mut Vec<v1::TreeNode>) {
    // The index of each node of this tree, so that its children find its depth: held trees lie in between.
    let mut places: Vec<usize> = Vec::with_capacity(tree.len());
    for view in tree.nodes() {
        let depth = view.parent.map_or(depth, |parent| nodes[places[parent.index()]].depth + 1);
        places.push(nodes.len());
        nodes.push(v1::TreeNode {
            depth,
            kind: view.tag.to_owned(),
            name: view.name.to_owned(),
            status: view.status.word().to_uppercase(),
            reason: view.why.map(|it| it.cause.to_string()).unwrap_or_default(),
            failed_ago_s: view.why.map(|it| now.saturating_sub(it.at).as_secs_f64()),
            uid: view.id.index() as u32 + 1,
        });
        if let Some(held) = tree.held_by(view.id) {
            append(held, depth + 1, now, nodes);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use behavior_tree::{Leaf, LeafResult, Library, Ports, Registry, Status};

    /// Holds a tree of its own, as the executor does.
    struct Holder(Tree<()>);

    impl Leaf<()> for Holder {
        fn tick(&mut self, world: &mut (), ports: &mut Ports<'_>) -> LeafResult {
            Ok(ports.tick_tree(&mut self.0, world))
        }

        fn subtree(&self) -> Option<&Tree<()>> {
            Some(&self.0)
        }
    }

    fn load(registry: &Registry<()>, trees: &str) -> Library<()> {
        let xml = format!(r#"<root BTCPP_format="4">{trees}</root>"#);
        Library::load(registry, [("test.xml", xml)]).unwrap_or_else(|errors| panic!("{errors}"))
    }

    #[test]
    fn depths_count_through_included_and_held_trees_and_numbers_are_those_of_groot2() {
        let held = r#"<BehaviorTree ID="held"><Sequence name="inside"><Sleep msec="9000"/></Sequence></BehaviorTree>"#;
        let held = load(&Registry::new(), held);
        let mut registry = Registry::new();
        registry.action("Holder", [], move |_| {
            Ok(Holder(held.instantiate("held", &[]).unwrap_or_else(|error| panic!("{error}"))))
        });
        let library = load(
            &registry,
            r#"<BehaviorTree ID="main"><Fallback name="top"><SubTree ID="part" name="included"/><Holder name="leaf"/>
                 <AlwaysSuccess name="last"/></Fallback></BehaviorTree>
               <BehaviorTree ID="part"><Sequence name="of the part"><ScriptCondition name="never" code="1 > 2"/>
                 <AlwaysSuccess name="not reached"/></Sequence></BehaviorTree>"#,
        );
        let mut tree = library.instantiate("main", &[]).unwrap_or_else(|error| panic!("{error}"));
        let begun = Duration::from_secs(10);
        assert_eq!(tree.tick_once(begun, &mut ()), Status::Running);
        let lines: Vec<String> = snapshot(&tree, begun + Duration::from_secs(2))
            .nodes
            .iter()
            .map(|it| format!("{}{} {} {}", "  ".repeat(it.depth as usize), it.uid, it.name, it.status))
            .collect();
        let expected = [
            "1 top RUNNING",
            "  2 included FAILURE",
            "    3 of the part IDLE",
            "      4 never IDLE",
            "      5 not reached IDLE",
            "  6 leaf RUNNING",
            "    1 inside RUNNING",
            "      2 Sleep RUNNING",
            "  7 last IDLE",
        ];
        assert_eq!(lines, expected);
        let never = &snapshot(&tree, begun + Duration::from_secs(2)).nodes[3];
        assert_eq!((never.reason.as_str(), never.failed_ago_s), ("`1 > 2` is false (compared 1 with 2)", Some(2.0)));
        let xml = tree.to_document().to_xml();
        assert!(xml.contains(r#"name="last" _uid="7""#), "{xml}");
    }
}
