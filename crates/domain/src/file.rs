//! Files that a human writes: read and parsed; every mistake is reported with file, line and column, what was
//! found and what was expected.

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

mod known_names;
mod limits;
mod parsing;

pub use known_names::did_you_mean;
pub use limits::MOST_MISTAKES;

/// A file's text and its path.
#[derive(Debug, Clone)]
pub struct Source {
    /// As the user gave it.
    pub path: PathBuf,
    /// Its whole text.
    pub text: String,
}

/// The largest file that is read, in bytes: 32 MiB. A mission at its bounds has a sixth of that; a parsed document takes about
/// ten times the memory of its text.
pub const LARGEST_BYTES: u64 = 32 << 20;

impl Source {
    /// Reads the file if it has at most [`LARGEST_BYTES`]; of a larger one no more is read.
    ///
    /// # Errors
    /// If it cannot be read, or is larger.
    pub fn read(path: &Path) -> Result<Source, Mistakes> {
        Source::read_at_most(path, LARGEST_BYTES)
    }

    fn read_at_most(path: &Path, most: u64) -> Result<Source, Mistakes> {
        let text = String::from_utf8(read_bytes(path, most)?);
        let text = text.map_err(|error| {
            let message = format!("cannot be read: {error}");
            let help = "give the path of a readable UTF-8 text file".into();
            Mistakes(vec![Mistake { path: path.to_owned(), place: None, message, help }])
        })?;
        Ok(Source { path: path.to_owned(), text })
    }

    /// Parses the text as TOML into `T`.
    ///
    /// # Errors
    /// As many of its mistakes as can be found at once.
    pub fn parse<T: serde::de::DeserializeOwned>(&self) -> Result<T, Mistakes> {
        parsing::parse(&self.text).map_err(|found| {
            let mistake = |(span, message): parsing::Found| {
                let help = known_names::misspelt(&message).unwrap_or_default();
                self.mistake(span, message, help)
            };
            Mistakes(found.into_iter().map(mistake).collect())
        })
    }

    /// A mistake at a place in this file, by byte range. Long texts and long lines are shortened.
    pub fn mistake(&self, span: Option<Range<usize>>, message: impl Into<String>, help: impl Into<String>) -> Mistake {
        let place = span.map(|span| {
            let start = span.start.min(self.text.len());
            let before = &self.text[..start];
            let line_start = before.rfind('\n').map_or(0, |it| it + 1);
            Place {
                line: before.matches('\n').count() + 1,
                column: before[line_start..].chars().count() + 1,
                text: limits::excerpt(self.text[line_start..].lines().next().unwrap_or_default(), start - line_start),
            }
        });
        let (message, help) = (limits::told(message.into()), limits::told(help.into()));
        Mistake { path: self.path.clone(), place, message, help }
    }
}

/// Reads a file of any content if it has at most `most` bytes; of a larger one no more is read.
///
/// # Errors
/// If it cannot be read, is not a regular file, or is larger.
pub fn read_bytes(path: &Path, most: u64) -> Result<Vec<u8>, Mistakes> {
    use std::io::Read as _;
    let mistake = |message: String, help: &str| {
        Mistakes(vec![Mistake { path: path.to_owned(), place: None, message, help: help.into() }])
    };
    let unreadable =
        |error: std::io::Error| mistake(format!("cannot be read: {error}"), "give the path of a readable file");
    let too_large = |size: &str| {
        let message = format!("the file has {size}; at most {} are read", in_units(most));
        mistake(message, "cut it to what the mission needs")
    };
    let mut bytes = Vec::new();
    let file = regular_file::open(path).map_err(unreadable)?;
    let size = file.metadata().map_err(unreadable)?.len();
    if most < size {
        return Err(too_large(&in_units(size)));
    }
    // One byte more shows that there is more: a file may grow.
    file.take(most + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if most < bytes.len() as u64 {
        return Err(too_large("more"));
    }
    Ok(bytes)
}

/// A number of bytes in MiB, rounded up, or in bytes below one of them.
fn in_units(bytes: u64) -> String {
    const MIB: u64 = 1 << 20;
    if bytes < MIB { format!("{bytes} bytes") } else { format!("{} MiB", bytes.div_ceil(MIB)) }
}

/// One thing wrong with a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mistake {
    /// The file.
    pub path: PathBuf,
    /// The place in the file, if there is a single one.
    pub place: Option<Place>,
    /// What was found and what was expected.
    pub message: String,
    /// How to mend it; may be empty.
    pub help: String,
}

/// A place in a file, counted from 1.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The line's number.
    pub line: usize,
    /// The character's number in the line.
    pub column: usize,
    /// The line itself; of a long one the part around the character, with `…` where something is left out.
    pub text: String,
}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.place {
            None => write!(f, "{}: {}", self.path.display(), self.message)?,
            Some(Place { line, column, text }) => {
                let margin = " ".repeat(line.to_string().len());
                let before = limits::before_in_excerpt(text, column - 1);
                let indent: String = text.chars().take(before).map(|it| if it == '\t' { '\t' } else { ' ' }).collect();
                write!(f, "{}:{line}:{column}: {}", self.path.display(), self.message)?;
                write!(f, "\n{margin} |\n{line} | {text}\n{margin} | {indent}^")?;
            }
        }
        if self.help.is_empty() { Ok(()) } else { write!(f, "\n  help: {}", self.help) }
    }
}

/// Everything wrong with one or more files, found at once.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Mistakes(pub Vec<Mistake>);

impl Mistakes {
    /// One more, up to [`MOST_MISTAKES`]; any further one is dropped.
    pub fn push(&mut self, mistake: Mistake) {
        if !self.is_full() {
            self.0.push(mistake);
        }
    }

    /// No further one is taken: it need not be looked for.
    pub fn is_full(&self) -> bool {
        MOST_MISTAKES <= self.0.len()
    }

    /// `value` if there are no mistakes.
    pub fn or<T>(self, value: T) -> Result<T, Mistakes> {
        if self.0.is_empty() { Ok(value) } else { Err(self) }
    }
}

impl fmt::Display for Mistakes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, mistake) in self.0.iter().enumerate() {
            if index > 0 {
                f.write_str("\n\n")?;
            }
            write!(f, "{mistake}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Mistakes {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mistake_names_file_line_and_column() {
        let source = Source { path: "config/x.toml".into(), text: "a = 1\nbcd = 2\n".into() };
        let mistake = source.mistake(Some(8..9), "found 2, expected 3", "write 3");
        assert_eq!(
            mistake.to_string(),
            "config/x.toml:2:3: found 2, expected 3\n  |\n2 | bcd = 2\n  |   ^\n  help: write 3"
        );
    }

    #[test]
    fn a_file_that_is_too_large_is_refused_with_its_size() {
        #[track_caller]
        fn check(size: u64, most: u64, expected: Option<&str>) {
            let path = std::env::temp_dir().join(format!("kittiwake-file-{}-{size}-{most}", std::process::id()));
            std::fs::File::create(&path).unwrap().set_len(size).unwrap();
            let told = Source::read_at_most(&path, most).err().map(|it| it.0[0].message.clone());
            std::fs::remove_file(&path).unwrap();
            assert_eq!(told.as_deref(), expected);
        }
        check(10, 10, None);
        check(11, 10, Some("the file has 11 bytes; at most 10 bytes are read"));
        // A hole: it takes no room, and is not read.
        check((51 << 20) - 1, 32 << 20, Some("the file has 51 MiB; at most 32 MiB are read"));
        check((32 << 20) + 1, 32 << 20, Some("the file has 33 MiB; at most 32 MiB are read"));
    }

    #[test]
    fn the_mark_stands_below_the_mistake_in_a_line_that_is_cut() {
        let text = format!("a = [{}7]\n", "1, ".repeat(1_000));
        let source = Source { path: "x".into(), text };
        let told = source.mistake(Some(3_005..3_006), "found 7", "").to_string();
        let lines: Vec<&str> = told.lines().collect();
        assert_eq!(lines[0], "x:1:3006: found 7");
        let mark = lines[3].chars().position(|it| it == '^').unwrap();
        assert_eq!(lines[2].chars().nth(mark), Some('7'), "{told}");
        assert!(lines.iter().all(|it| it.chars().count() < 220), "{told}");
    }

    #[test]
    fn further_mistakes_are_dropped() {
        let source = Source { path: "x".into(), text: String::new() };
        let mut mistakes = Mistakes::default();
        for number in 0..2 * MOST_MISTAKES {
            assert_eq!(mistakes.is_full(), MOST_MISTAKES <= number);
            mistakes.push(source.mistake(None, number.to_string(), ""));
        }
        assert_eq!(mistakes.0.len(), MOST_MISTAKES);
        assert_eq!(mistakes.0[MOST_MISTAKES - 1].message, (MOST_MISTAKES - 1).to_string());
    }
}
