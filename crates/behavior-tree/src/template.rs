//! A tree, parsed and checked, of which instances are made.

use std::sync::Arc;
use std::task::Waker;

use crate::board::Board;
use crate::kind::NodeState;
use crate::leaf::Leaf;
use crate::registry::Factory;
use crate::run::Machine;
use crate::shape::{LeafDef, Shape};
use crate::spec::{BuildError, NodeSpec};
use crate::status::NodeStatus;
use crate::tree::{SetError, Tree, set_open_key};
use crate::value::Value;

/// A tree that was loaded: cheap to clone, cheap to make instances of.
pub struct Template<Ctx> {
    pub(crate) shape: Arc<Shape>,
    pub(crate) factories: Arc<[Factory<Ctx>]>,
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

    /// Makes a tree whose leaves wake `waker`: a leaf that holds a tree passes [`Ports::waker`](crate::Ports::waker) on.
    pub fn instantiate_with(&self, parameters: &[(&str, Value)], waker: &Waker) -> Result<Tree<Ctx>, InstantiateError> {
        let shape = &*self.shape;
        let mut values: Vec<Option<Value>> = shape.slots.iter().map(|slot| slot.initial.clone()).collect();
        for (key, value) in parameters {
            set_open_key(shape, &mut values, key, value.clone())?;
        }
        let missing = shape.slots.iter().zip(&values).position(|(slot, value)| slot.required && value.is_none());
        if let Some(slot) = missing {
            let (tree, key) = (shape.tree_id.to_string(), shape.slot_names[slot].clone());
            return Err(InstantiateError::Missing { tree, key });
        }
        let leaves = self.build_leaves(waker)?;
        let board = Board {
            values,
            now: 0,
            deadline: u64::MAX,
            again: false,
            cause: None,
            held_faults: (Vec::new(), 0),
            compared: None,
            waker: waker.clone(),
        };
        let machine = Machine {
            status: vec![NodeStatus::Idle; shape.nodes.len()],
            state: vec![NodeState::default(); shape.nodes.len()],
            leaves,
            board,
            ring: None,
            causes: Vec::new(),
            last_cause: 0,
            faults: Vec::new(),
            lost_faults: 0,
            policy: Default::default(),
            aborting: false,
        };
        Ok(Tree { shape: self.shape.clone(), machine })
    }

    /// The `ID` of the tree.
    pub fn id(&self) -> &str {
        &self.shape.tree_id
    }

    fn build_leaves(&self, waker: &Waker) -> Result<Vec<Box<dyn Leaf<Ctx>>>, InstantiateError> {
        let mut leaves = Vec::with_capacity(self.factories.len());
        for (leaf, factory) in self.shape.leaves.iter().zip(&*self.factories) {
            let built = factory(&spec_of(&self.shape, leaf, waker));
            leaves.push(built.map_err(|source| InstantiateError::Build {
                node: self.shape.labels[leaf.node as usize].name.to_string(),
                source,
            })?);
        }
        Ok(leaves)
    }
}

pub(crate) fn spec_of<'a>(shape: &'a Shape, leaf: &'a LeafDef, waker: &'a Waker) -> NodeSpec<'a> {
    let label = &shape.labels[leaf.node as usize];
    NodeSpec { tag: &label.tag, name: &label.name, declared: &leaf.declared, bound: &leaf.bound, waker }
}

/// No instance could be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InstantiateError {
    /// A value was given that the tree cannot take.
    #[error("a parameter does not fit")]
    Parameter(#[from] SetError),
    /// A parameter without default was not given.
    #[error("tree `{tree}` needs a value for its parameter `{key}`")]
    Missing {
        /// The tree.
        tree: String,
        /// The parameter.
        key: String,
    },
    /// A factory refused.
    #[error("node `{node}` cannot be built")]
    Build {
        /// The node's name.
        node: String,
        /// Why.
        source: BuildError,
    },
    /// The library has no such tree.
    #[error("there is no tree `{tree}`{}", .nearest.as_ref().map(|it| format!(", did you mean `{it}`?")).unwrap_or_default())]
    NoSuchTree {
        /// The tree asked for.
        tree: String,
        /// The tree with the most similar name.
        nearest: Option<String>,
    },
}
