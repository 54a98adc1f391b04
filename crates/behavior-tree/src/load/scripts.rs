//! The expressions of a tree: read, their names resolved, their types found and checked.

use super::expand::Expander;
use super::mistake::Mistake;
use super::mistakes::Mistakes;
use super::ports::is_usable_key;
use super::scope::Slot;
use crate::script::Script;
use crate::script::check::{self, TypeError};
use crate::script::expr::{Assignment, Expr, Use};
use crate::script::parse::parse;
use crate::shape::NONE;
use crate::types::Type;
use crate::value::Value;
use crate::xml::element::{Attribute, Place};

/// The expressions found so far.
#[derive(Default)]
pub(crate) struct Scripts {
    pub(crate) scripts: Vec<Script>,
    pub(super) places: Vec<(Place, Wanted)>,
}

/// What an expression is for.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Wanted {
    /// True or false.
    Condition,
    /// Its effects.
    Effects,
}

/// A chain of keys that get their types from one another may be this long.
const MAX_PASSES: usize = 64;

impl<Ctx> Expander<'_, '_, Ctx> {
    /// Reads the expression in an attribute; answers its index, or [`NONE`] if it has a mistake.
    pub(super) fn script(&mut self, attribute: &Attribute, wanted: Wanted, scope: usize) -> u32 {
        let (text, at) = (&attribute.value, attribute.at);
        let (scopes, constants) = (&mut self.scopes, &self.forest.registry.constants);
        let mut bad_key = None;
        let parsed = parse(text, &mut |name| {
            if let Some(number) = constants.get(name) {
                return Expr::Literal(Value::Int(*number));
            }
            if !is_usable_key(name) {
                bad_key = Some(format!("`{name}` is not a usable key"));
            }
            Expr::Key(scopes.resolve(scope, name))
        });
        let statements = match (parsed.map_err(|error| error.reason), bad_key) {
            (Ok(statements), None) => statements,
            (Err(reason), _) | (_, Some(reason)) => {
                self.mistakes.add(at, Mistake::Expression { text: text.clone(), reason, nearest: None });
                return NONE;
            }
        };
        for statement in &statements {
            statement.uses(&mut |it| match it {
                Use::Read(key) => scopes.slots[key as usize].reads.push(at),
                Use::Assign(key, Assignment::Create, _) => scopes.slots[key as usize].is_written = true,
                Use::Assign(..) => {}
            });
        }
        self.scripts.scripts.push(Script { text: text.as_str().into(), statements });
        self.scripts.places.push((at, wanted));
        self.scripts.scripts.len() as u32 - 1
    }
}

impl Scripts {
    /// Gives the keys that only expressions write the type of what is assigned to them.
    pub(crate) fn find_types(&self, slots: &mut [Slot]) {
        for _ in 0..MAX_PASSES {
            let mut has_changed = false;
            for statement in self.scripts.iter().flat_map(|script| &script.statements) {
                statement.uses(&mut |it| {
                    if let Use::Assign(key, how, value) = it {
                        has_changed |= assign_type(slots, key, how, value);
                    }
                });
            }
            if !has_changed {
                return;
            }
        }
    }

    /// Reports what does not fit. In a part of other trees, those others may make the keys it assigns to.
    pub(crate) fn check(&self, slots: &[Slot], is_part: bool, mistakes: &mut Mistakes) {
        let key_type = |key: u32| slots[key as usize].ty();
        let name = |key: u32| slots[key as usize].name.clone();
        for (script, (at, wanted)) in self.scripts.iter().zip(&self.places) {
            let complain = |reason: String, nearest: Option<String>, mistakes: &mut Mistakes| {
                mistakes.add(*at, Mistake::Expression { text: script.text.to_string(), reason, nearest });
            };
            let mut last = Ok(Type::Bool);
            for statement in &script.statements {
                last = check::type_of(statement, &key_type);
                if let Err(error) = &last {
                    complain(error.describe(&name), None, mistakes);
                }
                statement.uses(&mut |it| {
                    if let Use::Assign(key, _, _) = it {
                        let slot = &slots[key as usize];
                        if !slot.is_written && !is_part {
                            let written = slots.iter().filter(|slot| slot.is_written).map(|slot| slot.name.as_str());
                            let reason = format!("`{}` does not exist, `:=` would make it", slot.name);
                            complain(reason, mistakes.nearest(&slot.name, written), mistakes);
                        }
                    }
                });
            }
            let verdict = last.and_then(|ty| check::condition("is it true?", ty));
            if let (Wanted::Condition, Err(TypeError::Misfit("is it true?", ty))) = (wanted, verdict) {
                complain(format!("{} is neither true nor false", ty.name()), None, mistakes);
            }
        }
    }
}

fn assign_type(slots: &mut [Slot], key: u32, how: Assignment, value: &Expr) -> bool {
    let found = {
        let key_type = |key: u32| slots[key as usize].ty();
        match how {
            Assignment::Create | Assignment::Set => check::type_of(value, &key_type),
            Assignment::With(operator) => {
                let before = Box::new(Expr::Key(key));
                check::type_of(&Expr::Binary(operator, before, Box::new(value.clone())), &key_type)
            }
        }
    };
    let slot = &mut slots[key as usize];
    let Ok(found) = found else {
        return false;
    };
    if slot.declared.is_some() || slot.takes_anything || found == Type::Any {
        return false;
    }
    let joined = slot.assigned.map_or(Some(found), |before| check::join(before, found));
    let has_changed = joined.is_some() && joined != slot.assigned;
    slot.assigned = joined.or(slot.assigned);
    has_changed
}
