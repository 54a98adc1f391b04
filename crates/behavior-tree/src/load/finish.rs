//! What can be said only when a whole tree is known: the types of keys, who writes them, whether factories agree.

use std::task::Waker;

use super::expand::Expander;
use super::mistake::Mistake;
use crate::kind::{Kind, Param};
use crate::nodes;
use crate::shape::SlotDef;
use crate::template::spec_of;
use crate::types::Type;
use crate::xml::element::Element;

impl<Ctx> Expander<'_, '_, Ctx> {
    pub(super) fn check_thresholds(&mut self, element: &Element, kind: Kind, children: u32) {
        let thresholds = match kind {
            Kind::Parallel { success, failure } => vec![("success_count", success), ("failure_count", failure)],
            Kind::ParallelAll { max_failures } => vec![("max_failures", max_failures)],
            _ => return,
        };
        for (port, param) in thresholds {
            let Param::Constant(count) = param else {
                continue;
            };
            if children < nodes::parallel::threshold(count, children) {
                let at = element.find(port).map_or(element.at, |it| it.at);
                self.mistakes.add(at, Mistake::Threshold { count, children });
            }
        }
    }

    pub(super) fn finish(&mut self, is_part: bool) {
        for slot in 0..self.scopes.slots.len() {
            self.finish_literal(slot);
        }
        self.scripts.find_types(&mut self.scopes.slots);
        self.scripts.check(&self.scopes.slots, is_part, self.mistakes);
        self.shape.scripts = std::mem::take(&mut self.scripts.scripts);
        for slot in 0..self.scopes.slots.len() {
            self.check_written(slot, is_part);
        }
        let slots = std::mem::take(&mut self.scopes.slots);
        for slot in slots {
            let ty = slot.ty();
            let (initial, required, open) = (slot.initial, slot.required, slot.open);
            self.shape.slots.push(SlotDef { ty, initial, required, open });
            self.shape.slot_names.push(slot.name);
        }
        let is_whole = self.shape.labels.len() == self.shape.nodes.len();
        if is_whole {
            self.try_factories();
        }
    }

    /// A constant given to a subtree or a default, read as what its readers take it for.
    fn finish_literal(&mut self, number: usize) {
        let slot = &mut self.scopes.slots[number];
        let Some((text, at)) = slot.literal.clone() else {
            return;
        };
        let ty = slot.declared.map_or(Type::Any, |(ty, _)| ty);
        slot.initial = ty.parse(&text);
        match &slot.initial {
            Some(value) if slot.declared.is_none() => slot.assigned = Some(value.plain_type()),
            Some(_) => {}
            None => {
                let (port, ty) = (slot.name.clone(), ty.name().to_owned());
                self.mistakes.add(at, Mistake::BadConstant { port, text, ty });
            }
        }
    }

    fn check_written(&mut self, number: usize, is_part: bool) {
        let slot = &mut self.scopes.slots[number];
        if slot.is_written || slot.reads.is_empty() {
            return;
        }
        if is_part {
            (slot.open, slot.required) = (true, true);
            return;
        }
        let (key, places) = (slot.name.clone(), slot.reads.clone());
        let written = self.scopes.slots.iter().filter(|slot| slot.is_written).map(|slot| slot.name.as_str());
        let nearest = self.mistakes.nearest(&key, written);
        for at in places {
            self.mistakes.add(at, Mistake::Unwritten { key: key.clone(), nearest: nearest.clone() });
        }
    }

    /// Builds every leaf once, so that a factory that refuses is heard of now.
    fn try_factories(&mut self) {
        for (leaf, factory) in self.shape.leaves.iter().zip(&self.factories) {
            if let Err(error) = factory(&spec_of(&self.shape, leaf, Waker::noop())) {
                self.mistakes.add(leaf.at, Mistake::Factory(error.to_string()));
            }
        }
    }
}
