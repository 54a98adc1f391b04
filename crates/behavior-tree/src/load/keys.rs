//! Which slot a key means: remapping, `_autoremap` and `@`, resolved while loading.

use std::borrow::Cow;
use std::collections::HashMap;

use super::slots::Slots;
use crate::xml::source::Place;

/// True if a key can have this name. `@` may come first.
pub(super) fn is_valid_key(key: &str) -> bool {
    let name = key.strip_prefix('@').unwrap_or(key);
    !name.is_empty() && !name.contains(|c: char| c.is_whitespace() || c.is_control() || "{}@/".contains(c))
}

/// The key in `{key}`. `{=}` is the key with the port's own name. `None` for a constant.
pub(super) fn key_of<'a>(port: &'a str, text: &'a str) -> Option<&'a str> {
    let key = text.trim().strip_prefix('{')?.strip_suffix('}')?.trim();
    Some(if key == "=" { port } else { key })
}

/// The keys of one tree with the trees included in it. Each of these has a scope of its own, numbered in the order in
/// which they are entered; the outermost tree is scope 0.
#[derive(Default)]
pub(super) struct Keys {
    scopes: Vec<Scope>,
    pub(super) slots: Slots,
}

/// The keys as seen from inside one tree.
#[derive(Default)]
struct Scope {
    parent: Option<usize>,
    /// The tree's path and `/`. Empty for the outermost tree.
    prefix: String,
    autoremap: bool,
    remaps: HashMap<String, Remap>,
    /// The slots of the keys that are not connected to one outside.
    own: HashMap<String, u32>,
}

/// A key inside that is connected to a key outside.
struct Remap {
    outside: String,
    at: Place,
    is_used: bool,
}

impl Keys {
    /// Enters an included tree, or the outermost one. Returns its scope.
    pub(super) fn open_scope(&mut self, parent: Option<usize>, prefix: String, autoremap: bool) -> usize {
        self.scopes.push(Scope { parent, prefix, autoremap, ..Scope::default() });
        self.scopes.len() - 1
    }

    /// Connects a key inside a scope to one outside.
    pub(super) fn remap(&mut self, scope: usize, inside: &str, outside: &str, at: Place) {
        let remap = Remap { outside: outside.to_owned(), at, is_used: false };
        self.scopes[scope].remaps.insert(inside.to_owned(), remap);
    }

    /// Gives a scope a key of its own that starts with a constant.
    pub(super) fn literal(&mut self, scope: usize, key: &str, text: &str, at: Place) {
        let slot = self.own(scope, key);
        self.slots.set_literal(slot, text, at);
    }

    /// Gives a scope a key of its own that the outer tree should have connected. That mistake is reported already, so the
    /// key must not be reported again.
    pub(super) fn forgive(&mut self, scope: usize, key: &str) {
        let slot = self.own(scope, key);
        self.slots.note_creation(slot);
        self.slots.note_use(slot);
    }

    /// The slot that a key means in a scope. Makes one for a new key.
    pub(super) fn resolve(&mut self, scope: usize, key: &str) -> u32 {
        let (mut scope, mut key) = match key.strip_prefix('@') {
            Some(key) => (0, Cow::Borrowed(key)),
            None => (scope, Cow::Borrowed(key)),
        };
        while let Some((parent, outside)) = self.outside(scope, &key) {
            (scope, key) = match outside.strip_prefix('@') {
                Some(of_outermost) => (0, Cow::Owned(of_outermost.to_owned())),
                None => (parent, Cow::Owned(outside)),
            };
        }
        let slot = self.own(scope, &key);
        self.slots.note_use(slot);
        slot
    }

    /// The key outside that a key inside is connected to, and the scope it is in.
    fn outside(&mut self, scope: usize, key: &str) -> Option<(usize, String)> {
        let scope = &mut self.scopes[scope];
        if scope.own.contains_key(key) {
            return None;
        }
        let outside = match scope.remaps.get_mut(key) {
            Some(remap) => {
                remap.is_used = true;
                remap.outside.clone()
            }
            None if scope.autoremap && !key.starts_with('_') => key.to_owned(),
            None => return None,
        };
        Some((scope.parent?, outside))
    }

    /// The keys that were connected to a scope, or given to it as constants, and that nothing inside uses.
    pub(super) fn unused(&self, scope: usize) -> Vec<(String, Place)> {
        let scope = &self.scopes[scope];
        let remaps = scope.remaps.iter().filter(|(_, remap)| !remap.is_used);
        let literals = scope.own.iter().filter(|(_, slot)| !self.slots.is_used(**slot));
        let literals = literals.filter_map(|(key, slot)| Some((key.clone(), self.slots.literal_place(*slot)?)));
        let mut unused: Vec<_> = remaps.map(|(key, remap)| (key.clone(), remap.at)).chain(literals).collect();
        unused.sort();
        unused
    }

    /// The names that a scope uses.
    pub(super) fn used(&self, scope: usize) -> impl Iterator<Item = &str> {
        let scope = &self.scopes[scope];
        let own = scope.own.iter().filter(|(_, slot)| self.slots.is_used(**slot)).map(|(key, _)| key);
        let remapped = scope.remaps.iter().filter(|(_, remap)| remap.is_used).map(|(key, _)| key);
        own.chain(remapped).map(String::as_str)
    }

    fn own(&mut self, scope: usize, key: &str) -> u32 {
        let scope = &mut self.scopes[scope];
        if let Some(slot) = scope.own.get(key) {
            return *slot;
        }
        let slot = self.slots.add(format!("{}{key}", scope.prefix));
        scope.own.insert(key.to_owned(), slot);
        slot
    }
}
