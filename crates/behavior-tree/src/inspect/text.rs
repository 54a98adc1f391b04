//! A tree as indented lines, for logs and terminals.

use std::fmt::Write;

use crate::machine::Tree;
use crate::node_id::NodeId;
use crate::status::NodeStatus;

impl<Ctx> Tree<Ctx> {
    /// One line for each node: its status, kind and name, and why it failed. The tree that a leaf holds is below the
    /// leaf.
    ///
    /// ```text
    /// [running] Sequence
    /// [success]   BatteryOk
    /// [running]   GoTo "to the turbine"
    /// ```
    pub fn to_text(&self) -> String {
        let mut out = String::new();
        self.write_text(NodeId::ROOT, 0, &mut out);
        out
    }

    fn write_text(&self, node: NodeId, depth: usize, out: &mut String) {
        let Some(view) = self.node(node) else {
            return;
        };
        let (status, indent, title) = (view.status.word(), "  ".repeat(depth), view.title());
        // Writing to a string cannot fail.
        let _ = write!(out, "[{status:^7}] {indent}{title}");
        if let (Some(record), NodeStatus::Failure | NodeStatus::Idle) = (view.why, view.status) {
            let _ = write!(out, " -- failed at {:?}: {}", record.at, record.cause);
        }
        out.push('\n');
        for child in self.children(node) {
            self.write_text(child, depth + 1, out);
        }
        if let Some(held) = self.held_by(node) {
            held.write_text(NodeId::ROOT, depth + 1, out);
        }
    }
}
