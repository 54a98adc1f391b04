//! Which key means which slot: remapping, `_autoremap` and `@`, resolved while loading.

use std::collections::HashMap;

use crate::types::Type;
use crate::value::Value;
use crate::xml::element::Place;

/// The keys as seen from inside one tree.
#[derive(Default)]
pub(crate) struct KeyScope {
    parent: Option<usize>,
    /// `path/` of the tree, empty for the root.
    prefix: String,
    autoremap: bool,
    remaps: HashMap<String, Remap>,
    own: HashMap<String, u32>,
}

struct Remap {
    outside: String,
    at: Place,
    is_used: bool,
}

/// A key while its users are being found.
pub(crate) struct Slot {
    pub(crate) name: String,
    /// The type its users declare, and where the first of them does.
    pub(crate) declared: Option<(Type, Place)>,
    /// The type of what expressions assign, if no port declares one.
    pub(crate) assigned: Option<Type>,
    /// A constant given to a subtree; its type is known only when somebody reads it.
    pub(crate) literal: Option<(String, Place)>,
    pub(crate) initial: Option<Value>,
    pub(crate) is_written: bool,
    pub(crate) required: bool,
    pub(crate) open: bool,
    /// A port that may hold anything writes it, so nothing is known of its type.
    pub(crate) takes_anything: bool,
    is_used: bool,
    /// Where it is read.
    pub(crate) reads: Vec<Place>,
}

impl Slot {
    /// What is known of its type.
    pub(crate) fn ty(&self) -> Type {
        self.declared.map_or(self.assigned.unwrap_or(Type::Any), |(ty, _)| ty)
    }
}

/// All scopes and slots of one tree being expanded.
#[derive(Default)]
pub(crate) struct Scopes {
    scopes: Vec<KeyScope>,
    pub(crate) slots: Vec<Slot>,
}

impl Scopes {
    pub(crate) fn open_scope(&mut self, parent: Option<usize>, prefix: String, autoremap: bool) -> usize {
        self.scopes.push(KeyScope { parent, prefix, autoremap, ..KeyScope::default() });
        self.scopes.len() - 1
    }

    pub(crate) fn remap(&mut self, scope: usize, inside: &str, outside: &str, at: Place) {
        let remap = Remap { outside: outside.to_owned(), at, is_used: false };
        self.scopes[scope].remaps.insert(inside.to_owned(), remap);
    }

    /// A constant given to a subtree: a key of its own that starts with this value.
    pub(crate) fn literal(&mut self, scope: usize, key: &str, text: &str, at: Place) {
        let slot = self.own(scope, key);
        let slot = &mut self.slots[slot as usize];
        slot.literal = Some((text.to_owned(), at));
        slot.is_written = true;
    }

    /// The slot a key means in a scope; made if nobody has used it yet.
    pub(crate) fn resolve(&mut self, scope: usize, key: &str) -> u32 {
        let (mut scope, mut key) = match key.strip_prefix('@') {
            Some(key) => (0, key.to_owned()),
            None => (scope, key.to_owned()),
        };
        loop {
            let here = &mut self.scopes[scope];
            if let Some(slot) = here.own.get(&key) {
                self.slots[*slot as usize].is_used = true;
                return *slot;
            }
            let outside = match here.remaps.get_mut(&key) {
                Some(remap) => {
                    remap.is_used = true;
                    Some(remap.outside.clone())
                }
                None if here.autoremap && !key.starts_with('_') => Some(key.clone()),
                None => None,
            };
            match (outside, here.parent) {
                (Some(outside), Some(parent)) => match outside.strip_prefix('@') {
                    Some(of_root) => (scope, key) = (0, of_root.to_owned()),
                    None => (scope, key) = (parent, outside),
                },
                _ => {
                    let slot = self.own(scope, &key);
                    self.slots[slot as usize].is_used = true;
                    return slot;
                }
            }
        }
    }

    /// A key of its own that the outer tree should have connected, and did not: one mistake is enough.
    pub(crate) fn forgive(&mut self, scope: usize, key: &str) {
        let slot = self.own(scope, key);
        let slot = &mut self.slots[slot as usize];
        (slot.is_written, slot.is_used) = (true, true);
    }

    /// Remappings and constants of a scope that nothing inside uses.
    pub(crate) fn unused(&self, scope: usize) -> Vec<(String, Place)> {
        let scope = &self.scopes[scope];
        let remaps = scope.remaps.iter().filter(|(_, remap)| !remap.is_used);
        let literals = scope.own.iter().filter_map(|(key, slot)| {
            let slot = &self.slots[*slot as usize];
            let (_, at) = slot.literal.as_ref().filter(|_| !slot.is_used)?;
            Some((key.clone(), *at))
        });
        let mut unused: Vec<_> = remaps.map(|(key, remap)| (key.clone(), remap.at)).chain(literals).collect();
        unused.sort();
        unused
    }

    /// The keys that a scope knows by name.
    pub(crate) fn keys(&self, scope: usize) -> impl Iterator<Item = &str> {
        let scope = &self.scopes[scope];
        let own = scope.own.iter().filter(|(_, slot)| self.slots[**slot as usize].is_used).map(|(key, _)| key);
        own.chain(scope.remaps.iter().filter(|(_, it)| it.is_used).map(|(key, _)| key)).map(String::as_str)
    }

    fn own(&mut self, scope: usize, key: &str) -> u32 {
        let next = self.slots.len() as u32;
        let here = &mut self.scopes[scope];
        let slot = *here.own.entry(key.to_owned()).or_insert(next);
        if slot == next {
            let name = format!("{}{key}", here.prefix);
            self.slots.push(Slot {
                name,
                declared: None,
                assigned: None,
                literal: None,
                initial: None,
                is_written: false,
                required: false,
                open: false,
                takes_anything: false,
                is_used: false,
                reads: Vec::new(),
            });
        }
        slot
    }
}
