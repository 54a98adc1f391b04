//! The built-in nodes, one page each with its rule as a table.
//!
//! | children in order | children by urgency or guard | side by side | one of several |
//! |---|---|---|---|
//! | [`Sequence`](sequence) | [`ReactiveSequence`](reactive_sequence) | [`Parallel`](parallel) | [`IfThenElse`](if_then_else) |
//! | [`AsyncSequence`](async_sequence) | [`ReactiveFallback`](reactive_fallback) | [`ParallelAll`](parallel_all) | [`WhileDoElse`](while_do_else) |
//! | [`SequenceWithMemory`](sequence_with_memory) | | | [`Switch2` .. `Switch6`](switch) |
//! | [`Fallback`](fallback) | | | |
//! | [`AsyncFallback`](async_fallback) | | | |
//!
//! | changes an answer | repeats | limits | leaves |
//! |---|---|---|---|
//! | [`Inverter`](inverter) | [`Repeat`](repeat) | [`Timeout`](timeout) | [`AlwaysSuccess`](always_success) |
//! | [`ForceSuccess`](force_success) | [`RetryUntilSuccessful`](retry_until_successful) | [`Delay`](delay) | [`AlwaysFailure`](always_failure) |
//! | [`ForceFailure`](force_failure) | [`KeepRunningUntilFailure`](keep_running_until_failure) | [`RunOnce`](run_once) | [`Sleep`](sleep) |
//! | [`SuccessIsRunning`](success_is_running) | | [`Precondition`](precondition) | [`Script`](script), [`ScriptCondition`](script_condition) |
//!
//! [`SubTree`](sub_tree) puts another tree in its place, and every node may have [pre- and postconditions](conditions).
//!
//! "Resets" on these pages means: back to idle, and halted first if it is running.
//!
//! A new kind is one file here and one line in the list in `nodes/mod.rs`.

pub mod always_failure;
pub mod always_success;
pub mod async_fallback;
pub mod async_sequence;
pub mod conditions;
pub mod delay;
pub mod fallback;
pub mod force_failure;
pub mod force_success;
pub mod if_then_else;
pub mod inverter;
pub mod keep_running_until_failure;
pub mod parallel;
pub mod parallel_all;
pub mod precondition;
pub mod reactive_fallback;
pub mod reactive_sequence;
pub mod repeat;
pub mod retry_until_successful;
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

use std::ops::RangeInclusive;

use crate::kind::{Kind, NodeState, Param};
use crate::port_list::{Direction, Port};
use crate::types::Type;
use crate::xml::element::Element;

/// What an editor calls a built-in node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Class {
    Control,
    Decorator,
    SubTree,
    Action,
    Condition,
}

/// The declaration of a built-in node.
pub(crate) struct BuiltIn {
    pub(crate) tag: &'static str,
    pub(crate) class: Class,
    pub(crate) children: RangeInclusive<usize>,
    pub(crate) ports: &'static [BuiltInPort],
    /// Makes the kind from the values of the ports, in the order of `ports`.
    pub(crate) kind: fn(&[Param]) -> Kind,
}

pub(crate) struct BuiltInPort {
    pub(crate) name: &'static str,
    pub(crate) ty: Type,
    pub(crate) default: Option<&'static str>,
    pub(crate) description: &'static str,
    /// The least number that makes sense.
    pub(crate) min: i32,
}

impl BuiltInPort {
    const fn text(name: &'static str, default: Option<&'static str>, description: &'static str) -> Self {
        BuiltInPort { name, ty: Type::Text, default, description, min: i32::MIN }
    }

    const fn number(name: &'static str, default: Option<&'static str>, description: &'static str) -> Self {
        BuiltInPort { name, ty: Type::Int, default, description, min: i32::MIN }
    }

    const fn milliseconds(name: &'static str, description: &'static str) -> Self {
        BuiltInPort { name, ty: Type::Int, default: None, description, min: 0 }
    }

    pub(crate) fn to_port(&self) -> Port {
        let mut port = Port::of_type(self.name, Direction::Input, self.ty).describe(self.description);
        port.default = self.default.map(str::to_owned);
        port
    }
}

impl BuiltIn {
    /// What a `TreeNodesModel` says of it.
    pub(crate) fn model(&self) -> Element {
        let ports = self.ports.iter().map(|port| port.to_port().model());
        Element::new(self.class.word()).attribute("ID", self.tag).children(ports)
    }
}

impl Class {
    /// The element that an editor declares it with.
    pub(crate) const fn word(self) -> &'static str {
        match self {
            Class::Control => "Control",
            Class::Decorator => "Decorator",
            Class::SubTree => "SubTree",
            Class::Action => "Action",
            Class::Condition => "Condition",
        }
    }
}

/// No upper limit to the number of children.
const MANY: usize = usize::MAX;

const BUILT_INS: &[&BuiltIn] = &[
    &sequence::BUILT_IN,
    &async_sequence::BUILT_IN,
    &sequence_with_memory::BUILT_IN,
    &reactive_sequence::BUILT_IN,
    &fallback::BUILT_IN,
    &async_fallback::BUILT_IN,
    &reactive_fallback::BUILT_IN,
    &parallel::BUILT_IN,
    &parallel_all::BUILT_IN,
    &if_then_else::BUILT_IN,
    &while_do_else::BUILT_IN,
    &switch::SWITCH_2,
    &switch::SWITCH_3,
    &switch::SWITCH_4,
    &switch::SWITCH_5,
    &switch::SWITCH_6,
    &inverter::BUILT_IN,
    &force_success::BUILT_IN,
    &force_failure::BUILT_IN,
    &keep_running_until_failure::BUILT_IN,
    &success_is_running::BUILT_IN,
    &retry_until_successful::BUILT_IN,
    &repeat::BUILT_IN,
    &run_once::BUILT_IN,
    &timeout::BUILT_IN,
    &delay::BUILT_IN,
    &sub_tree::BUILT_IN,
    &always_success::BUILT_IN,
    &always_failure::BUILT_IN,
    &precondition::BUILT_IN,
    &sleep::BUILT_IN,
    &script::BUILT_IN,
    &script_condition::BUILT_IN,
];

pub(crate) fn built_ins() -> impl Iterator<Item = &'static BuiltIn> {
    BUILT_INS.iter().copied()
}

pub(crate) fn built_in(tag: &str) -> Option<&'static BuiltIn> {
    built_ins().find(|it| it.tag == tag)
}

pub(crate) fn is_built_in(tag: &str) -> bool {
    built_in(tag).is_some()
}

/// What a node forgets when it is halted.
pub(crate) fn forget(kind: Kind, state: &mut NodeState) {
    match kind {
        Kind::SequenceWithMemory | Kind::RunOnce { .. } => {}
        _ => *state = NodeState::default(),
    }
}
