//! Tree files, loaded and checked.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::task::Waker;

use crate::load::expand::{Forest, MAX_NODES_IN_ALL, expand};
use crate::load::mistake::{LoadErrors, Mistake};
use crate::load::mistakes::Mistakes;
use crate::load::model::subtree_ports;
use crate::load::nearest::nearest;
use crate::nodes;
use crate::registry::Registry;
use crate::template::{InstantiateError, Template};
use crate::tree::Tree;
use crate::value::Value;
use crate::xml::element::{Document, Element, Place};
use crate::xml::parse;

/// All trees of a program, parsed and checked once.
pub struct Library<Ctx> {
    templates: BTreeMap<String, Template<Ctx>>,
    main_tree: Option<String>,
    documents: Vec<(String, Document)>,
}

impl<Ctx> Library<Ctx> {
    /// Loads tree files, given as pairs of name and text. All mistakes are reported at once.
    ///
    /// Trees of one file may use those of another, whether it includes it or not; an `include` must name a file that is
    /// among those given.
    pub fn load<Name, Text>(
        registry: &Registry<Ctx>,
        files: impl IntoIterator<Item = (Name, Text)>,
    ) -> Result<Self, LoadErrors>
    where
        Name: Into<String>,
        Text: Into<String>,
    {
        let files: Vec<(String, String)> = files.into_iter().map(|(name, text)| (name.into(), text.into())).collect();
        let mut mistakes = Mistakes::new(files.clone());
        for mistake in &registry.mistakes {
            mistakes.add(Place { file: u32::MAX, offset: 0 }, Mistake::Registry(mistake.clone()));
        }
        let documents: Vec<Document> = files
            .iter()
            .enumerate()
            .map(|(number, (_, text))| parse::parse(number as u32, text, &mut mistakes))
            .collect();
        let templates = load_trees(registry, &documents, &mut mistakes);
        let main_tree = main_tree(&documents, &mut mistakes);
        if mistakes.is_empty() {
            let names = files.into_iter().map(|(name, _)| name);
            Ok(Library { templates, main_tree, documents: names.zip(documents).collect() })
        } else {
            Err(mistakes.into_errors())
        }
    }

    /// The tree called `id`.
    pub fn template(&self, id: &str) -> Option<Template<Ctx>> {
        self.templates.get(id).cloned()
    }

    /// Makes an instance of the tree called `id`, with values for the parameters it declares.
    pub fn instantiate(&self, id: &str, parameters: &[(&str, Value)]) -> Result<Tree<Ctx>, InstantiateError> {
        self.instantiate_with(id, parameters, Waker::noop())
    }

    /// [`Library::instantiate`] with the waker that the leaves are to wake.
    pub fn instantiate_with(
        &self,
        id: &str,
        parameters: &[(&str, Value)],
        waker: &Waker,
    ) -> Result<Tree<Ctx>, InstantiateError> {
        match self.templates.get(id) {
            Some(template) => template.instantiate_with(parameters, waker),
            None => Err(InstantiateError::NoSuchTree { tree: id.to_owned(), nearest: nearest(id, self.ids()) }),
        }
    }

    /// The tree that `main_tree_to_execute` names, or the only one there is.
    pub fn main_tree(&self) -> Option<&str> {
        self.main_tree.as_deref()
    }

    /// The `ID`s of all trees.
    pub fn ids(&self) -> impl Iterator<Item = &str> {
        self.templates.keys().map(String::as_str)
    }

    /// The files as they were understood, for writing back.
    pub fn documents(&self) -> impl Iterator<Item = (&str, &Document)> {
        self.documents.iter().map(|(name, document)| (name.as_str(), document))
    }
}

fn load_trees<Ctx>(
    registry: &Registry<Ctx>,
    documents: &[Document],
    mistakes: &mut Mistakes,
) -> BTreeMap<String, Template<Ctx>> {
    let mut trees: BTreeMap<&str, &Element> = BTreeMap::new();
    for tree in documents.iter().flat_map(|document| &document.trees) {
        let Some(attribute) = tree.find("ID") else {
            mistakes.add(tree.at, Mistake::MissingAttribute { tag: tree.tag.clone(), attribute: "ID" });
            continue;
        };
        let id = attribute.value.as_str();
        if nodes::is_built_in(id) || registry.kinds.contains_key(id) {
            mistakes.add(attribute.at, Mistake::TreeNamedLikeNode { id: id.to_owned() });
        }
        if trees.insert(id, tree).is_some() {
            mistakes.add(attribute.at, Mistake::DuplicateTree { id: id.to_owned() });
        }
    }
    check_includes(documents, mistakes);
    let models = subtree_ports(documents, mistakes);
    let parts: BTreeSet<&str> = trees.values().flat_map(|tree| parts_of(tree)).collect();
    let ids: Vec<&str> = trees.keys().copied().collect();
    let mut forest = Forest { registry, trees, models, nodes_left: MAX_NODES_IN_ALL };
    let mut templates = BTreeMap::new();
    for id in ids {
        if let Some(template) = expand(&mut forest, id, parts.contains(id), mistakes) {
            templates.insert(id.to_owned(), template);
        }
    }
    templates
}

/// The trees that a tree names as its subtrees.
fn parts_of(element: &Element) -> Vec<&str> {
    let own = (element.tag == "SubTree").then(|| element.get("ID")).flatten();
    let below = element.children.iter().flat_map(|child| parts_of(child));
    own.into_iter().chain(below).collect()
}

fn check_includes(documents: &[Document], mistakes: &mut Mistakes) {
    let names: Vec<String> = mistakes.files().iter().map(|(name, _)| name.clone()).collect();
    for include in documents.iter().flat_map(|document| &document.includes) {
        let Some(path) = include.find("path") else {
            mistakes.add(include.at, Mistake::MissingAttribute { tag: "include".into(), attribute: "path" });
            continue;
        };
        let wanted = path.value.trim_start_matches("./");
        let is_given = names.iter().any(|name| name == wanted || name.ends_with(&format!("/{wanted}")));
        if !is_given {
            let nearest = mistakes.nearest(wanted, names.iter().map(String::as_str));
            mistakes.add(path.at, Mistake::UnknownInclude { path: path.value.clone(), nearest });
        }
    }
}

/// The first file that names a main tree decides; without any, a tree that is alone is the main one.
fn main_tree(documents: &[Document], mistakes: &mut Mistakes) -> Option<String> {
    let known: HashMap<&str, ()> =
        documents.iter().flat_map(|it| &it.trees).filter_map(|tree| tree.get("ID")).map(|id| (id, ())).collect();
    for main in documents.iter().filter_map(|document| document.main_tree.as_ref()) {
        if !known.contains_key(main.value.as_str()) {
            let nearest = mistakes.nearest(&main.value, known.keys().copied());
            mistakes.add(main.at, Mistake::UnknownTree { id: main.value.clone(), nearest });
        }
    }
    let named = documents.iter().find_map(|document| document.main_tree.as_ref());
    match (named, known.len()) {
        (Some(main), _) => Some(main.value.clone()),
        (None, 1) => known.keys().next().map(|id| (*id).to_owned()),
        (None, _) => None,
    }
}
