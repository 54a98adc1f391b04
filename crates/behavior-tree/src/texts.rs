//! The texts of a tree in one piece of memory, so that none of its thousands of names is an allocation of its own.

use std::collections::HashMap;

/// A text in a [`Texts`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Text {
    start: usize,
    end: usize,
}

#[derive(Debug, Default)]
pub(crate) struct Texts(String);

impl Texts {
    pub(crate) fn get(&self, text: Text) -> &str {
        &self.0[text.start..text.end]
    }
}

/// Collects texts. Each is stored once, however often it is added: a subtree may be included many times.
#[derive(Default)]
pub(crate) struct TextCollector<'x> {
    texts: Texts,
    known: HashMap<&'x str, Text>,
}

impl<'x> TextCollector<'x> {
    pub(crate) fn add(&mut self, text: &'x str) -> Text {
        *self.known.entry(text).or_insert_with(|| {
            let start = self.texts.0.len();
            self.texts.0.push_str(text);
            Text { start, end: self.texts.0.len() }
        })
    }

    pub(crate) fn finish(self) -> Texts {
        self.texts
    }
}
