//! A tree file as data, read from text or built by a program.

/// An XML element of a tree file: a node, a tree, a model.
///
/// ```
/// use behavior_tree::{Document, Element};
///
/// let guard = Element::new("ReactiveSequence")
///     .child(Element::new("BatteryOk").attribute("min", "20"))
///     .child(Element::new("Fly"));
/// let xml = Document::new().tree("Main", guard).to_xml();
/// assert!(xml.contains(r#"<BatteryOk min="20"/>"#));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Element {
    pub(crate) tag: String,
    /// Names and values.
    pub(crate) attributes: Vec<(String, String)>,
    pub(crate) children: Vec<Element>,
    pub(crate) text: String,
}

impl Element {
    /// An element without attributes and children.
    pub fn new(tag: &str) -> Self {
        let (attributes, children, text) = (Vec::new(), Vec::new(), String::new());
        Element { tag: tag.to_owned(), attributes, children, text }
    }

    /// Adds an attribute.
    pub fn attribute(mut self, name: &str, value: &str) -> Self {
        self.attributes.push((name.to_owned(), value.to_owned()));
        self
    }

    /// Adds a child after the others.
    pub fn child(mut self, child: Element) -> Self {
        self.children.push(child);
        self
    }

    /// Adds children after the others.
    pub fn children(mut self, children: impl IntoIterator<Item = Element>) -> Self {
        self.children.extend(children);
        self
    }

    /// The tag.
    pub fn tag(&self) -> &str {
        &self.tag
    }

    /// Names and values of the attributes, in order.
    pub fn attributes(&self) -> impl Iterator<Item = (&str, &str)> {
        self.attributes.iter().map(|(name, value)| (name.as_str(), value.as_str()))
    }

    /// The children, in order.
    pub fn child_elements(&self) -> impl Iterator<Item = &Element> {
        self.children.iter()
    }

    /// The value of an attribute.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.attributes().find(|(known, _)| *known == name).map(|(_, value)| value)
    }
}

/// A whole tree file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Document {
    pub(crate) main_tree: Option<String>,
    pub(crate) includes: Vec<Element>,
    /// The `BehaviorTree` elements.
    pub(crate) trees: Vec<Element>,
    /// The children of `TreeNodesModel`.
    pub(crate) models: Vec<Element>,
}

impl Document {
    /// A file without trees.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sets the tree to run first.
    pub fn main_tree(mut self, id: &str) -> Self {
        self.main_tree = Some(id.to_owned());
        self
    }

    /// Adds a tree.
    pub fn tree(mut self, id: &str, root: Element) -> Self {
        self.trees.push(Element::new("BehaviorTree").attribute("ID", id).child(root));
        self
    }

    /// Adds a model to `TreeNodesModel`: the declared ports of a tree or a kind of node. Replaces a model of the same
    /// `ID`.
    pub fn model(mut self, model: Element) -> Self {
        self.models.retain(|other| other.get("ID") != model.get("ID"));
        self.models.push(model);
        self
    }

    /// Adds several models, such as those of [`Registry::models`](crate::Registry::models).
    pub fn models(self, models: impl IntoIterator<Item = Element>) -> Self {
        models.into_iter().fold(self, Document::model)
    }
}
