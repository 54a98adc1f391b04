//! A tree as JSON, for programs and web pages.

use std::fmt::Write;

use super::ROOT;
use crate::tree::{NodeId, Tree};
use crate::value::Value;

impl<Ctx> Tree<Ctx> {
    /// The nodes as nested objects, and the blackboard.
    ///
    /// ```json
    /// {"tree": "Main",
    ///  "root": {"index": 0, "tag": "Sequence", "name": "Sequence", "status": "running", "children": []},
    ///  "blackboard": {"level": 17.5}}
    /// ```
    ///
    /// A node that said why it failed has `"why": {"at_ns", "condition", "value", "threshold"}`, a leaf that holds a tree
    /// has it as `"holds"`.
    pub fn to_json(&self) -> String {
        let mut out = String::new();
        self.write_json(&mut out);
        out
    }

    fn write_json(&self, out: &mut String) {
        // Writing to a string cannot fail.
        let _ = write!(out, "{{\"tree\":{},\"root\":", quoted(self.id()));
        self.write_json_node(ROOT, out);
        out.push_str(",\"blackboard\":{");
        let mut separator = "";
        for (key, value) in self.blackboard() {
            let _ = write!(out, "{separator}{}:{}", quoted(key), optional(value));
            separator = ",";
        }
        out.push_str("}}");
    }

    fn write_json_node(&self, node: NodeId, out: &mut String) {
        let Some(view) = self.node(node) else {
            return out.push_str("null");
        };
        let (index, tag, name, status) = (node.index(), quoted(view.tag), quoted(view.name), view.status);
        let _ = write!(out, "{{\"index\":{index},\"tag\":{tag},\"name\":{name},\"status\":\"{status}\"");
        if let Some(record) = view.why {
            let (at, condition) = (record.at.as_nanos(), quoted(&record.cause.condition));
            let (value, threshold) = (optional(record.cause.value.as_ref()), optional(record.cause.threshold.as_ref()));
            let _ = write!(out, ",\"why\":{{\"at_ns\":{at},\"condition\":{condition}");
            let _ = write!(out, ",\"value\":{value},\"threshold\":{threshold}}}");
        }
        out.push_str(",\"children\":[");
        for (number, child) in self.children(node).enumerate() {
            out.push_str(if number == 0 { "" } else { "," });
            self.write_json_node(child, out);
        }
        out.push(']');
        if let Some(held) = self.held_by(node) {
            out.push_str(",\"holds\":");
            held.write_json(out);
        }
        out.push('}');
    }
}

fn optional(value: Option<&Value>) -> String {
    match value {
        None => "null".to_owned(),
        Some(Value::Bool(it)) => it.to_string(),
        Some(Value::Int(it)) => it.to_string(),
        Some(Value::Float(it)) if it.is_finite() => it.to_string(),
        Some(value) => quoted(&value.to_string()),
    }
}

fn quoted(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 2);
    out.push('"');
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            c if c.is_control() => {
                // Writing to a string cannot fail.
                let _ = write!(out, "\\u{:04x}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}
