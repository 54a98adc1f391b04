//! What can be wrong with a tree file.

use std::fmt;

/// One mistake in one place.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadError {
    /// The file, as named by the caller.
    pub file: String,
    /// Counted from 1.
    pub line: u32,
    /// Counted from 1, in characters.
    pub column: u32,
    /// What is wrong.
    pub mistake: Mistake,
}

/// Everything that is wrong with the files, in the order of the files.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadErrors {
    /// At least one.
    pub errors: Vec<LoadError>,
    /// How many more there are: only the first hundred are kept.
    pub left_out: usize,
}

/// What is wrong in one place of a tree file.
#[derive(Clone, Debug, PartialEq, Eq, Hash, thiserror::Error)]
#[expect(missing_docs, reason = "the error texts say it")]
pub enum Mistake {
    #[error("{0}")]
    Registry(String),
    #[error("not well-formed XML: {reason}")]
    NotXml { reason: String },
    #[error("expected the element `root`, found `{found}`")]
    NoRoot { found: String },
    #[error("`root` needs BTCPP_format=\"4\"{}", .found.as_ref().map(|found| format!(", found \"{found}\"")).unwrap_or_default())]
    Format { found: Option<String> },
    #[error("`{tag}` is not allowed directly below `root`")]
    StrayElement { tag: String },
    #[error("nested deeper than {limit} levels")]
    TooDeep { limit: usize },
    #[error("more than {limit} nodes in {}", if *.in_all { "all trees together" } else { "one tree" })]
    TooLarge { limit: usize, in_all: bool },
    #[error("the included file `{path}` is not among the loaded files")]
    UnknownInclude { path: String, nearest: Option<String> },
    #[error("`{tag}` needs the attribute `{attribute}`")]
    MissingAttribute { tag: String, attribute: &'static str },
    #[error("two trees have the ID `{id}`")]
    DuplicateTree { id: String },
    #[error("`{id}` is a kind of node and cannot be the ID of a tree")]
    TreeNamedLikeNode { id: String },
    #[error("there is no tree `{id}`")]
    UnknownTree { id: String, nearest: Option<String> },
    #[error("tree `{id}` contains itself: {path}")]
    Cycle { id: String, path: String },
    #[error("unknown node `{tag}`")]
    UnknownNode { tag: String, nearest: Option<String> },
    #[error("expected `{expected} ID=\"{tag}\"`, found `{found} ID=\"{tag}\"`")]
    WrongClass { tag: String, expected: &'static str, found: String },
    #[error("`{tag}` takes {expected}, found {found}")]
    Children { tag: String, expected: String, found: usize },
    #[error("two nodes are called `{name}` in tree `{tree}`")]
    DuplicateName { name: String, tree: String },
    #[error("`{tag}` has no port `{port}`")]
    UnknownPort { tag: String, port: String, nearest: Option<String> },
    #[error("unknown attribute `{attribute}`")]
    UnknownAttribute { attribute: String, nearest: Option<String> },
    #[error("`{tag}` needs a value for its {direction} port `{port}` of type {ty}")]
    MissingPort { tag: String, port: String, direction: &'static str, ty: &'static str },
    #[error("port `{port}`: expected {expected}, found \"{found}\"")]
    BadConstant { port: String, expected: String, found: String },
    #[error("port `{port}`: expected a key in braces to write to, found \"{found}\"")]
    ConstantOutput { port: String, found: String },
    #[error("port `{port}`: \"{text}\" is not a valid key")]
    BadKey { port: String, text: String },
    #[error("key `{key}` is used as {found} here and as {other} at {other_at}")]
    KeyType { key: String, found: &'static str, other: &'static str, other_at: String },
    #[error("nothing writes key `{key}`, which is read here")]
    Unwritten { key: String, nearest: Option<String> },
    #[error("nothing in tree `{tree}` uses the key `{key}`")]
    UnusedKey { tree: String, key: String, nearest: Option<String> },
    #[error("`{port}` is {count}, more than the node has children ({children})")]
    Count { port: &'static str, count: i32, children: u32 },
    #[error("{0}")]
    Factory(String),
    #[error("expression `{text}`: {reason}")]
    Expression { text: String, reason: String, nearest: Option<String> },
    #[error("model of `{id}`: `{port}` is not a valid name for a port")]
    Model { id: String, port: String },
}

impl Mistake {
    /// What to do about it, if there is a suggestion.
    pub fn hint(&self) -> Option<String> {
        match self {
            Mistake::UnknownInclude { nearest, .. }
            | Mistake::UnknownTree { nearest, .. }
            | Mistake::UnknownNode { nearest, .. }
            | Mistake::UnknownPort { nearest, .. }
            | Mistake::UnknownAttribute { nearest, .. }
            | Mistake::Unwritten { nearest, .. }
            | Mistake::UnusedKey { nearest, .. }
            | Mistake::Expression { nearest, .. } => {
                nearest.as_ref().map(|nearest| format!("did you mean `{nearest}`?"))
            }
            Mistake::NotXml { reason } if reason.contains("not '<'") => {
                Some("inside an attribute, write `<` as `&lt;` and `&` as `&amp;`".to_owned())
            }
            _ => None,
        }
    }
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}: {}", self.file, self.line, self.column, self.mistake)?;
        match self.mistake.hint() {
            Some(hint) => write!(f, "; {hint}"),
            None => Ok(()),
        }
    }
}

impl fmt::Display for LoadErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (number, error) in self.errors.iter().enumerate() {
            let line_break = if number == 0 { "" } else { "\n" };
            write!(f, "{line_break}{error}")?;
        }
        match self.left_out {
            0 => Ok(()),
            more => write!(f, "\nand {more} more"),
        }
    }
}

impl std::error::Error for LoadErrors {}
