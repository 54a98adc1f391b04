//! A tree as a picture, by way of Mermaid, which web pages and Markdown viewers draw.

use std::fmt::Write;

use super::ROOT;
use crate::tree::{NodeId, Tree};

const HEAD: &str = "flowchart TD
  classDef idle fill:#eeeeee,stroke:#999999
  classDef running fill:#ffd966,stroke:#997300
  classDef success fill:#93c47d,stroke:#3d6b28
  classDef failure fill:#e06666,stroke:#7a1f1f
";

impl<Ctx> Tree<Ctx> {
    /// The tree as a Mermaid flow chart, running nodes and finished ones in colour.
    pub fn to_mermaid(&self) -> String {
        let mut out = String::from(HEAD);
        self.write_mermaid(ROOT, "n", &mut out);
        out
    }

    fn write_mermaid(&self, node: NodeId, prefix: &str, out: &mut String) {
        let Some(view) = self.node(node) else {
            return;
        };
        let (index, status) = (node.index(), view.status.word());
        let label = escaped(&view.title());
        // Writing to a string cannot fail.
        let _ = writeln!(out, "  {prefix}{index}[\"{label}\"]:::{status}");
        for child in self.children(node) {
            let _ = writeln!(out, "  {prefix}{index} --> {prefix}{}", child.index());
            self.write_mermaid(child, prefix, out);
        }
        if let Some(held) = self.held_by(node) {
            let inner = format!("{prefix}{index}_");
            let _ = writeln!(out, "  {prefix}{index} -.-> {inner}0");
            held.write_mermaid(ROOT, &inner, out);
        }
    }
}

/// Mermaid knows HTML's entities, and takes a few signs for its own.
fn escaped(text: &str) -> String {
    text.replace('#', "#35;").replace('"', "#quot;").replace('<', "#lt;").replace('>', "#gt;").replace('\n', " ")
}
