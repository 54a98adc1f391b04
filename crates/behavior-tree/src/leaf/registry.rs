//! The kinds of leaf that a program registers.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::declaration::{LeafClass, Port};
use super::ports::Ports;
use super::spec::{BuildError, NodeSpec};
use crate::machine::{Leaf, LeafError, LeafResult};
use crate::nodes;
use crate::status::Status;
use crate::values::port_value::PortValue;
use crate::values::types::Type;
use crate::xml::element::Element;

/// Makes the leaves of one kind.
pub(crate) trait Factory<Ctx>: Send + Sync {
    fn build(&self, spec: &NodeSpec<'_>) -> Result<Box<dyn Leaf<Ctx>>, BuildError>;

    /// Whether the leaf can be built.
    fn check(&self, spec: &NodeSpec<'_>) -> Result<(), BuildError>;
}

impl<Ctx, L, B> Factory<Ctx> for B
where
    L: Leaf<Ctx> + 'static,
    B: Fn(&NodeSpec<'_>) -> Result<L, BuildError> + Send + Sync,
{
    fn build(&self, spec: &NodeSpec<'_>) -> Result<Box<dyn Leaf<Ctx>>, BuildError> {
        self(spec).map(|leaf| Box::new(leaf) as Box<dyn Leaf<Ctx>>)
    }

    fn check(&self, spec: &NodeSpec<'_>) -> Result<(), BuildError> {
        self(spec).map(drop)
    }
}

pub(crate) struct LeafKind<Ctx> {
    pub(crate) class: LeafClass,
    pub(crate) ports: Arc<[Port]>,
    pub(crate) factory: Arc<dyn Factory<Ctx>>,
}

/// The kinds of leaf that trees may use, by tag, and the keys that programs set from outside.
///
/// Control nodes and decorators are built in and need no registration.
pub struct Registry<Ctx> {
    pub(crate) kinds: BTreeMap<String, LeafKind<Ctx>>,
    pub(crate) globals: BTreeMap<String, Type>,
    pub(crate) constants: BTreeMap<String, i64>,
    /// What is wrong with the registrations, reported when a library is loaded.
    pub(crate) mistakes: Vec<String>,
}

impl<Ctx> Default for Registry<Ctx> {
    fn default() -> Self {
        let (kinds, globals, constants) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        Registry { kinds, globals, constants, mistakes: Vec::new() }
    }
}

impl<Ctx: 'static> Registry<Ctx> {
    /// No kinds of leaf yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// A condition from a closure: `true` is success. It asks and cannot act: it gets a shared reference.
    pub fn condition<F>(&mut self, tag: &str, ports: impl IntoIterator<Item = Port>, holds: F) -> &mut Self
    where
        F: Fn(&Ctx, &mut Ports<'_>) -> Result<bool, LeafError> + Send + Sync + 'static,
    {
        self.closure(LeafClass::Condition, tag, ports, move |ctx, ports| holds(ctx, ports))
    }

    /// A condition that keeps something of its node, such as a constant of a port, or of its last tick. `build` as for
    /// [`Registry::action`].
    pub fn condition_with<C, B>(&mut self, tag: &str, ports: impl IntoIterator<Item = Port>, build: B) -> &mut Self
    where
        C: Condition<Ctx> + 'static,
        B: Fn(&NodeSpec<'_>) -> Result<C, BuildError> + Send + Sync + 'static,
    {
        self.leaf(LeafClass::Condition, tag, ports, move |spec| build(spec).map(Asks))
    }

    /// An action from a closure that is done within the tick: `true` is success.
    pub fn sync_action<F>(&mut self, tag: &str, ports: impl IntoIterator<Item = Port>, act: F) -> &mut Self
    where
        F: Fn(&mut Ctx, &mut Ports<'_>) -> Result<bool, LeafError> + Send + Sync + 'static,
    {
        self.closure(LeafClass::SyncAction, tag, ports, act)
    }

    /// An action that may run over several ticks.
    ///
    /// `build` makes the leaf of one node. It is called once for every node of this kind when a library is loaded, to
    /// check the tree, and once for every node of every instance.
    pub fn action<L, B>(&mut self, tag: &str, ports: impl IntoIterator<Item = Port>, build: B) -> &mut Self
    where
        L: Leaf<Ctx> + 'static,
        B: Fn(&NodeSpec<'_>) -> Result<L, BuildError> + Send + Sync + 'static,
    {
        self.leaf(LeafClass::Action, tag, ports, build)
    }

    /// A leaf of any class. One of class `Condition` is not kept from acting: prefer [`Registry::condition_with`].
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
        let kind = LeafKind { class, ports: ports.into_iter().collect(), factory: Arc::new(build) };
        for (number, port) in kind.ports.iter().enumerate() {
            let name = &port.name;
            if !is_valid_name(name) {
                self.mistakes.push(format!("`{tag}` declares a port `{name}`, which is not a valid name"));
            } else if kind.ports[..number].iter().any(|other| other.name == *name) {
                self.mistakes.push(format!("`{tag}` declares the port `{name}` twice"));
            }
        }
        if nodes::is_built_in(tag) {
            self.mistakes.push(format!("`{tag}` is a built-in node and cannot be registered"));
        } else if self.kinds.insert(tag.to_owned(), kind).is_some() {
            self.mistakes.push(format!("`{tag}` is registered twice"));
        }
        self
    }

    /// A key of every outermost tree that the program sets from outside, see [`Tree::set`](crate::Tree::set).
    pub fn global<T: PortValue>(&mut self, key: &str) -> &mut Self {
        self.globals.insert(key.to_owned(), T::port_type());
        self
    }

    /// A name for a number, for expressions and `Switch` cases.
    pub fn constant(&mut self, name: &str, value: i64) -> &mut Self {
        self.constants.insert(name.to_owned(), value);
        self
    }

    /// The registered kinds as children of a `TreeNodesModel`. Groot2 opens and edits a
    /// [`Document`](crate::Document) that has them beside its trees.
    pub fn models(&self) -> Vec<Element> {
        self.kinds.iter().map(|(tag, kind)| leaf_model(tag, kind.class, &kind.ports)).collect()
    }

    fn closure<F>(
        &mut self,
        class: LeafClass,
        tag: &str,
        ports: impl IntoIterator<Item = Port>,
        closure: F,
    ) -> &mut Self
    where
        F: Fn(&mut Ctx, &mut Ports<'_>) -> Result<bool, LeafError> + Send + Sync + 'static,
    {
        let closure = Arc::new(closure);
        self.leaf(class, tag, ports, move |_| Ok(Closure(closure.clone())))
    }
}

/// A kind of leaf in a `TreeNodesModel`.
pub(crate) fn leaf_model(tag: &str, class: LeafClass, ports: &[Port]) -> Element {
    Element::new(class.tag()).attribute("ID", tag).children(ports.iter().map(Port::model))
}

/// A condition: it asks, and cannot change what the program knows.
pub trait Condition<Ctx>: Send {
    /// Whether it holds; `true` is success.
    fn holds(&mut self, ctx: &Ctx, ports: &mut Ports<'_>) -> Result<bool, LeafError>;
}

/// The leaf of a condition.
struct Asks<C>(C);

impl<Ctx, C: Condition<Ctx>> Leaf<Ctx> for Asks<C> {
    fn tick(&mut self, ctx: &mut Ctx, ports: &mut Ports<'_>) -> LeafResult {
        self.0.holds(ctx, ports).map(Status::from_bool)
    }
}

/// A leaf made of a closure, which returns its result at once.
struct Closure<F>(Arc<F>);

impl<Ctx, F> Leaf<Ctx> for Closure<F>
where
    F: Fn(&mut Ctx, &mut Ports<'_>) -> Result<bool, LeafError> + Send + Sync,
{
    fn tick(&mut self, ctx: &mut Ctx, ports: &mut Ports<'_>) -> LeafResult {
        (self.0)(ctx, ports).map(Status::from_bool)
    }
}

/// False for names that are attributes of their own, or that break a file or Groot2.
fn is_valid_name(name: &str) -> bool {
    let starts_well = name.starts_with(|c: char| c.is_alphabetic());
    let has_bad_character =
        name.contains(|c: char| c.is_whitespace() || c.is_control() || "<>&\"'/\\:*?|.{}=".contains(c));
    starts_well && !has_bad_character && name != "name" && name != "ID"
}
