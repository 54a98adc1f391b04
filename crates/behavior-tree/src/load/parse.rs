//! From text to [`Document`].

use roxmltree::{Node, ParsingOptions};

use super::mistake::Mistake;
use super::mistakes::Mistakes;
use crate::xml::element::{Attribute, Document, Element, Place};

/// Deeper files are refused, as BehaviorTree.CPP refuses them: every tick and every pass of the loader recurses.
pub(super) const MAX_DEPTH: usize = 256;

/// More elements than this in one file are refused, so that a hostile file cannot fill the memory.
const MAX_ELEMENTS: u32 = 1_000_000;

/// Reads one file.
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
    let reader = Reader { file };
    let root = xml.root_element();
    let tag = root.tag_name().name();
    if tag != "root" {
        mistakes.add(reader.place(root), Mistake::NoRoot { found: tag.to_owned() });
        return document;
    }
    match root.attribute("BTCPP_format") {
        Some("4") => {}
        found => mistakes.add(reader.place(root), Mistake::Format { found: found.map(str::to_owned) }),
    }
    document.main_tree = reader.attributes(root).into_iter().find(|it| it.name == "main_tree_to_execute");
    for child in root.children().filter(Node::is_element) {
        match child.tag_name().name() {
            "BehaviorTree" => document.trees.push(reader.element(child, 0, mistakes)),
            "TreeNodesModel" => {
                let models = child.children().filter(Node::is_element);
                document.models.extend(models.map(|model| reader.element(model, 0, mistakes)));
            }
            "include" => document.includes.push(reader.element(child, 0, mistakes)),
            tag => mistakes.add(reader.place(child), Mistake::StrayElement { tag: tag.to_owned() }),
        }
    }
    document
}

/// Reads the elements of one file.
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
                mistakes.add(self.place(child), Mistake::TooDeep { limit: MAX_DEPTH });
                break;
            }
        }
        let (tag, attributes) = (node.tag_name().name().to_owned(), self.attributes(node));
        Element { tag, attributes, children, text, at: self.place(node) }
    }

    fn attributes(&self, node: Node<'_, '_>) -> Vec<Attribute> {
        node.attributes()
            .map(|attribute| Attribute {
                name: attribute.name().to_owned(),
                value: attribute.value().to_owned(),
                at: Place { file: self.file, offset: attribute.range().start as u32 },
            })
            .collect()
    }

    fn place(&self, node: Node<'_, '_>) -> Place {
        Place { file: self.file, offset: node.range().start as u32 }
    }
}

/// The parser's message without the position, which is reported anyway.
fn reason(error: &roxmltree::Error) -> String {
    let text = error.to_string();
    text.split_once(" at ").map_or(text.as_str(), |(reason, _)| reason).to_owned()
}
