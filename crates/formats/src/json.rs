//! A value in a JSON document together with its place there, so that whatever is said about it names the place.

use domain::file::{Mistake, Mistakes, Source};
use serde_json::Value;

use crate::findings::{Findings, Weight, Wrong};

/// The most objects, and the most list items, of a document. Parsed they take up to 700 and 70 bytes of memory each, many times
/// that of their text; the zones of a whole country need a tenth of them.
const MOST_OBJECTS: usize = 200_000;
const MOST_ITEMS: usize = 4_000_000;

/// Parses a whole document, if it is not too much for the memory: that is counted before anything is parsed.
pub(crate) fn parse(source: &Source) -> Result<Value, Mistakes> {
    let count = |of: &[u8]| source.text.bytes().filter(|it| of.contains(it)).count();
    if MOST_OBJECTS < count(b"{") || MOST_ITEMS < count(b"[,") {
        let message = format!("has more than {MOST_OBJECTS} objects or {MOST_ITEMS} list items");
        let help = "cut it to the region of the mission".into();
        return Err(Mistakes(vec![Mistake { path: source.path.clone(), place: None, message, help }]));
    }
    serde_json::from_str(&source.text).map_err(|error| {
        let help = "a JSON file of one of the formats in docs/formats.md is expected";
        let message = format!("line {} column {}: {error}", error.line(), error.column());
        Mistakes(vec![Mistake { path: source.path.clone(), place: None, message, help: help.into() }])
    })
}

/// A value and its JSON pointer.
#[derive(Debug, Clone)]
pub(crate) struct Node<'a> {
    pub(crate) value: &'a Value,
    pub(crate) place: String,
}

impl<'a> Node<'a> {
    pub(crate) fn root(value: &'a Value) -> Node<'a> {
        Node { value, place: String::new() }
    }

    fn wrong(&self, expected: &str) -> Wrong {
        let found = match self.value {
            Value::Null => "nothing".to_owned(),
            Value::Bool(it) => it.to_string(),
            Value::Number(it) => it.to_string(),
            Value::String(it) => format!("`{}`", short(it)),
            Value::Array(_) => "a list".to_owned(),
            Value::Object(_) => "an object".to_owned(),
        };
        Wrong::at(&self.place, format!("found {found}, expected {expected}"), "")
    }

    /// A member of this object; one that is null counts as absent.
    pub(crate) fn get(&self, key: &str) -> Option<Node<'a>> {
        let value = self.value.get(key).filter(|it| !it.is_null())?;
        Some(Node { value, place: format!("{}/{}", self.place, key.replace('~', "~0").replace('/', "~1")) })
    }

    /// As [`Node::get`], for a member that must be there.
    pub(crate) fn need(&self, key: &str) -> Result<Node<'a>, Wrong> {
        self.object()?;
        self.get(key).ok_or_else(|| Wrong::at(&self.place, format!("`{key}` is missing"), ""))
    }

    pub(crate) fn object(&self) -> Result<&'a serde_json::Map<String, Value>, Wrong> {
        self.value.as_object().ok_or_else(|| self.wrong("an object"))
    }

    pub(crate) fn items(&self) -> Result<Vec<Node<'a>>, Wrong> {
        let items = self.value.as_array().ok_or_else(|| self.wrong("a list"))?;
        let item = |(index, value)| Node { value, place: format!("{}/{index}", self.place) };
        Ok(items.iter().enumerate().map(item).collect())
    }

    /// The items of a member, none if it is absent.
    pub(crate) fn list(&self, key: &str) -> Result<Vec<Node<'a>>, Wrong> {
        self.get(key).map_or(Ok(Vec::new()), |it| it.items())
    }

    pub(crate) fn text(&self) -> Result<&'a str, Wrong> {
        self.value.as_str().ok_or_else(|| self.wrong("a text"))
    }

    pub(crate) fn number(&self) -> Result<f64, Wrong> {
        self.value.as_f64().ok_or_else(|| self.wrong("a number"))
    }

    /// A number without a fraction.
    pub(crate) fn whole(&self) -> Result<i64, Wrong> {
        let number = self.number()?;
        if number.fract() == 0.0 && number.abs() < 1e9 { Ok(number as i64) } else { Err(self.wrong("a whole number")) }
    }

    pub(crate) fn boolean(&self) -> Result<bool, Wrong> {
        self.value.as_bool().ok_or_else(|| self.wrong("true or false"))
    }

    /// A text that is one of a few.
    pub(crate) fn one_of<T: Copy>(&self, known: &[(&str, T)]) -> Result<T, Wrong> {
        let text = self.text()?;
        let found = known.iter().find(|(name, _)| *name == text).map(|(_, value)| *value);
        found.ok_or_else(|| self.wrong(&known.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ")))
    }

    /// Notes each member that none of the format's editions has.
    pub(crate) fn note_unknown(&self, known: &[&str], findings: &mut Findings) {
        for key in self.value.as_object().into_iter().flat_map(|it| it.keys()) {
            if !known.contains(&key.as_str()) {
                let text = "a field that is not in the format: not read";
                findings.say(Weight::Furniture, &format!("{}/{}", self.place, short(key)), text);
            }
        }
    }

    /// Notes each of these members that is there.
    pub(crate) fn note_unused(&self, fields: &[&str], why: &str, findings: &mut Findings) {
        for field in fields.iter().filter_map(|key| self.get(key)) {
            findings.say(Weight::Furniture, &field.place, why);
        }
    }
}

/// The beginning of a text that may be long.
pub(crate) fn short(text: &str) -> String {
    const LONGEST: usize = 60;
    let mut short: String = text.chars().take(LONGEST).collect();
    if short.len() < text.len() {
        short.push_str("..");
    }
    short
}
