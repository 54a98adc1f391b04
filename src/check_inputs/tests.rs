//! Every key of the shipped files with something wrong, and files with anything at all in them.

use std::collections::BTreeSet;

use proptest::prelude::*;
use proptest::sample::Index;

use super::*;

/// Whether a file can be used.
type Read = Box<dyn Fn(&Source) -> Result<(), Mistakes>>;

/// A shipped file, and how it is read.
struct Shipped {
    source: Source,
    read: Read,
}

impl Shipped {
    fn all() -> [Shipped; 3] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("config");
        let file = |name, read: Read| Shipped { source: Source::read(&folder.join(name)).unwrap(), read };
        let trees = Trees::read(&folder.join("trees")).unwrap();
        [
            file("kittiwake.toml", Box::new(|it| it.parse::<Config>().map(drop))),
            file("missions/harbour.toml", Box::new(|it| Mission::read(it).map(drop))),
            file("contingencies.toml", Box::new(move |it| Contingencies::read(it, &trees.actions()).map(drop))),
        ]
    }

    /// What is said of the file with `text` in it.
    fn mistakes(&self, text: String) -> Vec<Mistake> {
        let source = Source { path: self.source.path.clone(), text };
        (self.read)(&source).map_or_else(|it| it.0, |()| Vec::new())
    }

    /// Its lines `key = value`, each key of a table once: a thousand rows of one kind teach nothing new.
    fn entries(&self) -> Vec<Entry> {
        let (mut table, mut seen, mut entries) = (String::new(), BTreeSet::new(), Vec::new());
        for (line, text) in self.source.text.lines().enumerate() {
            match text.split_once(" = ") {
                _ if text.starts_with('#') => {}
                _ if text.starts_with('[') => table = text.to_owned(),
                // The first line of a value over several lines is not an entry.
                Some((key, value))
                    if toml::from_str::<toml::Table>(text).is_ok() && seen.insert((table.clone(), key.to_owned())) =>
                {
                    entries.push(Entry { line, key: key.to_owned(), value: value.to_owned() });
                }
                _ => {}
            }
        }
        entries
    }

    /// The text with another line in the place of an entry's.
    fn with(&self, entry: &Entry, line: &str) -> String {
        let lines = self.source.text.lines().enumerate();
        lines.map(|(at, text)| if at == entry.line { line } else { text }).collect::<Vec<_>>().join("\n")
    }

    /// What is wrong with what is said of the file with `line` in the place of an entry's: something is, and of that line only.
    fn complaints(&self, entry: &Entry, line: &str) -> Vec<String> {
        let at = format!("{}:{}: `{line}`", self.source.path.display(), entry.line + 1);
        let mistakes = self.mistakes(self.with(entry, line));
        if mistakes.is_empty() {
            return vec![format!("{at} is accepted")];
        }
        let is_elsewhere = |it: &&Mistake| it.place.as_ref().is_none_or(|it| it.line != entry.line + 1);
        mistakes.iter().filter(is_elsewhere).map(|it| format!("{at} is said to be: {it}")).collect()
    }
}

/// Puts each of the lines that `wrong` makes of an entry in its place.
#[track_caller]
fn check(wrong: impl Fn(&Entry) -> Vec<String>) {
    let mut complaints = Vec::new();
    for file in Shipped::all() {
        for entry in file.entries() {
            complaints.extend(wrong(&entry).iter().flat_map(|line| file.complaints(&entry, line)));
        }
    }
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

/// A line `key = value`.
struct Entry {
    /// Counted from 0.
    line: usize,
    key: String,
    value: String,
}

impl Entry {
    fn is_number(&self) -> bool {
        self.value.parse::<f64>().is_ok()
    }
}

#[test]
fn a_value_of_another_kind_is_refused_at_its_line_whichever_key_it_has() {
    check(|it| {
        let other = if it.value.starts_with('"') { "[[]]" } else { "\"something else\"" };
        vec![format!("{} = {other}", it.key)]
    });
}

#[test]
fn a_number_that_is_none_or_beyond_all_bounds_is_refused_at_its_line_whichever_key_it_has() {
    let values = |it: &Entry| if it.is_number() { &["nan", "-inf", "1e300", "-1e300"][..] } else { &[] };
    check(|it| values(it).iter().map(|value| format!("{} = {value}", it.key)).collect());
}

#[test]
fn a_key_that_is_misspelt_is_refused_at_its_line_whichever_it_is() {
    for file in Shipped::all() {
        for entry in file.entries() {
            let line = format!("{}x = {}", entry.key, entry.value);
            let mistakes = file.mistakes(file.with(&entry, &line));
            let at_line = |it: &Mistake| it.place.as_ref().is_some_and(|it| it.line == entry.line + 1);
            assert!(mistakes.iter().any(at_line), "`{line}`: {mistakes:?}");
        }
    }
}

/// Words of TOML, and what no file has.
const WORDS: [&str; 20] = [
    "[",
    "]",
    "[[",
    "]]",
    "{",
    "}",
    "=",
    ",",
    ".",
    "\"",
    "\"\"\"",
    "'",
    "#",
    "\n",
    "nan",
    "-inf",
    "1e999",
    "99999999999999999999",
    "\u{0}",
    "\u{202e}",
];

/// Something that happens to a file in an editor, on a disk or by hand.
#[derive(Debug, Clone)]
enum Edit {
    Insert(Index, usize),
    Delete(Index, usize),
    Repeat(Index, usize, usize),
    Cut(Index),
}

fn edit() -> impl Strategy<Value = Edit> {
    prop_oneof![
        4 => (any::<Index>(), 0..WORDS.len()).prop_map(|(at, word)| Edit::Insert(at, word)),
        3 => (any::<Index>(), 1..200usize).prop_map(|(at, length)| Edit::Delete(at, length)),
        2 => (any::<Index>(), 1..500usize, 1..50usize).prop_map(|(at, length, times)| Edit::Repeat(at, length, times)),
        1 => any::<Index>().prop_map(Edit::Cut),
    ]
}

fn edited(text: &str, edit: &Edit) -> String {
    let chars: Vec<char> = text.chars().chain(['\n']).collect();
    let part = |at: &Index, length: usize| at.index(chars.len())..(at.index(chars.len()) + length).min(chars.len());
    let (range, new): (_, String) = match edit {
        Edit::Insert(at, word) => (part(at, 0), WORDS[*word].to_owned()),
        Edit::Delete(at, length) => (part(at, *length), String::new()),
        Edit::Repeat(at, length, times) => {
            let range = part(at, *length);
            (range.clone(), chars[range].iter().collect::<String>().repeat(*times))
        }
        Edit::Cut(at) => (part(at, chars.len()), String::new()),
    };
    chars[..range.start].iter().copied().chain(new.chars()).chain(chars[range.end..].iter().copied()).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Nothing panics, and a mistake is one that can be shown: in a line of the text, of which there are no more than fit a screen.
    #[test]
    fn whatever_is_in_a_file_it_is_read_or_its_mistakes_are_told(file in 0..3usize, edits in prop::collection::vec(edit(), 1..6)) {
        let shipped = &Shipped::all()[file];
        let text = edits.iter().fold(shipped.source.text.clone(), |text, it| edited(&text, it));
        let mistakes = shipped.mistakes(text.clone());
        for it in &mistakes {
            let is_there = it.place.as_ref().is_none_or(|it| it.line <= text.lines().count() + 1);
            prop_assert!(is_there && !it.to_string().is_empty(), "{it}");
        }
    }
}

#[test]
fn an_access_folder_without_tokens_is_refused_with_what_to_do() {
    use std::os::unix::fs::PermissionsExt;
    let said = |folder: &Path| check_access(Some(folder)).map_or_else(|it| it.to_string(), |()| "fine".to_owned());
    assert_eq!(check_access(None), Ok(()));
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("absent");
    let tokens = folder.join("tokens.toml");
    let expected = format!(
        "{}: No such file or directory (os error 2); expected the tokens of those who may use the gateway\n  \
         help: make the folder if there is none, and a token in it: `kittiwake access {} --secret FILE`",
        tokens.display(),
        folder.display()
    );
    assert_eq!(said(&folder), expected);
    std::fs::create_dir(&folder).unwrap();
    assert_eq!(said(&folder), expected);
    std::fs::write(&tokens, "").unwrap();
    std::fs::set_permissions(&tokens, std::fs::Permissions::from_mode(0o644)).unwrap();
    assert!(said(&folder).contains("its mode is 0644"), "{}", said(&folder));
    std::fs::set_permissions(&tokens, std::fs::Permissions::from_mode(0o600)).unwrap();
    assert_eq!(said(&folder), "fine");
    std::fs::write(&tokens, "[[token]]\nname = 7\n").unwrap();
    assert!(said(&folder).contains("tokens.toml:2"), "{}", said(&folder));
}
