//! The kinds of leaf a program brings.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::leaf::{Answer, Leaf, LeafError};
use crate::port_list::Port;
use crate::port_value::PortValue;
use crate::ports::Ports;
use crate::spec::{BuildError, NodeSpec};
use crate::types::Type;
use crate::xml::element::Element;

pub(crate) type Factory<Ctx> = Arc<dyn Fn(&NodeSpec<'_>) -> Result<Box<dyn Leaf<Ctx>>, BuildError> + Send + Sync>;

/// What a leaf is to an editor, and whether it remembers that it has finished.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeafClass {
    /// Looks and answers. Asked anew at every tick.
    Condition,
    /// Acts at once and answers. Run anew at every tick.
    SyncAction,
    /// Acts over several ticks. Once finished it keeps its answer until its parent resets it.
    Action,
}

pub(crate) struct LeafKind<Ctx> {
    pub(crate) class: LeafClass,
    pub(crate) ports: Arc<[Port]>,
    pub(crate) factory: Factory<Ctx>,
}

impl<Ctx> Clone for LeafKind<Ctx> {
    fn clone(&self) -> Self {
        LeafKind { class: self.class, ports: self.ports.clone(), factory: self.factory.clone() }
    }
}

/// The kinds of leaf that trees may use, by tag name, and the keys that programs set from outside.
///
/// The control nodes and decorators are built in and need no registration.
pub struct Registry<Ctx> {
    pub(crate) kinds: BTreeMap<String, LeafKind<Ctx>>,
    pub(crate) globals: BTreeMap<String, Type>,
    pub(crate) constants: BTreeMap<String, i64>,
    pub(crate) mistakes: Vec<String>,
}

impl<Ctx> Default for Registry<Ctx> {
    fn default() -> Self {
        let (kinds, globals, constants) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        Registry { kinds, globals, constants, mistakes: Vec::new() }
    }
}

impl<Ctx> Clone for Registry<Ctx> {
    fn clone(&self) -> Self {
        Registry {
            kinds: self.kinds.clone(),
            globals: self.globals.clone(),
            constants: self.constants.clone(),
            mistakes: self.mistakes.clone(),
        }
    }
}

impl<Ctx: 'static> Registry<Ctx> {
    /// No kinds of leaf yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// A condition from a closure: `true` is success.
    pub fn condition<F>(&mut self, tag: &str, ports: impl IntoIterator<Item = Port>, holds: F) -> &mut Self
    where
        F: Fn(&mut Ctx, &mut Ports<'_>) -> Result<bool, LeafError> + Send + Sync + 'static,
    {
        self.closure(LeafClass::Condition, tag, ports, holds)
    }

    /// An action from a closure, done within the tick: `true` is success.
    pub fn sync_action<F>(&mut self, tag: &str, ports: impl IntoIterator<Item = Port>, act: F) -> &mut Self
    where
        F: Fn(&mut Ctx, &mut Ports<'_>) -> Result<bool, LeafError> + Send + Sync + 'static,
    {
        self.closure(LeafClass::SyncAction, tag, ports, act)
    }

    /// An action that may run over several ticks; `build` makes one for every node of this kind.
    ///
    /// `build` is called once for every such node while a library is loaded, to check it, and once for every instance.
    pub fn action<L, B>(&mut self, tag: &str, ports: impl IntoIterator<Item = Port>, build: B) -> &mut Self
    where
        L: Leaf<Ctx> + 'static,
        B: Fn(&NodeSpec<'_>) -> Result<L, BuildError> + Send + Sync + 'static,
    {
        self.leaf(LeafClass::Action, tag, ports, build)
    }

    /// A leaf of any class.
    pub fn leaf<L, B>(
        &mut self,
        class: LeafClass,
        tag: &str,
        ports: impl IntoIterator<Item = Port>,
        build: B,
    ) -> &mut Self
    where
        L: Leaf<Ctx> + 'static,
        B: Fn(&NodeSpec<'_>) -> Result<L, BuildError> + Send + Sync + 'static,
    {
        let factory: Factory<Ctx> = Arc::new(move |spec| build(spec).map(|leaf| Box::new(leaf) as Box<dyn Leaf<Ctx>>));
        let kind = LeafKind { class, ports: ports.into_iter().collect(), factory };
        for (number, port) in kind.ports.iter().enumerate() {
            let name = &port.name;
            if !is_usable_name(name) {
                self.mistakes.push(format!("`{tag}` declares a port `{name}`, which is not a usable name"));
            } else if kind.ports[..number].iter().any(|other| other.name == *name) {
                self.mistakes.push(format!("`{tag}` declares the port `{name}` twice"));
            }
        }
        if crate::nodes::is_built_in(tag) {
            self.mistakes.push(format!("`{tag}` is built in and cannot be registered again"));
        } else if self.kinds.insert(tag.to_owned(), kind).is_some() {
            self.mistakes.push(format!("`{tag}` is registered twice"));
        }
        self
    }

    /// A key of every tree's root blackboard that the program sets from outside, see [`Tree::set`](crate::Tree::set).
    pub fn global<T: PortValue>(&mut self, key: &str) -> &mut Self {
        self.globals.insert(key.to_owned(), T::port_type());
        self
    }

    /// A name for a number, to be used in expressions and `Switch` cases.
    pub fn constant(&mut self, name: &str, value: i64) -> &mut Self {
        self.constants.insert(name.to_owned(), value);
        self
    }

    /// The kinds registered here as the children of a `TreeNodesModel`, for editors. Put them into a
    /// [`Document`](crate::Document) with the trees, and Groot2 opens and edits it.
    pub fn models(&self) -> Vec<Element> {
        self.kinds.iter().map(|(tag, kind)| leaf_model(tag, kind.class, &kind.ports)).collect()
    }

    fn closure<F>(&mut self, class: LeafClass, tag: &str, ports: impl IntoIterator<Item = Port>, answer: F) -> &mut Self
    where
        F: Fn(&mut Ctx, &mut Ports<'_>) -> Result<bool, LeafError> + Send + Sync + 'static,
    {
        let answer = Arc::new(answer);
        self.leaf(class, tag, ports, move |_| Ok(Answer(answer.clone())))
    }
}

pub(crate) fn leaf_model(tag: &str, class: LeafClass, ports: &[Port]) -> Element {
    let class = match class {
        LeafClass::Condition => "Condition",
        LeafClass::SyncAction | LeafClass::Action => "Action",
    };
    Element::new(class).attribute("ID", tag).children(ports.iter().map(Port::model))
}

pub(crate) fn subtree_model(id: &str) -> Element {
    Element::new("SubTree").attribute("ID", id)
}

/// Names that are attributes of their own, or that break a file or Groot2, are no names for ports.
fn is_usable_name(name: &str) -> bool {
    let begins_well = name.starts_with(|c: char| c.is_alphabetic());
    let has_bad_sign = name.contains(|c: char| c.is_whitespace() || c.is_control() || "<>&\"'/\\:*?|.{}=".contains(c));
    begins_well && !has_bad_sign && name != "name" && name != "ID"
}
