//! Behavior trees with the semantics of BehaviorTree.CPP 4: event-driven, checked when loaded, inspectable.
//!
//! ```
//! use std::time::Duration;
//! use behavior_tree::{Library, Registry, Status};
//!
//! let mut registry = Registry::new();
//! registry.condition("BatteryOk", [], |level: &mut f64, _| Ok(20.0 < *level));
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
//! | write an action or a condition | [`Leaf`], [`Ports`], [`Status`] |
//! | tell the engine of it | [`Registry`], [`Port`], [`NodeSpec`] |
//! | load tree files and see what is wrong with them | [`Library`], [`LoadErrors`], [`Mistake`] |
//! | make a tree, tick it, halt it | [`Template`], [`Tree`] |
//! | know when to tick it | [`Tree::next_tick`], [`WakeSignal`] |
//! | look up what a built-in node does | [`nodes`], a page each |
//! | write expressions | [`nodes::conditions`] |
//! | watch a tree | [`Tree::statuses`], [`Tree::take_changes`], [`Tree::to_text`] and its like, [`BtlogWriter`] |
//! | know why a node failed | [`Ports::because`], [`Tree::why`], [`Tree::faults`] |
//! | build tree files in a program, or export models for Groot2 | [`Document`], [`Element`], [`Registry::models`] |
//!
//! # How it runs
//!
//! A tick is a function call: it begins at the root, asks leaves, and returns. What a leaf needs from the world, and what
//! it wants done, it finds in the `Ctx` that the caller hands in; collected there, the wishes of one tick can be sent
//! together afterwards. Time is an argument. A leaf that waits for something answers [`Status::Running`] and sees to it
//! that [`Ports::waker`] is called, or names a time with [`Ports::tick_at`]; the caller sleeps until then.
//! [`Tree::tick_once`] goes on as long as nodes ask to, so that everything one event leads to has happened when it
//! returns.
//!
//! What is not there: threads, locks, a clock, an executor. A steady tick does not allocate. A leaf that panics or errs
//! fails its node, is halted and is recorded as a [`Fault`], and the tree lives (a program built with `panic = "abort"` gives
//! that up for panics).
//!
//! A leaf may hold a [`Tree`] of its own, made at run time from a [`Template`] with parameters: see [`Ports::tick_tree`]
//! and [`Leaf::subtree`].
//!
//! # What a tree file may hold
//!
//! BehaviorTree.CPP's XML, format 4, so that Groot2 opens and edits it. Everything is checked when it is loaded, and all
//! mistakes of all files are reported at once with file, line, column and a hint: unknown nodes, ports and trees, missing
//! ports, constants and keys of the wrong type, keys that nothing writes, expressions, names used twice. The keys that a
//! tree wants from outside are the ports its model declares:
//!
//! ```xml
//! <TreeNodesModel>
//!   <SubTree ID="Step"> <input_port name="goal" type="Goal"/> </SubTree>
//! </TreeNodesModel>
//! ```
//!
//! # Where it departs from BehaviorTree.CPP 4.10
//!
//! The statuses, the order of ticks and halts and the answers are those of BehaviorTree.CPP, compared on thousands of
//! random trees. On purpose, this is different:
//!
//! | | here | there | because |
//! |---|---|---|---|
//! | an error in a leaf | fails the node, is recorded, the tree lives ([`FaultPolicy`]) | an exception leaves the tree as it was | in flight somebody must go on |
//! | what a node cannot do with its children (thresholds, counts) | found when loading | thrown at a tick | |
//! | types of keys, keys nobody writes | found when loading, no conversion from text at run time | thrown at a tick | |
//! | a condition that answers running | a fault | allowed | it would never be halted |
//! | `IfThenElse`, `WhileDoElse` with a skipped condition | answer skipped | throw | |
//! | `Timeout` | looks at the time when it is ticked, and asks to be | halts its child from a thread of its own | a tree belongs to one thread |
//! | `Delay` of 0 | ticks its child at once | at the next tick | |
//! | `tick_once` | goes on 100 times at most | for ever | a loop must not hang its caller |
//! | halting the whole tree | `_onHalted` only of nodes that ran | of all nodes | a node that did not run was not halted |
//! | `&&` and `\|\|` | the right side only if needed | always | |
//! | numbers in expressions | whole ones stay whole, overflow is an error | all are real | a count is not 2.9999 |
//! | assigning a real number to a whole one | found when loading | thrown if it does not fit | |
//! | `<` and `&` in attributes | as XML wants it, `&lt;` and `&amp;` | also bare | |
//! | `SuccessIsRunning` | is there | is not | for work beside which something goes on |
//! | `name` | once in a tree | any number of times | a log must say which node |
//!
//! Not there: `TryCatch`, `ManualSelector`, loops over queues, `SetBlackboard` and `UnsetBlackboard` (`Script` does that),
//! nodes that watch for updated entries, `ros_pkg` in includes, expressions kept in keys. [`Library::load`] is given all
//! files and reads none by itself.
//!
//! As there, a child that takes over in a reactive node is started before the one it replaces is halted. Collect commands
//! during a tick and send them afterwards, and nobody sees the overlap.

mod board;
mod call;
mod cause;
mod fault;
mod inspect;
mod kind;
mod leaf;
mod library;
mod load;
pub mod nodes;
mod port_error;
mod port_list;
mod port_value;
mod ports;
mod registry;
mod ring;
mod run;
mod script;
mod shape;
mod spec;
mod status;
mod template;
mod tree;
mod types;
mod value;
mod wake;
mod xml;

pub use cause::{Cause, FailureRecord, Words};
pub use fault::{Fault, FaultKind, FaultPolicy};
pub use inspect::{BtlogWriter, NodeView};
pub use leaf::{Leaf, LeafError, LeafResult};
pub use library::Library;
pub use load::mistake::{LoadError, LoadErrors, Mistake};
pub use port_error::PortError;
pub use port_list::{Direction, Port};
pub use port_value::{Object, PortValue};
pub use ports::{In, Out, Ports};
pub use registry::{LeafClass, Registry};
pub use ring::StatusChange;
pub use spec::{BuildError, NodeSpec};
pub use status::{NodeStatus, Status};
pub use template::{InstantiateError, Template};
pub use tree::{MAX_TICKS_AT_ONCE, NextTick, NodeId, SetError, Tree};
pub use types::{ObjectType, Type};
pub use value::{ObjectValue, Value, ValueType};
pub use wake::WakeSignal;
pub use xml::element::{Document, Element};
