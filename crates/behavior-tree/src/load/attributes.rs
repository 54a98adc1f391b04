//! The attributes of one node: ports, expressions, pre- and postconditions.

use super::keys::key_of;
use super::mistake::Mistake;
use super::mistakes::Mistakes;
use super::ports::Binder;
use super::scripts::{Names, Scripts};
use crate::board::Binding;
use crate::kind::Param;
use crate::leaf::declaration::Port;
use crate::nodes::built_in::{Arguments, BuiltInPort, Holds};
use crate::nodes::parallel::threshold;
use crate::script::Purpose;
use crate::shape::{Conditions, NONE};
use crate::status::Status;
use crate::values::value::Value;
use crate::xml::source::SourceElement;

/// The attributes of pre- and postconditions, which every node may have.
const CONDITIONS: [&str; 8] =
    ["_failureIf", "_successIf", "_skipIf", "_while", "_onSuccess", "_onFailure", "_onHalted", "_post"];

/// Attributes that editors and loggers write, and that the engine ignores.
const OF_EDITORS: [&str; 3] = ["_description", "_uid", "_fullpath"];

/// Reads the attributes of one node.
pub(super) struct Attributes<'a> {
    pub(super) element: SourceElement<'a>,
    pub(super) names: Names<'a>,
    pub(super) scripts: &'a mut Scripts,
    pub(super) mistakes: &'a mut Mistakes,
}

impl Attributes<'_> {
    /// Binds the ports, in the order of `declared`.
    pub(super) fn bind(&mut self, tag: &str, declared: &[Port]) -> Vec<Binding> {
        let mut binder = Binder { keys: self.names.keys, scope: self.names.scope, mistakes: self.mistakes };
        binder.bind(self.element, tag, declared)
    }

    /// The values of the ports of a built-in node, except for [`Arguments::table`].
    pub(super) fn arguments(&mut self, ports: &[BuiltInPort], bindings: &[Binding]) -> Arguments {
        let mut arguments = Arguments { numbers: Vec::new(), script: NONE, status: Status::Failure, table: NONE };
        for (port, binding) in ports.iter().zip(bindings) {
            match port.holds {
                Holds::Number { min } => arguments.numbers.push(self.number(port.name, min, binding)),
                Holds::Flag => arguments.numbers.push(self.number(port.name, 0, binding)),
                Holds::Count => arguments.numbers.push(self.count(port.name, binding)),
                Holds::Script(purpose) => arguments.script = self.script(port.name, purpose),
                Holds::Status => arguments.status = self.status(port.name),
                Holds::Value => {}
            }
        }
        arguments
    }

    /// The pre- and postconditions, if there are any.
    pub(super) fn conditions(&mut self) -> Option<Conditions> {
        if !self.element.attributes().any(|attribute| CONDITIONS.contains(&attribute.name)) {
            return None;
        }
        Some(Conditions {
            failure_if: self.compile("_failureIf", Purpose::Condition),
            success_if: self.compile("_successIf", Purpose::Condition),
            skip_if: self.compile("_skipIf", Purpose::Condition),
            while_true: self.compile("_while", Purpose::Condition),
            on_success: self.compile("_onSuccess", Purpose::Effects),
            on_failure: self.compile("_onFailure", Purpose::Effects),
            on_halted: self.compile("_onHalted", Purpose::Effects),
            post: self.compile("_post", Purpose::Effects),
        })
    }

    /// Finds misspelt attributes among those with an underscore. Unknown ones that resemble none of ours belong to an
    /// editor.
    pub(super) fn check_reserved(&mut self, also_known: &[&str]) {
        for attribute in self.element.attributes().filter(|attribute| attribute.name.starts_with('_')) {
            let name = attribute.name;
            let mut known = CONDITIONS.iter().chain(also_known).copied();
            if known.clone().any(|known| known == name) || OF_EDITORS.contains(&name) {
                continue;
            }
            if let Some(nearest) = self.mistakes.nearest(name, known.by_ref()) {
                let mistake = Mistake::UnknownAttribute { attribute: name.to_owned(), nearest: Some(nearest) };
                self.mistakes.add(attribute.at, mistake);
            }
        }
    }

    fn number(&mut self, port: &str, min: i32, binding: &Binding) -> Param {
        let number = match binding {
            Binding::Slot(slot) => return Param::Slot(*slot),
            Binding::Constant(Value::Bool(flag)) => i32::from(*flag),
            Binding::Constant(Value::Int(number)) => match i32::try_from(*number) {
                Ok(number) if min <= number => number,
                _ => {
                    self.refuse(port, &format!("an integer from {min} to {}", i32::MAX));
                    0
                }
            },
            // A mistake that was reported when the port was bound.
            Binding::Constant(_) | Binding::Unbound => 0,
        };
        Param::Constant(number)
    }

    fn count(&mut self, port: &'static str, binding: &Binding) -> Param {
        let param = self.number(port, i32::MIN, binding);
        let children = self.element.children().count() as u32;
        if let Param::Constant(count) = param
            && children < threshold(count, children)
        {
            let at = self.element.find(port).map_or(self.element.at(), |attribute| attribute.at);
            self.mistakes.add(at, Mistake::Count { port, count, children });
        }
        param
    }

    fn script(&mut self, port: &str, purpose: Purpose) -> u32 {
        let is_key = self.element.get(port).is_some_and(|text| key_of(port, text).is_some());
        if is_key {
            self.refuse(port, "an expression, not a key");
            return NONE;
        }
        self.compile(port, purpose)
    }

    fn status(&mut self, port: &str) -> Status {
        match self.element.get(port) {
            None | Some("FAILURE") => Status::Failure,
            Some("SUCCESS") => Status::Success,
            Some("SKIPPED") => Status::Skipped,
            Some("RUNNING") => Status::Running,
            Some(_) => {
                self.refuse(port, "SUCCESS, FAILURE, SKIPPED or RUNNING");
                Status::Failure
            }
        }
    }

    /// The expression in an attribute, if the node has it.
    fn compile(&mut self, attribute: &str, purpose: Purpose) -> u32 {
        match self.element.find(attribute) {
            Some(attribute) => self.scripts.compile(attribute, purpose, &mut self.names, self.mistakes),
            None => NONE,
        }
    }

    fn refuse(&mut self, port: &str, expected: &str) {
        if let Some(attribute) = self.element.find(port) {
            let (port, expected, found) = (port.to_owned(), expected.to_owned(), attribute.value.to_owned());
            self.mistakes.add(attribute.at, Mistake::BadConstant { port, expected, found });
        }
    }
}
