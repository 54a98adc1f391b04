//! From [`Document`] to text.

use std::fmt::Write;

use super::element::{Document, Element};

impl Document {
    /// The text of the file, in the form that Groot2 saves.
    pub fn to_xml(&self) -> String {
        let mut root = Element::new("root").attribute("BTCPP_format", "4");
        if let Some(main) = &self.main_tree {
            root = root.attribute("main_tree_to_execute", main);
        }
        root = root.children(self.includes.iter().cloned()).children(self.trees.iter().cloned());
        if !self.models.is_empty() {
            root = root.child(Element::new("TreeNodesModel").children(self.models.iter().cloned()));
        }
        format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{}", root.to_xml())
    }
}

impl Element {
    /// The text of the element, indented.
    pub fn to_xml(&self) -> String {
        let mut text = String::new();
        self.write(&mut text, 0);
        text
    }

    fn write(&self, out: &mut String, depth: usize) {
        let indent = "  ".repeat(depth);
        // Writing to a string cannot fail.
        let _ = write!(out, "{indent}<{}", self.tag);
        for (name, value) in &self.attributes {
            let _ = write!(out, " {name}=\"{}\"", escaped(value));
        }
        if self.children.is_empty() && self.text.is_empty() {
            out.push_str("/>\n");
        } else if self.children.is_empty() {
            let _ = writeln!(out, ">{}</{}>", escaped(&self.text), self.tag);
        } else {
            let _ = writeln!(out, ">{}", escaped(&self.text));
            for child in &self.children {
                child.write(out, depth + 1);
            }
            let _ = writeln!(out, "{indent}</{}>", self.tag);
        }
    }
}

/// Text as it may be written in an attribute or between tags.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' => out.push_str("&#10;"),
            '\t' => out.push_str("&#9;"),
            '\r' => out.push_str("&#13;"),
            _ => out.push(c),
        }
    }
    out
}
