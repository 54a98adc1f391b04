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
    /// How many more there are; only the first hundred are kept.
    pub left_out: usize,
}

/// What is wrong in one place of a tree file.
#[derive(Clone, Debug, PartialEq, Eq, Hash, thiserror::Error)]
#[allow(missing_docs)] // The texts say it.
pub enum Mistake {
    #[error("{0}")]
    Registry(String),
    #[error("not well-formed XML: {reason}")]
    NotXml { reason: String },
    #[error("the first element is `{found}`, not `root`")]
    NoRoot { found: String },
    #[error("`root` must say BTCPP_format=\"4\"{}", .found.as_ref().map(|it| format!(", not \"{it}\"")).unwrap_or_default())]
    Format { found: Option<String> },
    #[error("`{tag}` does not belong directly below `root`")]
    StrayElement { tag: String },
    #[error("nested deeper than 256 levels")]
    TooDeep,
    #[error("the trees are too large: more than {limit} nodes{}", if *.in_all { " in all" } else { "" })]
    TooLarge { limit: usize, in_all: bool },
    #[error("include of `{path}`, which is not among the files given")]
    UnknownInclude { path: String, nearest: Option<String> },
    #[error("`{tag}` needs the attribute `{attribute}`")]
    MissingAttribute { tag: String, attribute: &'static str },
    #[error("there are two trees `{id}`")]
    DuplicateTree { id: String },
    #[error("tree `{id}` has the name of a node")]
    TreeNamedLikeNode { id: String },
    #[error("there is no tree `{id}`")]
    UnknownTree { id: String, nearest: Option<String> },
    #[error("tree `{id}` contains itself: {path}")]
    Cycle { id: String, path: String },
    #[error("unknown node `{tag}`")]
    UnknownNode { tag: String, nearest: Option<String> },
    #[error("`{tag}` is no {expected}")]
    WrongClass { tag: String, expected: String },
    #[error("`{tag}` has {found}, it takes {expected}")]
    Children { tag: String, found: String, expected: String },
    #[error("two nodes are called `{name}` in tree `{tree}`")]
    DuplicateName { name: String, tree: String },
    #[error("`{tag}` has no port `{port}`")]
    UnknownPort { tag: String, port: String, nearest: Option<String> },
    #[error("unknown attribute `{attribute}`")]
    UnknownAttribute { attribute: String, nearest: Option<String> },
    #[error("`{tag}` needs its port `{port}`, {direction} of type {ty}")]
    MissingPort { tag: String, port: String, direction: &'static str, ty: String },
    #[error("port `{port}`: \"{text}\" is no {ty}")]
    BadConstant { port: String, text: String, ty: String },
    #[error("port `{port}` is written by the node and needs a key in braces, not \"{text}\"")]
    ConstantOutput { port: String, text: String },
    #[error("port `{port}`: \"{text}\" is not a usable key")]
    BadKey { port: String, text: String },
    #[error("key `{key}` is used as {found} here and as {other} at {other_at}")]
    KeyType { key: String, found: String, other: String, other_at: String },
    #[error("nothing writes key `{key}`, which is read here")]
    Unwritten { key: String, nearest: Option<String> },
    #[error("tree `{tree}` has no key `{key}` to be connected")]
    UnusedRemap { tree: String, key: String, nearest: Option<String> },
    #[error("{count} is more than the {children} children of this node")]
    Threshold { count: i32, children: u32 },
    #[error("{0}")]
    Factory(String),
    #[error("{reason} in the expression \"{text}\"")]
    Expression { text: String, reason: String, nearest: Option<String> },
    #[error("model of `{id}`: {reason}")]
    Model { id: String, reason: String },
}

impl Mistake {
    /// What to try, if something can be suggested.
    pub fn hint(&self) -> Option<String> {
        match self {
            Mistake::UnknownInclude { nearest, .. }
            | Mistake::UnknownTree { nearest, .. }
            | Mistake::UnknownNode { nearest, .. }
            | Mistake::UnknownPort { nearest, .. }
            | Mistake::UnknownAttribute { nearest, .. }
            | Mistake::Unwritten { nearest, .. }
            | Mistake::UnusedRemap { nearest, .. }
            | Mistake::Expression { nearest, .. } => nearest.as_ref().map(|it| format!("did you mean `{it}`?")),
            Mistake::NotXml { reason } if reason.contains("not '<'") => {
                Some("inside an attribute `<` is written `&lt;` and `&` is written `&amp;`".to_owned())
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
            let end_of_last = if number == 0 { "" } else { "\n" };
            write!(f, "{end_of_last}{error}")?;
        }
        match self.left_out {
            0 => Ok(()),
            more => write!(f, "\nand {more} more"),
        }
    }
}

impl std::error::Error for LoadErrors {}
