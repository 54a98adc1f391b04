//! What is known about the keys of a tree while it is loaded.

use super::mistake::Mistake;
use super::mistakes::Mistakes;
use crate::board::SlotDef;
use crate::script::check::join;
use crate::values::types::Type;
use crate::values::value::Value;
use crate::xml::source::Place;

/// The keys of a tree, by slot: a key of the outermost tree and the keys connected to it share a slot.
#[derive(Default)]
pub(super) struct Slots(Vec<Slot>);

#[derive(Default)]
struct Slot {
    name: String,
    /// The type that ports declare, and where the first of them does.
    declared: Option<(Type, Place)>,
    /// The type of what expressions assign, if no port declares one.
    assigned: Option<Type>,
    /// A constant given to a subtree. Its type is that of its readers.
    literal: Option<(String, Place)>,
    initial: Option<Value>,
    is_written: bool,
    is_used: bool,
    required: bool,
    open: bool,
    /// A port of any type writes it, so nothing is known about its type.
    takes_anything: bool,
    /// Where it is read.
    reads: Vec<Place>,
}

impl Slots {
    /// Makes a slot for a key.
    pub(super) fn add(&mut self, name: String) -> u32 {
        self.0.push(Slot { name, ..Slot::default() });
        self.0.len() as u32 - 1
    }

    /// The full name of the key, `subtree/key` for that of a subtree.
    pub(super) fn name(&self, slot: u32) -> &str {
        &self.0[slot as usize].name
    }

    /// What is known about the type of the key.
    pub(super) fn ty(&self, slot: u32) -> Type {
        let slot = &self.0[slot as usize];
        slot.declared.map_or(slot.assigned.unwrap_or(Type::Any), |(ty, _)| ty)
    }

    pub(super) fn is_written(&self, slot: u32) -> bool {
        self.0[slot as usize].is_written
    }

    /// The names of the keys that something writes.
    pub(super) fn written(&self) -> impl Iterator<Item = &str> {
        self.0.iter().filter(|slot| slot.is_written).map(|slot| slot.name.as_str())
    }

    pub(super) fn is_used(&self, slot: u32) -> bool {
        self.0[slot as usize].is_used
    }

    /// Something in the tree names the key.
    pub(super) fn note_use(&mut self, slot: u32) {
        self.0[slot as usize].is_used = true;
    }

    pub(super) fn note_read(&mut self, slot: u32, at: Place) {
        self.0[slot as usize].reads.push(at);
    }

    /// An expression makes the key.
    pub(super) fn note_creation(&mut self, slot: u32) {
        self.0[slot as usize].is_written = true;
    }

    /// A port of type `ty` writes the key.
    pub(super) fn note_write(&mut self, slot: u32, ty: Type) {
        let slot = &mut self.0[slot as usize];
        slot.is_written = true;
        slot.takes_anything |= ty == Type::Any;
    }

    /// A port uses the key as a value of type `ty`.
    pub(super) fn declare(&mut self, slot: u32, ty: Type, at: Place, mistakes: &mut Mistakes) {
        let slot = &mut self.0[slot as usize];
        match slot.declared {
            _ if ty == Type::Any => {}
            None => slot.declared = Some((ty, at)),
            Some((other, _)) if other == ty => {}
            Some((other, other_at)) => {
                let other_at = mistakes.describe(other_at);
                let (key, found, other) = (slot.name.clone(), ty.name(), other.name());
                mistakes.add(at, Mistake::KeyType { key, found, other, other_at });
            }
        }
    }

    /// An expression assigns a value of type `ty`. True if the key's type is now known more exactly.
    pub(super) fn infer(&mut self, slot: u32, ty: Type) -> bool {
        let slot = &mut self.0[slot as usize];
        if slot.declared.is_some() || slot.takes_anything || ty == Type::Any {
            return false;
        }
        let joined = slot.assigned.map_or(Some(ty), |assigned| join(assigned, ty));
        let is_news = joined.is_some() && joined != slot.assigned;
        slot.assigned = joined.or(slot.assigned);
        is_news
    }

    /// The key starts with a constant.
    pub(super) fn set_literal(&mut self, slot: u32, text: &str, at: Place) {
        let slot = &mut self.0[slot as usize];
        slot.literal = Some((text.to_owned(), at));
        slot.is_written = true;
    }

    /// Where the constant was given that the key starts with.
    pub(super) fn literal_place(&self, slot: u32) -> Option<Place> {
        self.0[slot as usize].literal.as_ref().map(|(_, at)| *at)
    }

    /// The key can be set from outside; if `required`, every instance needs a value for it.
    pub(super) fn open(&mut self, slot: u32, required: bool) {
        let slot = &mut self.0[slot as usize];
        (slot.is_written, slot.open, slot.required) = (true, true, required);
    }

    /// Reads the constants, each as the type that its readers expect.
    pub(super) fn read_literals(&mut self, mistakes: &mut Mistakes) {
        for slot in &mut self.0 {
            let Some((text, at)) = &slot.literal else {
                continue;
            };
            let ty = slot.declared.map_or(Type::Any, |(ty, _)| ty);
            slot.initial = ty.parse(text);
            match &slot.initial {
                Some(value) if slot.declared.is_none() => slot.assigned = Some(Type::of(value)),
                Some(_) => {}
                None => {
                    let (port, expected, found) = (slot.name.clone(), ty.name().to_owned(), text.clone());
                    mistakes.add(*at, Mistake::BadConstant { port, expected, found });
                }
            }
        }
    }

    /// Finds keys that are read and never written. In a part of other trees, those may write the key: it becomes a
    /// parameter.
    pub(super) fn check_written(&mut self, is_part: bool, mistakes: &mut Mistakes) {
        for number in 0..self.0.len() {
            let slot = &self.0[number];
            if slot.is_written || slot.reads.is_empty() {
                continue;
            }
            if is_part {
                let slot = &mut self.0[number];
                (slot.open, slot.required) = (true, true);
                continue;
            }
            let nearest = mistakes.nearest(&slot.name, self.written());
            for at in &slot.reads {
                mistakes.add(*at, Mistake::Unwritten { key: slot.name.clone(), nearest: nearest.clone() });
            }
        }
    }

    /// The keys for the engine, and their names.
    pub(super) fn finish(self) -> (Vec<SlotDef>, Vec<String>) {
        let types: Vec<Type> = (0..self.0.len()).map(|slot| self.ty(slot as u32)).collect();
        let define = |(slot, ty): (Slot, Type)| {
            let Slot { name, initial, required, open, .. } = slot;
            (SlotDef { ty, initial, required, open }, name)
        };
        self.0.into_iter().zip(types).map(define).unzip()
    }
}
