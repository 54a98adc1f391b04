//! Tree files, loaded and checked.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::task::Waker;

use crate::leaf::registry::Registry;
use crate::load::expand::expand_all;
use crate::load::files::{check_includes, main_tree};
use crate::load::forest::Forest;
use crate::load::mistake::{LoadErrors, Mistake};
use crate::load::mistakes::Mistakes;
use crate::load::nearest::nearest;
use crate::load::parse::{Contents, document, parse, read};
use crate::machine::Tree;
use crate::template::{InstantiateError, Template};
use crate::values::value::Value;
use crate::xml::element::Document;
use crate::xml::source::Place;

/// All trees of a program, parsed and checked once.
pub struct Library<Ctx> {
    templates: BTreeMap<String, Template<Ctx>>,
    main_tree: Option<String>,
    /// Names and texts.
    files: Arc<[(String, String)]>,
}

impl<Ctx> Library<Ctx> {
    /// Loads tree files, given as pairs of name and text.
    ///
    /// The trees of one file may include those of another, whether the file has an `include` or not. An `include` must
    /// name a file that is among those given.
    ///
    /// # Errors
    /// All mistakes in all files, each with its place.
    pub fn load<Name, Text>(
        registry: &Registry<Ctx>,
        files: impl IntoIterator<Item = (Name, Text)>,
    ) -> Result<Self, LoadErrors>
    where
        Name: Into<String>,
        Text: Into<String>,
    {
        let files: Arc<[(String, String)]> = files.into_iter().map(|(name, text)| (name.into(), text.into())).collect();
        let mut mistakes = Mistakes::new(files.clone());
        for mistake in &registry.mistakes {
            mistakes.add(Place { file: u32::MAX, offset: 0 }, Mistake::Registry(mistake.clone()));
        }
        let parsed: Vec<_> = files
            .iter()
            .zip(0..)
            .filter_map(|((_, text), file)| Some((file, parse(file, text, &mut mistakes)?)))
            .collect();
        let contents: Vec<Contents<'_>> = parsed.iter().map(|(file, xml)| read(*file, xml, &mut mistakes)).collect();
        check_includes(&contents, &mut mistakes);
        let mut forest = Forest::new(registry, &contents, &mut mistakes);
        let templates = expand_all(&mut forest, &mut mistakes);
        let main_tree = main_tree(&contents, &mut mistakes);
        if !mistakes.is_empty() {
            return Err(mistakes.into_errors());
        }
        Ok(Library { templates, main_tree, files })
    }

    /// The tree with the ID `id`.
    pub fn template(&self, id: &str) -> Option<Template<Ctx>> {
        self.templates.get(id).cloned()
    }

    /// Makes an instance of the tree `id`, with values for the parameters it declares.
    pub fn instantiate(&self, id: &str, parameters: &[(&str, Value)]) -> Result<Tree<Ctx>, InstantiateError> {
        self.instantiate_with(id, parameters, Waker::noop())
    }

    /// [`Library::instantiate`] with the waker that the leaves wake.
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

    /// The tree that `main_tree_to_execute` names, or the only tree.
    pub fn main_tree(&self) -> Option<&str> {
        self.main_tree.as_deref()
    }

    /// The `ID`s of all trees.
    pub fn ids(&self) -> impl Iterator<Item = &str> {
        self.templates.keys().map(String::as_str)
    }

    /// The names and contents of the files, for writing them back.
    pub fn documents(&self) -> impl Iterator<Item = (&str, Document)> {
        // They are read again, because few programs ask for them and loading without them is faster.
        self.files.iter().map(|(name, text)| (name.as_str(), document(text)))
    }
}
