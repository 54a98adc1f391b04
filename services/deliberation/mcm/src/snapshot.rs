//! The tree for operators: nodes in preorder, those of held trees below their leaf.
//!
//! Of nearly two thousand nodes a dozen run at a time, and the whole tree is too large for a narrow link. A branch in which every node is idle,
//! and none has a reason, is sent as its first node with the number of the others.

use std::time::Duration;

use behavior_tree::{NodeStatus, NodeView, Tree};
use kittiwake_proto::v1;

/// The tree with its statuses and the reasons of failures; `now` on the clock of its ticks.
pub(crate) fn snapshot<World>(tree: &Tree<World>, now: Duration) -> v1::TreeSnapshot {
    let mut nodes = Vec::new();
    append(tree, 0, now, &mut nodes);
    v1::TreeSnapshot { nodes }
}

/// A node with all nodes below it.
#[derive(Clone, Copy)]
struct Branch {
    nodes: u32,
    /// One of them is not idle, or has a reason.
    speaks: bool,
}

/// One for each node of `tree`, in preorder.
fn branches<World>(tree: &Tree<World>) -> Vec<Branch> {
    let own = |it: NodeView<'_>| {
        let mut branch = Branch { nodes: 1, speaks: it.status != NodeStatus::Idle || it.why.is_some() };
        if let Some(held) = tree.held_by(it.id).and_then(|held| branches(held).first().copied()) {
            branch.add(held);
        }
        branch
    };
    let mut branches: Vec<Branch> = tree.nodes().map(own).collect();
    let parents: Vec<_> = tree.nodes().map(|it| it.parent).collect();
    for (node, parent) in parents.iter().enumerate().rev() {
        if let Some(parent) = parent {
            let branch = branches[node];
            branches[parent.index()].add(branch);
        }
    }
    branches
}

impl Branch {
    fn add(&mut self, below: Branch) {
        self.nodes += below.nodes;
        self.speaks |= below.speaks;
    }
}

fn append<World>(tree: &Tree<World>, depth: u32, now: Duration, nodes: &mut Vec<v1::TreeNode>) {
    let branches = branches(tree);
    // The depth of each node of this tree.
    let mut depths: Vec<u32> = Vec::with_capacity(tree.len());
    for view in tree.nodes() {
        let depth = view.parent.map_or(depth, |parent| depths[parent.index()] + 1);
        depths.push(depth);
        if view.parent.is_some_and(|parent| !branches[parent.index()].speaks) {
            continue;
        }
        let Branch { nodes: all, speaks } = branches[view.id.index()];
        nodes.push(v1::TreeNode {
            depth,
            kind: view.tag.to_owned(),
            name: view.name.to_owned(),
            status: view.status.word().to_uppercase(),
            reason: view.why.map(|it| it.cause.to_string()).unwrap_or_default(),
            failed_ago_s: view.why.map(|it| now.saturating_sub(it.at).as_secs_f64()),
            uid: view.id.index() as u32 + 1,
            folded: if speaks { 0 } else { all - 1 },
        });
        if let Some(held) = tree.held_by(view.id).filter(|_| speaks) {
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
    fn what_says_something_is_sent_with_the_numbers_of_groot2_and_the_rest_is_counted() {
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
        #[track_caller]
        fn check(tree: &Tree<()>, now: Duration, expected: &[&str]) {
            let line = |it: &v1::TreeNode| {
                let folded = if it.folded == 0 { String::new() } else { format!(" +{}", it.folded) };
                format!("{}{} {} {}{folded}", "  ".repeat(it.depth as usize), it.uid, it.name, it.status)
            };
            assert_eq!(snapshot(tree, now).nodes.iter().map(line).collect::<Vec<_>>(), expected);
        }
        let idle = library.instantiate("main", &[]).unwrap_or_else(|error| panic!("{error}"));
        check(&idle, begun, &["1 top IDLE +8"]);
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
        check(&tree, begun + Duration::from_secs(2), &expected);
        let never = &snapshot(&tree, begun + Duration::from_secs(2)).nodes[3];
        assert_eq!((never.reason.as_str(), never.failed_ago_s), ("`1 > 2` is false (compared 1 with 2)", Some(2.0)));
        let xml = tree.to_document().to_xml();
        assert!(xml.contains(r#"name="last" _uid="7""#), "{xml}");
    }
}
