//! A value in a JSON document together with its place there, so that whatever is said about it names the place.

use domain::file::{Mistake, Mistakes, Source};
use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde_json::Value;
use serde_json::value::RawValue;

use crate::content::MOST_ZONES;
use crate::findings::{Findings, Weight, Wrong};

/// The most objects, and the most list items, of what is parsed at once: an item of a list, or a document without its lists. Parsed
/// they take up to 700 and 70 bytes of memory each, many times that of their text.
const MOST_OBJECTS: usize = 200_000;
const MOST_ITEMS: usize = 4_000_000;

/// Reads a document. Each item of a list of one of these names at its top, or of the document if it is a list, is given to `item`, and none is kept: a feed takes no
/// more memory than its text. What is returned has an empty list in place of each.
pub(crate) fn scan(source: &Source, lists: &[&str], mut item: impl FnMut(&Node<'_>)) -> Result<Value, Mistakes> {
    let wrong = |message: String| {
        let help = "a JSON file of one of the formats in docs/formats.md is expected".into();
        Mistakes(vec![Mistake { path: source.path.clone(), place: None, message, help }])
    };
    let at = |error: serde_json::Error| wrong(format!("line {} column {}: {error}", error.line(), error.column()));
    let mut each = |Items(items): Items<'_>, list: &str| {
        for (index, raw) in items.into_iter().enumerate() {
            let place = format!("{list}/{index}");
            let value = bounded(raw).map_err(|why| wrong(format!("{place}: {why}")))?;
            item(&Node { value: &value, place });
        }
        Ok(Value::Array(Vec::new()))
    };
    // A list without anything round it.
    if source.text.trim_start().starts_with('[') {
        return each(serde_json::from_str(&source.text).map_err(at)?, "");
    }
    let Members(members) = match serde_json::from_str(&source.text) {
        Ok(members) => members,
        Err(error) if error.is_data() => return Ok(Value::Null),
        Err(error) => return Err(at(error)),
    };
    let mut document = serde_json::Map::new();
    for (name, value) in members {
        let place = format!("/{name}");
        let kept = if lists.contains(&name.as_str()) && value.get().starts_with('[') {
            let items = serde_json::from_str(value.get()).map_err(|error| wrong(format!("{place}: {error}")))?;
            each(items, &place)?
        } else {
            bounded(value).map_err(|why| wrong(format!("{place}: {why}")))?
        };
        if document.insert(name, kept).is_some() {
            return Err(wrong(format!("{place} is there twice")));
        }
    }
    Ok(Value::Object(document))
}

/// Parses a part of a document, if it is not too much for the memory: that is counted before anything is parsed.
fn bounded(raw: &RawValue) -> Result<Value, String> {
    let count = |of: &[u8]| raw.get().bytes().filter(|it| of.contains(it)).count();
    if MOST_OBJECTS < count(b"{") || MOST_ITEMS < count(b"[,") {
        return Err(format!("has more than {MOST_OBJECTS} objects or {MOST_ITEMS} list items: cut it down"));
    }
    serde_json::from_str(raw.get()).map_err(|error| error.to_string())
}

/// The members of an object, in order; a name may be there twice.
struct Members<'a>(Vec<(String, &'a RawValue)>);

/// The items of a list.
struct Items<'a>(Vec<&'a RawValue>);

impl<'de> Deserialize<'de> for Members<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Object;
        impl<'de> Visitor<'de> for Object {
            type Value = Members<'de>;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Members<'de>, A::Error> {
                let mut members = Vec::new();
                while let Some(member) = map.next_entry()? {
                    members.push(member);
                    if MOST_OBJECTS < members.len() {
                        return Err(serde::de::Error::custom("too many members"));
                    }
                }
                Ok(Members(members))
            }
        }
        deserializer.deserialize_map(Object)
    }
}

impl<'de> Deserialize<'de> for Items<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct List;
        impl<'de> Visitor<'de> for List {
            type Value = Items<'de>;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a list")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Items<'de>, A::Error> {
                let mut items = Vec::new();
                while let Some(item) = list.next_element()? {
                    items.push(item);
                    if MOST_ZONES < items.len() {
                        return Err(serde::de::Error::custom(format!("more than {MOST_ZONES} items")));
                    }
                }
                Ok(Items(items))
            }
        }
        deserializer.deserialize_seq(List)
    }
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

    pub(crate) fn wrong(&self, expected: &str) -> Wrong {
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

    /// A member of this object; one that is null or an empty text counts as absent.
    pub(crate) fn get(&self, key: &str) -> Option<Node<'a>> {
        let is_nothing = |it: &Value| it.is_null() || it.as_str().is_some_and(|it| it.trim().is_empty());
        let value = self.value.get(key).filter(|it| !is_nothing(it))?;
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

    /// A number, also one that is written as a text.
    pub(crate) fn number(&self) -> Result<f64, Wrong> {
        let written = || self.value.as_str().and_then(|it| it.trim().parse().ok()).filter(|it: &f64| it.is_finite());
        self.value.as_f64().or_else(written).ok_or_else(|| self.wrong("a number"))
    }

    /// A number without a fraction.
    pub(crate) fn whole(&self) -> Result<i64, Wrong> {
        let number = self.number()?;
        if number.fract() == 0.0 && number.abs() < 1e9 { Ok(number as i64) } else { Err(self.wrong("a whole number")) }
    }

    pub(crate) fn boolean(&self) -> Result<bool, Wrong> {
        self.value.as_bool().ok_or_else(|| self.wrong("true or false"))
    }

    /// The first of these members that is there.
    pub(crate) fn any_of(&self, keys: &[&str]) -> Option<Node<'a>> {
        keys.iter().find_map(|key| self.get(key))
    }

    /// A text that is one of a few, in capital or small letters.
    pub(crate) fn one_of<T: Copy>(&self, known: &[(&str, T)]) -> Result<T, Wrong> {
        let text = self.text()?.trim();
        let found = known.iter().find(|(name, _)| name.eq_ignore_ascii_case(text)).map(|(_, value)| *value);
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
