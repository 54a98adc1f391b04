//! From text to [`Document`].

use roxmltree::{Node, ParsingOptions};

use super::element::{Attribute, Document, Element, Place};
use crate::load::mistake::Mistake;
use crate::load::mistakes::Mistakes;

/// Deeper files are refused, as BehaviorTree.CPP does: every tick and every pass here recurses.
pub(crate) const MAX_DEPTH: usize = 256;

/// More elements than this in one file are refused, so that a hostile file cannot fill the memory.
const MAX_ELEMENTS: u32 = 1_000_000;

/// Reads one file; what is wrong with it goes to `mistakes`.
pub(crate) fn parse(file: u32, text: &str, mistakes: &mut Mistakes) -> Document {
    let mut document = Document::new();
    let options = ParsingOptions { nodes_limit: MAX_ELEMENTS, ..ParsingOptions::default() };
    let xml = match roxmltree::Document::parse_with_options(text, options) {
        Ok(xml) => xml,
        Err(error) => {
            let position = error.pos();
            mistakes.add_at_line(file, position.row, position.col, Mistake::NotXml { reason: reason(&error) });
            return document;
        }
    };
    let root = xml.root_element();
    if root.tag_name().name() != "root" {
        mistakes.add(place(file, root), Mistake::NoRoot { found: root.tag_name().name().to_owned() });
        return document;
    }
    match root.attribute("BTCPP_format") {
        Some("4") => {}
        found => mistakes.add(place(file, root), Mistake::Format { found: found.map(str::to_owned) }),
    }
    let reader = Reader { file };
    document.main_tree = reader.attributes(root).into_iter().find(|it| it.name == "main_tree_to_execute");
    for child in root.children().filter(Node::is_element) {
        match child.tag_name().name() {
            "BehaviorTree" => document.trees.push(reader.element(child, 0, mistakes)),
            "TreeNodesModel" => {
                let models = child.children().filter(Node::is_element);
                document.models.extend(models.map(|model| reader.element(model, 0, mistakes)));
            }
            "include" => document.includes.push(reader.element(child, 0, mistakes)),
            tag => mistakes.add(place(file, child), Mistake::StrayElement { tag: tag.to_owned() }),
        }
    }
    document
}

struct Reader {
    file: u32,
}

impl Reader {
    fn element(&self, node: Node<'_, '_>, depth: usize, mistakes: &mut Mistakes) -> Element {
        let mut children = Vec::new();
        let mut text = String::new();
        for child in node.children() {
            if child.is_text() {
                text.push_str(child.text().unwrap_or_default().trim());
            } else if child.is_element() && depth < MAX_DEPTH {
                children.push(self.element(child, depth + 1, mistakes));
            } else if child.is_element() {
                mistakes.add(place(self.file, child), Mistake::TooDeep);
                break;
            }
        }
        let (tag, attributes) = (node.tag_name().name().to_owned(), self.attributes(node));
        Element { tag, attributes, children, text, at: place(self.file, node) }
    }

    fn attributes(&self, node: Node<'_, '_>) -> Vec<Attribute> {
        node.attributes()
            .map(|it| Attribute {
                name: it.name().to_owned(),
                value: it.value().to_owned(),
                at: Place { file: self.file, offset: it.range().start as u32 },
            })
            .collect()
    }
}

fn place(file: u32, node: Node<'_, '_>) -> Place {
    Place { file, offset: node.range().start as u32 }
}

/// The parser's message without the position, which is given anyway.
fn reason(error: &roxmltree::Error) -> String {
    let text = error.to_string();
    text.split_once(" at ").map_or(text.as_str(), |(reason, _)| reason).to_owned()
}
