//! The built-in nodes: a page for each, with its rule as a table.
//!
//! Every node may also have [pre- and postconditions](conditions).
//!
//! On these pages, a node *returns* a status to its parent, and *resets* a child: makes it idle, and halts it first if it
//! is running.
//!
//! A new kind of node is one file here, its `pub mod` line below, and its row in the table in `kind.rs`.

pub mod always_failure;
pub mod always_success;
pub(crate) mod built_in;
pub mod conditions;
pub mod delay;
pub mod fallback;
pub mod force_failure;
pub mod force_success;
pub mod if_then_else;
pub mod inverter;
pub mod keep_running_until_failure;
mod leaf;
pub mod parallel;
pub mod parallel_all;
pub mod precondition;
pub mod reactive_fallback;
pub mod reactive_sequence;
pub mod repeat;
pub mod retry_until_successful;
pub(crate) mod run;
pub mod run_once;
pub mod script;
pub mod script_condition;
pub mod sequence;
pub mod sequence_with_memory;
pub mod sleep;
pub mod sub_tree;
pub mod success_is_running;
pub mod switch;
pub mod timeout;
pub mod while_do_else;

use std::collections::HashMap;
use std::sync::LazyLock;

use built_in::{BuiltIn, BuiltInPort};
use run::Run;

use crate::kind::{Kind, with_node_kinds};
use crate::leaf::declaration::Port;
use crate::status::Status;

macro_rules! dispatch {
    ($($kind:ident $({ $($param:ident: $ty:ty),* })? in $file:ident;)*) => {
        /// Ticks a node by the rule of its kind.
        // Inlined into `Run::execute`: one call less for every node of every tick.
        #[inline]
        fn tick<Ctx>(run: &mut Run<'_, Ctx>, at: usize, kind: Kind) -> Status {
            match kind {
                $(Kind::$kind $({ $($param),* })? => $file::tick(run, at $(, $($param),*)?)),*
            }
        }

        /// The declarations of all kinds.
        const BUILT_INS: &[&[BuiltIn]] = &[$($file::BUILT_INS),*];
    };
}

with_node_kinds!(dispatch);

pub(crate) fn built_ins() -> impl Iterator<Item = &'static BuiltIn> {
    BUILT_INS.iter().copied().flatten()
}

/// The declaration of a kind of node, and its ports.
pub(crate) fn built_in(tag: &str) -> Option<(&'static BuiltIn, &'static [Port])> {
    static BY_TAG: LazyLock<HashMap<&str, (&BuiltIn, Vec<Port>)>> = LazyLock::new(|| {
        let ports = |built_in: &BuiltIn| built_in.ports.iter().map(BuiltInPort::to_port).collect();
        built_ins().map(|built_in| (built_in.tag, (built_in, ports(built_in)))).collect()
    });
    BY_TAG.get(tag).map(|(built_in, ports)| (*built_in, ports.as_slice()))
}

pub(crate) fn is_built_in(tag: &str) -> bool {
    built_in(tag).is_some()
}
