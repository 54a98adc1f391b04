//! The elements of a tree file, read where they stand in its text.

use roxmltree::Node;

use super::element::Element;

/// A place in one of the loaded files, in bytes from the start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Place {
    pub(crate) file: u32,
    pub(crate) offset: u32,
}

/// An element of a file that is being loaded.
#[derive(Clone, Copy)]
pub(crate) struct SourceElement<'x> {
    node: Node<'x, 'x>,
    file: u32,
}

#[derive(Clone, Copy)]
pub(crate) struct SourceAttribute<'x> {
    pub(crate) name: &'x str,
    pub(crate) value: &'x str,
    pub(crate) at: Place,
}

impl<'x> SourceElement<'x> {
    /// `node` is an element of the file with the number `file`.
    pub(crate) fn new(node: Node<'x, 'x>, file: u32) -> Self {
        SourceElement { node, file }
    }

    pub(crate) fn tag(self) -> &'x str {
        self.node.tag_name().name()
    }

    pub(crate) fn at(self) -> Place {
        Place { file: self.file, offset: self.node.range().start as u32 }
    }

    pub(crate) fn attributes(self) -> impl Iterator<Item = SourceAttribute<'x>> {
        self.node.attributes().map(move |attribute| SourceAttribute {
            name: attribute.name(),
            value: attribute.value(),
            at: Place { file: self.file, offset: attribute.range().start as u32 },
        })
    }

    pub(crate) fn find(self, name: &str) -> Option<SourceAttribute<'x>> {
        self.attributes().find(|attribute| attribute.name == name)
    }

    /// The value of an attribute.
    pub(crate) fn get(self, name: &str) -> Option<&'x str> {
        self.find(name).map(|attribute| attribute.value)
    }

    pub(crate) fn children(self) -> impl Iterator<Item = SourceElement<'x>> {
        self.node.children().filter(Node::is_element).map(move |node| SourceElement { node, ..self })
    }

    /// All elements below, in the order of the file.
    pub(crate) fn descendants(self) -> impl Iterator<Item = SourceElement<'x>> {
        self.node.descendants().skip(1).filter(Node::is_element).map(move |node| SourceElement { node, ..self })
    }

    /// The text between the tags, without that of elements below.
    pub(crate) fn text(self) -> String {
        self.node.children().filter(Node::is_text).filter_map(|text| text.text()).map(str::trim).collect()
    }

    /// A copy with everything below it, which does not need the file.
    pub(crate) fn to_element(self) -> Element {
        let attributes = self.attributes().map(|attribute| (attribute.name.to_owned(), attribute.value.to_owned()));
        let (tag, attributes) = (self.tag().to_owned(), attributes.collect());
        Element {
            tag,
            attributes,
            children: self.children().map(SourceElement::to_element).collect(),
            text: self.text(),
        }
    }
}
