//! The kind of node that an element names.

use std::ops::RangeInclusive;

use super::attributes::Attributes;
use super::builder::ShapeBuilder;
use super::mistake::Mistake;
use super::mistakes::Mistakes;
use crate::board::Binding;
use crate::kind::Kind;
use crate::leaf::declaration::Port;
use crate::leaf::registry::{LeafKind, Registry};
use crate::nodes;
use crate::nodes::built_in::{BuiltIn, BuiltInPort, Class};
use crate::values::value::Value;
use crate::xml::source::SourceElement;

/// The kind of node that an element names.
pub(super) enum Meaning<'r, Ctx> {
    BuiltIn(&'static BuiltIn, &'static [Port]),
    Leaf(&'r LeafKind<Ctx>),
}

/// The tag and the kind of node that an element names, in the short form `<Name/>` or the long one
/// `<Action ID="Name"/>`.
pub(super) fn meaning<'e, 'r, Ctx>(
    element: SourceElement<'e>,
    registry: &'r Registry<Ctx>,
    mistakes: &mut Mistakes,
) -> Option<(&'e str, Meaning<'r, Ctx>)> {
    let is_long_form = ["Action", "Condition", "Control", "Decorator"].contains(&element.tag());
    let tag = match element.get("ID") {
        Some(id) if is_long_form => id,
        None if is_long_form || element.tag() == Class::SubTree.tag() => {
            let tag = element.tag().to_owned();
            mistakes.add(element.at(), Mistake::MissingAttribute { tag, attribute: "ID" });
            return None;
        }
        _ => element.tag(),
    };
    let (meaning, class, children) = if let Some(kind) = registry.kinds.get(tag) {
        (Meaning::Leaf(kind), kind.class.tag(), 0..=0)
    } else if let Some((built_in, ports)) = nodes::built_in(tag) {
        (Meaning::BuiltIn(built_in, ports), built_in.class.tag(), built_in.children.clone())
    } else {
        let built_ins = nodes::built_ins().map(|built_in| built_in.tag);
        let nearest = mistakes.nearest(tag, built_ins.chain(registry.kinds.keys().map(String::as_str)));
        mistakes.add(element.at(), Mistake::UnknownNode { tag: tag.to_owned(), nearest });
        // What is below the element cannot be checked, because the node that it belongs to is unknown.
        return None;
    };
    if is_long_form && element.tag() != class {
        let (tag, found) = (tag.to_owned(), element.tag().to_owned());
        mistakes.add(element.at(), Mistake::WrongClass { tag, expected: class, found });
    }
    if let Some(mistake) = wrong_children(element, tag, &children) {
        mistakes.add(element.at(), mistake);
    }
    Some((tag, meaning))
}

/// The kind of a built-in node with its parameters.
pub(super) fn built_in_kind<Ctx>(
    built_in: &BuiltIn,
    declared: &[Port],
    attributes: &mut Attributes<'_>,
    builder: &mut ShapeBuilder<'_, Ctx>,
) -> Kind {
    let mut bindings = attributes.bind(built_in.tag, declared);
    let mut arguments = attributes.arguments(built_in.ports, &bindings);
    if built_in.ports.iter().any(BuiltInPort::holds_value) {
        for binding in &mut bindings {
            // A constant may be one of the registry's names for numbers.
            if let Binding::Constant(Value::Text(text)) = binding
                && let Some(number) = attributes.names.constants.get(&**text)
            {
                *binding = Binding::Constant(Value::Int(*number));
            }
        }
        arguments.table = builder.add_table(bindings);
    }
    (built_in.kind)(&arguments)
}

/// The mistake, if a number of children is wrong.
pub(super) fn wrong_children(
    element: SourceElement<'_>,
    tag: &str,
    expected: &RangeInclusive<usize>,
) -> Option<Mistake> {
    let found = element.children().count();
    if expected.contains(&found) {
        return None;
    }
    let expected = match (*expected.start(), *expected.end()) {
        (0, 0) => "no children".to_owned(),
        (1, 1) => "exactly 1 child".to_owned(),
        (least, usize::MAX) => format!("{least} or more children"),
        (least, most) if least == most => format!("exactly {least} children"),
        (least, most) => format!("{least} or {most} children"),
    };
    Some(Mistake::Children { tag: tag.to_owned(), expected, found })
}
