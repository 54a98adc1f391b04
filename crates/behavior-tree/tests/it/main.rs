//! The behavior of the engine, seen from outside.

mod allocations;
mod conditions;
mod conformance;
mod control;
mod decorators;
mod errors;
mod executor;
mod failures;
pub(crate) mod fuzz;
mod inspect;
mod load_errors;
mod ports;
mod properties;
#[allow(clippy::disallowed_methods, dead_code, reason = "a bench uses it too, and reads a clock")]
mod reference;
mod subtrees;
mod support;
mod timing;
mod wake;
mod write_back;

#[global_allocator]
static ALLOCATOR: counting_allocator::Counting = counting_allocator::Counting;

/// A tree can be made on one thread and ticked on another.
const _: fn() = || {
    fn is_send<T: Send>() {}
    is_send::<behavior_tree::Tree<()>>();
    is_send::<behavior_tree::Library<()>>();
    is_send::<behavior_tree::Template<()>>();
};
