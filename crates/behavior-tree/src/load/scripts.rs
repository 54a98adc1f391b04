//! The expressions of a tree: parsed, their names resolved, their types inferred and checked.

use std::collections::BTreeMap;

use super::keys::{Keys, is_valid_key};
use super::mistake::Mistake;
use super::mistakes::Mistakes;
use super::slots::Slots;
use crate::script::check::{self, TypeError};
use crate::script::expr::{Assignment, Expr, Use};
use crate::script::parse::parse;
use crate::script::{Purpose, Script};
use crate::shape::NONE;
use crate::values::types::Type;
use crate::values::value::Value;
use crate::xml::source::{Place, SourceAttribute};

/// What names mean in the expressions of one node.
pub(super) struct Names<'a> {
    pub(super) keys: &'a mut Keys,
    pub(super) scope: usize,
    /// The registry's names for numbers.
    pub(super) constants: &'a BTreeMap<String, i64>,
}

/// The expressions of a tree.
#[derive(Default)]
pub(super) struct Scripts {
    scripts: Vec<Script>,
    /// Of every script, where it is written and what for.
    uses: Vec<(Place, Purpose)>,
}

/// The longest chain of keys that get their types from one another.
const MAX_PASSES: usize = 64;

impl Scripts {
    /// Compiles the expression in an attribute. Returns its index, or [`NONE`] if it has a mistake.
    pub(super) fn compile(
        &mut self,
        attribute: SourceAttribute<'_>,
        purpose: Purpose,
        names: &mut Names<'_>,
        mistakes: &mut Mistakes,
    ) -> u32 {
        let (text, at) = (attribute.value, attribute.at);
        let mut invalid = None;
        let parsed = parse(text, &mut |name| {
            if let Some(number) = names.constants.get(name) {
                return Expr::Literal(Value::Int(*number));
            }
            if !is_valid_key(name) {
                invalid = Some(format!("`{name}` is not a valid key"));
            }
            Expr::Key(names.keys.resolve(names.scope, name))
        });
        let statements = match (parsed.map_err(|error| error.reason), invalid) {
            (Ok(statements), None) => statements,
            (Err(reason), _) | (_, Some(reason)) => {
                mistakes.add(at, Mistake::Expression { text: text.to_owned(), reason, nearest: None });
                return NONE;
            }
        };
        let slots = &mut names.keys.slots;
        for statement in &statements {
            statement.uses(&mut |key_use| match key_use {
                Use::Read(key) => slots.note_read(key, at),
                Use::Assign(key, Assignment::Create, _) => slots.note_creation(key),
                Use::Assign(..) => {}
            });
        }
        self.scripts.push(Script { text: text.into(), statements });
        self.uses.push((at, purpose));
        self.scripts.len() as u32 - 1
    }

    /// Gives keys that only expressions write the type of what is assigned to them.
    pub(super) fn infer_types(&self, slots: &mut Slots) {
        for _ in 0..MAX_PASSES {
            let mut has_news = false;
            for statement in self.scripts.iter().flat_map(|script| &script.statements) {
                statement.uses(&mut |key_use| {
                    if let Use::Assign(key, how, value) = key_use
                        && let Ok(ty) = assigned_type(slots, key, how, value)
                    {
                        has_news |= slots.infer(key, ty);
                    }
                });
            }
            if !has_news {
                return;
            }
        }
    }

    /// Reports type errors, and assignments to keys that nothing makes. In a part of other trees, those may make them.
    pub(super) fn check(&self, slots: &Slots, is_part: bool, mistakes: &mut Mistakes) {
        let key_type = |key: u32| slots.ty(key);
        let key_name = |key: u32| slots.name(key).to_owned();
        for (script, (at, purpose)) in self.scripts.iter().zip(&self.uses) {
            let add = |reason: String, nearest: Option<String>, mistakes: &mut Mistakes| {
                mistakes.add(*at, Mistake::Expression { text: script.text.to_string(), reason, nearest });
            };
            let mut last = Ok(Type::Bool);
            for statement in &script.statements {
                last = check::type_of(statement, &key_type);
                if let Err(error) = &last {
                    add(error.describe(&key_name), None, mistakes);
                }
                statement.uses(&mut |key_use| {
                    if let Use::Assign(key, ..) = key_use
                        && !slots.is_written(key)
                        && !is_part
                    {
                        let name = slots.name(key);
                        let reason = format!("key `{name}` does not exist; `:=` makes it");
                        add(reason, mistakes.nearest(name, slots.written()), mistakes);
                    }
                });
            }
            if let (Purpose::Condition, Ok(ty)) = (purpose, last)
                && let Err(error @ TypeError::NoCondition(_)) = check::condition(ty)
            {
                add(error.describe(&key_name), None, mistakes);
            }
        }
    }

    pub(super) fn finish(self) -> Vec<Script> {
        self.scripts
    }
}

fn assigned_type(slots: &Slots, key: u32, how: Assignment, value: &Expr) -> Result<Type, TypeError> {
    let key_type = |key: u32| slots.ty(key);
    match how {
        Assignment::Create | Assignment::Set => check::type_of(value, &key_type),
        Assignment::With(operator) => {
            let before = Box::new(Expr::Key(key));
            check::type_of(&Expr::Binary(operator, before, Box::new(value.clone())), &key_type)
        }
    }
}
