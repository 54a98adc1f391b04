//! What stands at a node: its kind, its parameters, its ports and conditions.

use super::expand::Expander;
use super::mistake::Mistake;
use super::ports::{Binder, CONDITION_ATTRIBUTES, key_of};
use super::scripts::Wanted;
use crate::board::{Binding, BoundPort};
use crate::kind::{Kind, Param};
use crate::nodes::{self, BuiltIn, Class};
use crate::port_list::Port;
use crate::registry::{LeafClass, LeafKind};
use crate::shape::{Conditions, LeafDef, NONE};
use crate::status::Status;
use crate::value::Value;
use crate::xml::element::{Attribute, Element};

/// What stands at a node.
pub(super) enum Meaning<Ctx> {
    BuiltIn(&'static BuiltIn),
    Leaf(LeafKind<Ctx>),
}

impl<'f, Ctx> Expander<'_, 'f, Ctx> {
    /// The kind of node an element asks for, in the short form `<Name/>` or the long one `<Action ID="Name"/>`.
    pub(super) fn meaning(&mut self, element: &'f Element) -> Option<(&'f str, Meaning<Ctx>)> {
        let long_form = ["Action", "Condition", "Control", "Decorator"].contains(&element.tag.as_str());
        let tag = match element.get("ID") {
            Some(id) if long_form => id,
            None if long_form || element.tag == "SubTree" => {
                let tag = element.tag.clone();
                self.mistakes.add(element.at, Mistake::MissingAttribute { tag, attribute: "ID" });
                return None;
            }
            _ => element.tag.as_str(),
        };
        let (meaning, class, takes) = if let Some(built_in) = nodes::built_in(tag) {
            (Meaning::BuiltIn(built_in), built_in.class.word(), built_in.children.clone())
        } else if let Some(kind) = self.forest.registry.kinds.get(tag) {
            let class = if kind.class == LeafClass::Condition { "Condition" } else { "Action" };
            (Meaning::Leaf(kind.clone()), class, 0..=0)
        } else {
            let known =
                nodes::built_ins().map(|it| it.tag).chain(self.forest.registry.kinds.keys().map(String::as_str));
            let nearest = self.mistakes.nearest(tag, known);
            self.mistakes.add(element.at, Mistake::UnknownNode { tag: tag.to_owned(), nearest });
            // What is below it may have mistakes of its own, but nobody can say what belongs there.
            return None;
        };
        if long_form && element.tag != class {
            let mistake = Mistake::WrongClass { tag: tag.to_owned(), expected: element.tag.clone() };
            self.mistakes.add(element.at, mistake);
        }
        if !takes.contains(&element.children.len()) {
            let (found, expected) = (count(element.children.len()), expected_children(*takes.start(), *takes.end()));
            self.mistakes.add(element.at, Mistake::Children { tag: tag.to_owned(), found, expected });
        }
        Some((tag, meaning))
    }

    pub(super) fn built_in(&mut self, built_in: &BuiltIn, element: &Element, scope: usize) -> Kind {
        if built_in.class == Class::SubTree {
            return Kind::SubTree;
        }
        let declared: Vec<Port> = built_in.ports.iter().map(nodes::BuiltInPort::to_port).collect();
        let mut bindings = self.bind(element, built_in.tag, &declared, scope);
        let params: Vec<Param> =
            built_in.ports.iter().zip(&bindings).map(|(port, binding)| self.param(element, port, binding)).collect();
        let kind = (built_in.kind)(&params);
        if let Kind::Switch(_) = kind {
            bindings.iter_mut().for_each(|binding| self.name_to_number(binding));
            self.shape.switches.push(bindings);
            return Kind::Switch(self.shape.switches.len() as u32 - 1);
        }
        match kind {
            Kind::Script(_) => Kind::Script(self.script_port(element, "code", Wanted::Effects, scope)),
            Kind::ScriptCondition(_) => {
                Kind::ScriptCondition(self.script_port(element, "code", Wanted::Condition, scope))
            }
            Kind::Precondition { .. } => Kind::Precondition {
                script: self.script_port(element, "if", Wanted::Condition, scope),
                otherwise: self.otherwise(element),
            },
            kind => kind,
        }
    }

    pub(super) fn leaf(&mut self, kind: LeafKind<Ctx>, element: &Element, tag: &str, scope: usize, at: usize) -> Kind {
        let bindings = self.bind(element, tag, &kind.ports, scope);
        let bound = kind.ports.iter().zip(bindings);
        let bound = bound.map(|(port, binding)| BoundPort { name: port.name.as_str().into(), binding }).collect();
        self.shape.leaves.push(LeafDef {
            node: at as u32,
            class: kind.class,
            declared: kind.ports,
            bound,
            at: element.at,
        });
        self.factories.push(kind.factory);
        Kind::Leaf(self.shape.leaves.len() as u32 - 1)
    }

    /// The pre- and postconditions of a node, as an index into the shape's.
    pub(super) fn conditions(&mut self, element: &Element, scope: usize) -> u32 {
        let is_plain = |attribute: &Attribute| !CONDITION_ATTRIBUTES.contains(&attribute.name.as_str());
        if element.attributes.iter().all(is_plain) {
            return NONE;
        }
        let mut script = |name: &str, wanted: Wanted| match element.find(name) {
            Some(attribute) => self.script(attribute, wanted, scope),
            None => NONE,
        };
        let conditions = Conditions {
            failure_if: script("_failureIf", Wanted::Condition),
            success_if: script("_successIf", Wanted::Condition),
            skip_if: script("_skipIf", Wanted::Condition),
            while_true: script("_while", Wanted::Condition),
            on_success: script("_onSuccess", Wanted::Effects),
            on_failure: script("_onFailure", Wanted::Effects),
            on_halted: script("_onHalted", Wanted::Effects),
            post: script("_post", Wanted::Effects),
        };
        self.shape.conditions.push(conditions);
        self.shape.conditions.len() as u32 - 1
    }

    /// A constant that is one of the registry's names for numbers.
    fn name_to_number(&self, binding: &mut Binding) {
        if let Binding::Constant(Value::Text(text)) = binding
            && let Some(number) = self.forest.registry.constants.get(&**text)
        {
            *binding = Binding::Constant(Value::Int(*number));
        }
    }

    fn param(&mut self, element: &Element, port: &nodes::BuiltInPort, binding: &Binding) -> Param {
        let number = match binding {
            Binding::Slot(slot) => return Param::Slot(*slot),
            Binding::Constant(Value::Bool(flag)) => Some(i32::from(*flag)),
            Binding::Constant(Value::Int(number)) => i32::try_from(*number).ok().filter(|it| port.min <= *it),
            Binding::Constant(_) | Binding::Unbound => Some(0),
        };
        if number.is_none() {
            let (text, at) = element.find(port.name).map_or(("", element.at), |it| (it.value.as_str(), it.at));
            let (port, text) = (port.name.to_owned(), text.to_owned());
            let ty = "number of this range".to_owned();
            self.mistakes.add(at, Mistake::BadConstant { port, text, ty });
        }
        Param::Constant(number.unwrap_or(0))
    }

    fn script_port(&mut self, element: &Element, port: &str, wanted: Wanted, scope: usize) -> u32 {
        match element.find(port) {
            None => NONE,
            Some(attribute) if key_of(port, &attribute.value).is_some() => {
                let (port, text, ty) = (port.to_owned(), attribute.value.clone(), "expression".to_owned());
                self.mistakes.add(attribute.at, Mistake::BadConstant { port, text, ty });
                NONE
            }
            Some(attribute) => self.script(attribute, wanted, scope),
        }
    }

    fn otherwise(&mut self, element: &Element) -> Status {
        let Some(attribute) = element.find("else") else {
            return Status::Failure;
        };
        match attribute.value.as_str() {
            "SUCCESS" => Status::Success,
            "FAILURE" => Status::Failure,
            "SKIPPED" => Status::Skipped,
            "RUNNING" => Status::Running,
            _ => {
                let (port, text, ty) = (attribute.name.clone(), attribute.value.clone(), "status".to_owned());
                self.mistakes.add(attribute.at, Mistake::BadConstant { port, text, ty });
                Status::Failure
            }
        }
    }

    fn bind(&mut self, element: &Element, tag: &str, declared: &[Port], scope: usize) -> Vec<Binding> {
        Binder { scopes: &mut self.scopes, scope, mistakes: self.mistakes }.bind(element, tag, declared)
    }
}

pub(super) fn count(children: usize) -> String {
    match children {
        0 => "no child".to_owned(),
        1 => "1 child".to_owned(),
        more => format!("{more} children"),
    }
}

fn expected_children(least: usize, most: usize) -> String {
    match (least, most) {
        (0, 0) => "none".to_owned(),
        (1, 1) => "exactly 1 child".to_owned(),
        (least, usize::MAX) => format!("{least} or more"),
        (least, most) if least == most => format!("exactly {least}"),
        (least, most) => format!("{least} or {most}"),
    }
}
