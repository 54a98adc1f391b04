//! What the engine does, seen from outside.

mod allocations;
mod conditions;
mod conformance;
mod control;
mod counting;
mod decorators;
mod executor;
mod faults;
mod fuzz;
mod inspect;
mod load_errors;
mod ports;
mod properties;
#[path = "../../benches/reference/mod.rs"]
mod reference;
mod subtrees;
mod support;
mod timing;
mod wake;
mod write_back;

#[global_allocator]
static ALLOCATOR: counting::Counting = counting::Counting;
