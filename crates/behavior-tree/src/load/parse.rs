//! From text to the elements that a library is made of.

use roxmltree::{Document as Xml, ParsingOptions};

use super::mistake::Mistake;
use super::mistakes::Mistakes;
use crate::xml::element::Document;
use crate::xml::source::{SourceAttribute, SourceElement};

/// Deeper files are refused, as BehaviorTree.CPP refuses them: every tick and every pass of the loader recurses.
pub(super) const MAX_DEPTH: usize = 256;

/// More elements than this in one file are refused, so that a hostile file cannot fill the memory.
const MAX_ELEMENTS: u32 = 1_000_000;

/// What is written in one file.
#[derive(Default)]
pub(crate) struct Contents<'x> {
    pub(super) main_tree: Option<SourceAttribute<'x>>,
    pub(super) includes: Vec<SourceElement<'x>>,
    /// The `BehaviorTree` elements.
    pub(super) trees: Vec<SourceElement<'x>>,
    /// The children of `TreeNodesModel`.
    pub(super) models: Vec<SourceElement<'x>>,
}

/// A file as data. What is wrong with the file is left out.
pub(crate) fn document(text: &str) -> Document {
    let mut mistakes = Mistakes::new([].into());
    let Some(xml) = parse(0, text, &mut mistakes) else {
        return Document::new();
    };
    let contents = read(0, &xml, &mut mistakes);
    let copy = |elements: Vec<SourceElement<'_>>| elements.into_iter().map(SourceElement::to_element).collect();
    Document {
        main_tree: contents.main_tree.map(|main| main.value.to_owned()),
        includes: copy(contents.includes),
        trees: copy(contents.trees),
        models: copy(contents.models),
    }
}

/// Parses one file. `None` if it is not XML.
pub(crate) fn parse<'x>(file: u32, text: &'x str, mistakes: &mut Mistakes) -> Option<Xml<'x>> {
    let options = ParsingOptions { nodes_limit: MAX_ELEMENTS, ..ParsingOptions::default() };
    match Xml::parse_with_options(text, options) {
        Ok(xml) => Some(xml),
        Err(error) => {
            let position = error.pos();
            mistakes.add_at_line(file, position.row, position.col, Mistake::NotXml { reason: reason(&error) });
            None
        }
    }
}

/// Finds the parts of a parsed file.
pub(crate) fn read<'x>(file: u32, xml: &'x Xml<'x>, mistakes: &mut Mistakes) -> Contents<'x> {
    let mut contents = Contents::default();
    let root = SourceElement::new(xml.root_element(), file);
    if root.tag() != "root" {
        mistakes.add(root.at(), Mistake::NoRoot { found: root.tag().to_owned() });
        return contents;
    }
    match root.get("BTCPP_format") {
        Some("4") => {}
        found => mistakes.add(root.at(), Mistake::Format { found: found.map(str::to_owned) }),
    }
    contents.main_tree = root.find("main_tree_to_execute");
    for child in root.children() {
        let parts = match child.tag() {
            "BehaviorTree" => &mut contents.trees,
            "include" => &mut contents.includes,
            "TreeNodesModel" => {
                let models = child.children().inspect(|model| check_depth(*model, 0, mistakes));
                contents.models.extend(models);
                continue;
            }
            tag => {
                mistakes.add(child.at(), Mistake::StrayElement { tag: tag.to_owned() });
                continue;
            }
        };
        check_depth(child, 0, mistakes);
        parts.push(child);
    }
    contents
}

fn check_depth(element: SourceElement<'_>, depth: usize, mistakes: &mut Mistakes) {
    for child in element.children() {
        if depth == MAX_DEPTH {
            return mistakes.add(child.at(), Mistake::TooDeep { limit: MAX_DEPTH });
        }
        check_depth(child, depth + 1, mistakes);
    }
}

/// The parser's message without the position, which is reported anyway.
fn reason(error: &roxmltree::Error) -> String {
    let text = error.to_string();
    text.split_once(" at ").map_or(text.as_str(), |(reason, _)| reason).to_owned()
}
