//! Behavior trees with the semantics of BehaviorTree.CPP 4: event-driven, checked when loaded, inspectable.
//!
//! ```
//! use std::time::Duration;
//! use behavior_tree::{Library, Registry, Status};
//!
//! let mut registry = Registry::new();
//! registry.condition("BatteryOk", [], |level: &f64, _| Ok(20.0 < *level));
//! registry.sync_action("Fly", [], |level, _| { *level -= 30.0; Ok(true) });
//! let xml = r#"<root BTCPP_format="4"><BehaviorTree ID="Main">
//!     <Sequence> <BatteryOk/> <Fly/> </Sequence> </BehaviorTree></root>"#;
//! let mut tree = Library::load(&registry, [("main.xml", xml)])?.instantiate("Main", &[])?;
//! assert_eq!(tree.tick_once(Duration::ZERO, &mut 100.0), Status::Success);
//! assert_eq!(tree.tick_once(Duration::ZERO, &mut 10.0), Status::Failure);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Where things are
//!
//! | to | see |
//! |---|---|
//! | write an action or a condition | [`Leaf`], [`Condition`], [`Ports`], [`Status`] |
//! | register it | [`Registry`], [`Port`], [`NodeSpec`] |
//! | load tree files, and find out what is wrong with them | [`Library`], [`LoadErrors`], [`Mistake`] |
//! | make a tree, tick it, halt it | [`Template`], [`Tree`] |
//! | know when to tick it | [`Tree::next_tick`], [`WakeSignal`] |
//! | look up a built-in node | [`nodes`], with a page for each |
//! | write expressions | [`nodes::conditions`] |
//! | observe a tree | [`Tree::statuses`], [`Tree::take_changes`], [`Tree::to_text`], [`BtlogWriter`] |
//! | find out why it failed | [`Tree::last_failure`], [`Ports::because`], [`Tree::errors`] |
//! | build tree files in a program, or export models for Groot2 | [`Document`], [`Element`], [`Registry::models`] |
//!
//! # How a tree runs
//!
//! A tick is a function call: it starts at the root, ticks leaves, and returns. A leaf reads its world from the `Ctx`
//! that the caller passes in, and collects there the commands that the caller sends after the tick. Time is an argument.
//! A leaf that waits returns [`Status::Running`] and makes sure that [`Ports::waker`] is called, or names a time with
//! [`Ports::tick_at`]; the caller sleeps until then. [`Tree::tick_once`] ticks again while nodes ask for it, so that
//! everything that follows from one event has happened when it returns.
//!
//! The engine has no threads, no locks, no clock and no executor. A steady tick does not allocate. A leaf that panics or
//! returns an error fails its node, is halted and is recorded as a [`NodeError`], and the tree goes on. (A program built
//! with `panic = "abort"` ends at a panic.)
//!
//! A leaf may hold a [`Tree`] of its own, made at run time from a [`Template`] with parameters: see [`Ports::tick_tree`]
//! and [`Leaf::subtree`].
//!
//! # Tree files
//!
//! BehaviorTree.CPP's XML, format 4, which Groot2 opens and edits. Everything is checked when it is loaded, and all
//! mistakes of all files are reported at once with file, line, column and a hint: unknown nodes, ports and trees, missing
//! ports, constants and keys of the wrong type, keys that nothing writes, expressions, names used twice. A tree declares
//! the keys that it takes from outside as the ports of its model:
//!
//! ```xml
//! <TreeNodesModel>
//!   <SubTree ID="Step"> <input_port name="goal" type="Goal"/> </SubTree>
//! </TreeNodesModel>
//! ```
//!
//! # Differences from BehaviorTree.CPP 4.10
//!
//! Statuses, results and the order of ticks and halts are those of BehaviorTree.CPP, compared on thousands of random
//! trees. These differences are deliberate:
//!
//! | | here | there | because |
//! |---|---|---|---|
//! | an error in a leaf | fails the node and is recorded, the tree goes on | an exception leaves the tree as it is | in flight the tree must go on |
//! | wrong counts and thresholds | found when loading | thrown at a tick | |
//! | types of keys, keys that nothing writes | found when loading, no conversion from text at run time | thrown at a tick | |
//! | a condition that returns running | an error | allowed | it would never be halted |
//! | `IfThenElse`, `WhileDoElse` with a skipped condition | return skipped | throw | |
//! | `Timeout` | checks the time when it is ticked, and asks for a tick | halts its child from a thread of its own | a tree belongs to one thread |
//! | `Delay` of 0 | ticks its child at once | at the next tick | |
//! | `tick_once` | ticks 100 times at most | no limit | a loop must not hang its caller |
//! | halting the whole tree | `_onHalted` only of nodes that ran | of all nodes | a node that did not run was not halted |
//! | `&&` and `\|\|` | the right side only if needed | always | |
//! | numbers in expressions | integers stay integers, overflow is an error | all are doubles | a count is not 2.9999 |
//! | assigning a double to an integer | found when loading | thrown if it does not fit | |
//! | `<` and `&` in attributes | `&lt;` and `&amp;`, as XML requires | also bare | |
//! | `SuccessIsRunning` | exists | does not exist | for work that is done once, beside work that goes on |
//! | `name` | once in a tree | any number of times | a log must say which node |
//!
//! Left out: `TryCatch`, `ManualSelector`, loops over queues, `SetBlackboard` and `UnsetBlackboard` (use `Script`), nodes
//! that wait for updated entries, `ros_pkg` in includes, expressions in keys. [`Library::load`] reads no files: the caller
//! passes in all of them.
//!
//! As in BehaviorTree.CPP, a child that takes over in a reactive node is started before the one it replaces is halted.
//! Collect commands during a tick and send them afterwards, so that nothing outside sees the overlap.

mod board;
mod inspect;
mod kind;
mod leaf;
mod library;
mod load;
mod machine;
mod node_id;
pub mod nodes;
mod parameters;
mod record;
mod schedule;
mod script;
mod shape;
mod status;
mod template;
mod texts;
mod tree;
mod values;
mod wake;
mod xml;

pub use inspect::{BtlogWriter, NodeView};
pub use leaf::declaration::{Direction, LeafClass, Port};
pub use leaf::port_error::PortError;
pub use leaf::ports::{In, Out, Ports};
pub use leaf::registry::{Condition, Registry};
pub use leaf::spec::{BuildError, NodeSpec};
pub use library::Library;
pub use load::mistake::{LoadError, LoadErrors, Mistake};
pub use machine::{Leaf, LeafError, LeafResult, Tree};
pub use node_id::NodeId;
pub use parameters::SetError;
pub use record::cause::{Cause, FailureRecord, SharedText};
pub use record::changes::StatusChange;
pub use record::error::{NodeError, NodeErrorKind};
pub use schedule::NextTick;
pub use status::{NodeStatus, Status};
pub use template::{InstantiateError, Template};
pub use tree::MAX_TICKS_AT_ONCE;
pub use values::object::{Object, ObjectValue};
pub use values::port_value::PortValue;
pub use values::types::{ObjectType, Type};
pub use values::value::Value;
pub use wake::WakeSignal;
pub use xml::element::{Document, Element};

// The stories use this crate as others do, in the program of its unit tests: one program links faster than two.
#[cfg(test)]
extern crate self as behavior_tree;
#[cfg(test)]
#[path = "../tests/it/main.rs"]
mod stories;
