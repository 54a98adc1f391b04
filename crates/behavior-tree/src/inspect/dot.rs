//! A tree as a picture, by way of Graphviz.

use std::fmt::Write;

use super::ROOT;
use crate::status::NodeStatus;
use crate::tree::{NodeId, Tree};

impl<Ctx> Tree<Ctx> {
    /// The tree in Graphviz' language, running nodes and finished ones in colour.
    pub fn to_dot(&self) -> String {
        let mut out = String::from("digraph tree {\n  ordering=out;\n  node [shape=box, style=filled];\n");
        self.write_dot(ROOT, "n", &mut out);
        out.push_str("}\n");
        out
    }

    fn write_dot(&self, node: NodeId, prefix: &str, out: &mut String) {
        let Some(view) = self.node(node) else {
            return;
        };
        let (index, colour) = (node.index(), colour(view.status));
        let label = view.title().replace('\\', "\\\\").replace('"', "\\\"");
        // Writing to a string cannot fail.
        let _ = writeln!(out, "  {prefix}{index} [label=\"{label}\", fillcolor=\"{colour}\"];");
        for child in self.children(node) {
            let _ = writeln!(out, "  {prefix}{index} -> {prefix}{};", child.index());
            self.write_dot(child, prefix, out);
        }
        if let Some(held) = self.held_by(node) {
            let inner = format!("{prefix}{index}_");
            let _ = writeln!(out, "  {prefix}{index} -> {inner}0 [style=dashed];");
            held.write_dot(ROOT, &inner, out);
        }
    }
}

/// Readable in black on it, and apart from one another for most who do not see red and green apart.
fn colour(status: NodeStatus) -> &'static str {
    match status {
        NodeStatus::Idle => "#eeeeee",
        NodeStatus::Running => "#ffd966",
        NodeStatus::Success => "#93c47d",
        NodeStatus::Failure => "#e06666",
    }
}
