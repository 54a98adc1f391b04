//! A parsed and checked tree, of which instances are made.

use std::sync::Arc;
use std::task::Waker;

use crate::board::Board;
use crate::leaf::registry::Factory;
use crate::leaf::spec::{BuildError, NodeSpec};
use crate::machine::{Leaf, Machine, Tree};
use crate::parameters::{self, SetError};
use crate::shape::{LeafDef, Shape};
use crate::values::value::Value;

/// A loaded tree. Cheap to clone and to make instances of.
pub struct Template<Ctx> {
    pub(crate) shape: Arc<Shape>,
    /// One for every leaf of the shape, in the same order.
    pub(crate) factories: Arc<[Arc<dyn Factory<Ctx>>]>,
}

impl<Ctx> Clone for Template<Ctx> {
    fn clone(&self) -> Self {
        Template { shape: self.shape.clone(), factories: self.factories.clone() }
    }
}

impl<Ctx> Template<Ctx> {
    /// Makes a tree, with values for the parameters it declares.
    pub fn instantiate(&self, parameters: &[(&str, Value)]) -> Result<Tree<Ctx>, InstantiateError> {
        self.instantiate_with(parameters, Waker::noop())
    }

    /// Makes a tree whose leaves wake `waker`. A leaf that holds a tree passes on
    /// [`Ports::waker`](crate::Ports::waker).
    pub fn instantiate_with(&self, parameters: &[(&str, Value)], waker: &Waker) -> Result<Tree<Ctx>, InstantiateError> {
        let shape = &*self.shape;
        let mut values: Vec<Option<Value>> = shape.slots.iter().map(|slot| slot.initial.clone()).collect();
        for (key, value) in parameters {
            parameters::set(shape, &mut values, key, value.clone())?;
        }
        let missing = shape.slots.iter().zip(&values).position(|(slot, value)| slot.required && value.is_none());
        if let Some(slot) = missing {
            let (tree, key) = (shape.tree_id.to_string(), shape.keys[slot].clone());
            return Err(InstantiateError::Missing { tree, key });
        }
        let machine = Machine::new(shape.nodes.len(), self.build_leaves(waker)?, Board::new(values, waker.clone()));
        Ok(Tree { shape: self.shape.clone(), machine })
    }

    /// The `ID` of the tree.
    pub fn id(&self) -> &str {
        &self.shape.tree_id
    }

    fn build_leaves(&self, waker: &Waker) -> Result<Vec<Box<dyn Leaf<Ctx>>>, InstantiateError> {
        let mut leaves = Vec::with_capacity(self.factories.len());
        for (leaf, factory) in self.shape.leaves.iter().zip(&*self.factories) {
            let built = factory.build(&spec_of(&self.shape, leaf, waker));
            leaves.push(built.map_err(|source| InstantiateError::Build {
                node: self.shape.name(leaf.node as usize).to_owned(),
                source,
            })?);
        }
        Ok(leaves)
    }
}

/// The description of a node for the factory of its leaf.
pub(crate) fn spec_of<'a>(shape: &'a Shape, leaf: &'a LeafDef, waker: &'a Waker) -> NodeSpec<'a> {
    let node = leaf.node as usize;
    NodeSpec { tag: shape.tag(node), name: shape.name(node), declared: &leaf.declared, bound: &leaf.bound, waker }
}

/// No instance could be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InstantiateError {
    /// The tree cannot take a given value.
    #[error("a parameter cannot be set")]
    Parameter(#[from] SetError),
    /// A parameter without a default was not given.
    #[error("tree `{tree}` needs a value for its parameter `{key}`")]
    Missing {
        /// The tree.
        tree: String,
        /// The parameter.
        key: String,
    },
    /// A factory refused to build its leaf.
    #[error("node `{node}` cannot be built")]
    Build {
        /// The node's name.
        node: String,
        /// Why.
        source: BuildError,
    },
    /// The library has no such tree.
    #[error("there is no tree `{tree}`{}", .nearest.as_ref().map(|nearest| format!("; did you mean `{nearest}`?")).unwrap_or_default())]
    NoSuchTree {
        /// The tree asked for.
        tree: String,
        /// The tree with the most similar ID.
        nearest: Option<String>,
    },
}
