//! The tree as an operator sees it: every node in preorder, those of held trees below their leaf.

use behavior_tree::Tree;
use kittiwake_proto::v1;

use crate::world::World;

/// The tree with its statuses and the reasons of failures.
pub(crate) fn snapshot(tree: &Tree<World>) -> v1::TreeSnapshot {
    let mut nodes = Vec::with_capacity(tree.len());
    append(tree, 0, &mut nodes);
    v1::TreeSnapshot { nodes }
}

fn append(tree: &Tree<World>, depth: u32, nodes: &mut Vec<v1::TreeNode>) {
    let mut depths: Vec<u32> = Vec::with_capacity(tree.len());
    for view in tree.nodes() {
        let depth = view.parent.map_or(depth, |parent| depths[parent.index()] + 1);
        depths.push(depth);
        nodes.push(v1::TreeNode {
            depth,
            kind: view.tag.to_owned(),
            name: view.name.to_owned(),
            status: view.status.word().to_uppercase(),
            reason: view.why.map(|it| it.cause.to_string()).unwrap_or_default(),
        });
        if let Some(held) = tree.held_by(view.id) {
            append(held, depth + 1, nodes);
        }
    }
}
