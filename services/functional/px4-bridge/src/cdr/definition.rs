//! The definitions of messages: a text table, so that another version of PX4 is more data and no more code.

/// The table that the program knows.
const KNOWN: &str = include_str!("definitions.txt");
/// No array of PX4 is longer; a table with a slip must not make records of gigabytes.
const LONGEST_ARRAY: usize = 4096;

/// A number on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// One byte, 0 or not.
    Bool,
    /// Unsigned, of this many bytes.
    Unsigned(usize),
    /// Signed, of this many bytes.
    Signed(usize),
    /// A floating-point number of this many bytes.
    Float(usize),
}

impl Kind {
    fn of_name(name: &str) -> Option<Kind> {
        Some(match name {
            "bool" => Kind::Bool,
            "uint8" => Kind::Unsigned(1),
            "uint16" => Kind::Unsigned(2),
            "uint32" => Kind::Unsigned(4),
            "uint64" => Kind::Unsigned(8),
            "int8" => Kind::Signed(1),
            "int16" => Kind::Signed(2),
            "int32" => Kind::Signed(4),
            "int64" => Kind::Signed(8),
            "float32" => Kind::Float(4),
            "float64" => Kind::Float(8),
            _ => return None,
        })
    }

    /// Its bytes, to which it is also aligned.
    pub(super) fn size(self) -> usize {
        match self {
            Kind::Bool => 1,
            Kind::Unsigned(size) | Kind::Signed(size) | Kind::Float(size) => size,
        }
    }
}

/// A field of a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    /// Its name; `previous.lat` for one of a message within the message.
    pub name: String,
    /// Its number, or those of its array.
    pub kind: Kind,
    /// How many numbers; 1 if it is not an array.
    pub count: usize,
}

/// One version of a message on one topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Definition {
    /// The topic's name, without `fmu/in/` or `fmu/out/`.
    pub topic: String,
    /// The name of its type, such as `VehicleStatus`.
    pub type_name: String,
    /// The hash of the type, 64 hexadecimal digits: it stands for the version.
    pub hash: String,
    /// The fields, in the order of the wire.
    pub fields: Vec<Field>,
}

/// The versions that are known.
#[derive(Debug, Clone)]
pub struct Definitions(Vec<Definition>);

/// An invalid line of a table.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: found `{found}`, expected {expected}")]
pub struct InvalidDefinitions {
    line: usize,
    found: String,
    expected: &'static str,
}

impl Definitions {
    /// Those that the program comes with.
    ///
    /// # Panics
    /// Never: a test reads the table.
    pub fn known() -> Definitions {
        Definitions::parse(KNOWN).expect("the table of the program is checked by a test")
    }

    /// Reads a table.
    ///
    /// # Errors
    /// At the first line that makes no sense.
    pub fn parse(text: &str) -> Result<Definitions, InvalidDefinitions> {
        let mut definitions: Vec<Definition> = Vec::new();
        for (number, line) in text.lines().enumerate() {
            let wrong = |expected| InvalidDefinitions { line: number + 1, found: line.trim().to_owned(), expected };
            let words: Vec<_> = line.split_whitespace().collect();
            match (line.starts_with(' '), words.as_slice()) {
                (_, []) => {}
                (_, [first, ..]) if first.starts_with('#') => {}
                (false, [topic, type_name, hash]) => {
                    if hash.len() != 64 || !hash.bytes().all(|it| it.is_ascii_hexdigit()) {
                        return Err(wrong("a hash of 64 hexadecimal digits after topic and type"));
                    }
                    let (topic, type_name, hash) = (topic.to_string(), type_name.to_string(), hash.to_string());
                    definitions.push(Definition { topic, type_name, hash, fields: Vec::new() });
                }
                (true, [kind, name]) => {
                    let expected = "a type such as `float32` or `uint8[4]` and a name";
                    let (kind, count) = kind_and_count(kind).ok_or_else(|| wrong(expected))?;
                    let message = definitions.last_mut().ok_or_else(|| wrong("a message before its fields"))?;
                    message.fields.push(Field { name: name.to_string(), kind, count });
                }
                _ => return Err(wrong("topic, type and hash, or indented a field's type and name")),
            }
        }
        Ok(Definitions(definitions))
    }

    /// The definition of this topic with this hash.
    pub fn of(&self, topic: &str, hash: &str) -> Option<&Definition> {
        self.0.iter().find(|it| it.topic == topic && it.hash == hash)
    }

    /// The newest version of a topic: the last of the table.
    pub fn newest(&self, topic: &str) -> Option<&Definition> {
        self.0.iter().rfind(|it| it.topic == topic)
    }

    /// Every definition.
    pub fn iter(&self) -> impl Iterator<Item = &Definition> {
        self.0.iter()
    }
}

fn kind_and_count(text: &str) -> Option<(Kind, usize)> {
    let Some((kind, count)) = text.split_once('[') else { return Some((Kind::of_name(text)?, 1)) };
    let count: usize = count.strip_suffix(']')?.parse().ok()?;
    (1..=LONGEST_ARRAY).contains(&count).then_some((Kind::of_name(kind)?, count))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_the_program_is_one_and_repeats_nothing() {
        let definitions = Definitions::parse(KNOWN).unwrap_or_else(|it| panic!("{it}"));
        for definition in definitions.iter() {
            assert!(!definition.fields.is_empty(), "{}", definition.topic);
            let same = definitions.iter().filter(|it| (&it.topic, &it.hash) == (&definition.topic, &definition.hash));
            assert_eq!(same.count(), 1, "{}", definition.topic);
        }
        assert_eq!(definitions.newest("vehicle_status").map(|it| it.type_name.as_str()), Some("VehicleStatus"));
    }

    #[test]
    fn what_is_no_table_is_refused_with_its_line() {
        #[track_caller]
        fn check(text: &str, expected: &str) {
            let error = Definitions::parse(text).map(|_| ()).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
        let hash = "0".repeat(64);
        check("# table\n  uint8 lonely", "line 2: found `uint8 lonely`, expected a message before");
        check("topic Type 0123", "expected a hash of 64");
        check(&format!("t T {hash}\n  uint7 x"), "line 2: found `uint7 x`, expected a type");
        check(&format!("t T {hash}\n  uint8[0] x"), "expected a type");
        check(&format!("t T {hash}\n  uint8[99999] x"), "expected a type");
        check("topic Type", "expected topic, type and hash");
    }
}
