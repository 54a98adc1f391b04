//! All mistakes of a TOML file at once, in the words of who writes it.
//!
//! The parser goes on after a mistake in the form. One in a value ends its work: the value is then replaced, in a copy that is thrown away, by
//! one that is taken, and the copy is read again. Where no replacement is taken, what comes after that mistake is not looked at.

use std::ops::Range;

use serde::de::DeserializeOwned;
use toml::de::{DeTable, Error};

use super::limits::MOST_MISTAKES;

/// Of a longer text, in bytes, only the first mistake in a value is reported: it would be read again and again. Files written by hand are
/// shorter.
const LONGEST: usize = 256 * 1024;
/// Values of every kind. One of them is taken in most places; where a number is, two.
const VALUES: [&str; 8] = ["1", "2", "0", "\"\"", "\"a\"", "true", "[]", "{}"];
/// How Rust names what is expected, and how people do. Longer names first.
const WORDS: [(&str, &str); 12] = [
    ("a nonzero u8", "a whole number from 1 to 255"),
    ("a nonzero u16", "a whole number from 1 to 65535"),
    ("a nonzero u32", "a whole number above 0"),
    ("a nonzero u64", "a whole number above 0"),
    ("u8", "a whole number from 0 to 255"),
    ("u16", "a whole number from 0 to 65535"),
    ("u32", "a whole number, 0 or more"),
    ("u64", "a whole number, 0 or more"),
    ("usize", "a whole number, 0 or more"),
    ("i64", "a whole number"),
    ("f32", "a number"),
    ("f64", "a number"),
];

/// Where a mistake is, by byte range, and what it is.
pub(super) type Found = (Option<Range<usize>>, String);

/// Reads `text`.
///
/// # Errors
/// The mistakes in it, in their order.
pub(super) fn parse<T: DeserializeOwned>(text: &str) -> Result<T, Vec<Found>> {
    let first = match toml::from_str(text) {
        Ok(value) => return Ok(value),
        Err(error) => error,
    };
    let (_, of_form) = DeTable::parse_recoverable(text);
    if !of_form.is_empty() {
        return Err(of_form.iter().take(MOST_MISTAKES).map(found).collect());
    }
    Err(of_values::<T>(text.to_owned(), first))
}

fn of_values<T: DeserializeOwned>(mut text: String, mut error: Error) -> Vec<Found> {
    let (mut mistakes, mut replaced) = (Vec::new(), Vec::<Range<usize>>::new());
    while mistakes.len() < MOST_MISTAKES {
        mistakes.push(found(&error));
        if LONGEST < text.len() {
            break;
        }
        let Some(span) = error.span().filter(|it| it.end <= text.len()) else { break };
        let place = if error.message().starts_with("unknown field") { line(&text, &span) } else { Some(span) };
        let Some(place) = place else { break };
        replaced.push(place.clone());
        let mut taken = Vec::new();
        for value in candidates(&error, &place) {
            let mut patched = text.clone();
            // Of the same length, so that every other place stays where it is.
            patched.replace_range(place.clone(), &format!("{value:<0$}", place.len()));
            // A table that lacks a key is found at its header, which no value replaces.
            if !DeTable::parse_recoverable(&patched).1.is_empty() {
                continue;
            }
            match toml::from_str::<T>(&patched) {
                Ok(_) => return in_order(mistakes),
                // A contradiction to a replacement, at its place, is not a mistake of the file.
                Err(next) if next.span().is_some_and(|it| replaced.iter().all(|of| is_apart(&it, of))) => {
                    taken.push((patched, next));
                }
                Err(_) => {}
            }
        }
        match that_stays(taken) {
            Some(next) => (text, error) = next,
            None => break,
        }
    }
    in_order(mistakes)
}

/// The first mistake, with the text that it was found in, that stays whatever replaces the one before it: one that changes is what the
/// replacement contradicts elsewhere, as another value of its table.
fn that_stays(mut taken: Vec<(String, Error)>) -> Option<(String, Error)> {
    let same = |a: &Error, b: &Error| a.message() == b.message() && a.span() == b.span();
    let stays = |it: &(String, Error)| taken.len() == 1 || 1 < taken.iter().filter(|of| same(&of.1, &it.1)).count();
    let first = taken.iter().position(stays)?;
    Some(taken.swap_remove(first))
}

fn is_apart(a: &Range<usize>, b: &Range<usize>) -> bool {
    a.end <= b.start || b.end <= a.start
}

/// The parser looks at keys by their names.
fn in_order(mut mistakes: Vec<Found>) -> Vec<Found> {
    mistakes.sort_by_key(|(span, _)| span.as_ref().map(|it| it.start));
    mistakes
}

/// What may stand at `place` instead: for a key that is not known nothing, else what the message names, and values of every kind.
fn candidates(error: &Error, place: &Range<usize>) -> impl Iterator<Item = String> {
    let message = error.message().to_owned();
    let is_key = message.starts_with("unknown field");
    let expected = message.split_once("expected").map(|it| it.1.to_owned()).unwrap_or_default();
    let named: Vec<String> = expected.split('`').skip(1).step_by(2).map(|it| format!("\"{it}\"")).collect();
    let values = named.into_iter().chain(VALUES.map(str::to_owned)).filter(move |_| !is_key);
    let room = place.len();
    is_key.then(String::new).into_iter().chain(values.filter(move |it| it.len() <= room))
}

/// The line around a key, if its value ends in it.
fn line(text: &str, key: &Range<usize>) -> Option<Range<usize>> {
    let start = text[..key.start].rfind('\n').map_or(0, |it| it + 1);
    let end = text[key.end..].find('\n').map_or(text.len(), |it| key.end + it);
    toml::from_str::<toml::Table>(&text[start..end]).ok().map(|_| start..end)
}

fn found(error: &Error) -> Found {
    (error.span(), in_words(error.message()))
}

/// A message without Rust's names of types.
fn in_words(message: &str) -> String {
    let message = message.trim().replace('\n', "; ");
    let Some((before, expected)) = message.rsplit_once("expected ") else { return message };
    let known = WORDS.iter().find(|(rust, _)| expected == *rust);
    known.map_or_else(|| message.clone(), |(_, words)| format!("{before}expected {words}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "only whether it can be read is of interest")]
    struct Config {
        speed: f64,
        count: std::num::NonZeroU32,
        name: String,
        kind: Kind,
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(rename_all = "kebab-case")]
    enum Kind {
        Slow,
        VeryFast,
    }

    #[track_caller]
    fn check(text: &str, expected: &[&str]) {
        let found = parse::<Config>(text).err().unwrap_or_default();
        let at = |span: Option<Range<usize>>| span.map_or(0, |it| text[..it.start].matches('\n').count() + 1);
        let found: Vec<String> = found.into_iter().map(|(span, message)| format!("{}: {message}", at(span))).collect();
        assert_eq!(found.len(), expected.len(), "{found:#?}");
        for (found, expected) in found.iter().zip(expected) {
            assert!(found.starts_with(expected), "{found}, expected {expected}");
        }
    }

    #[test]
    fn all_mistakes_in_values_are_found_in_the_words_of_people() {
        let good = "speed = 1.0\ncount = 12\nname = \"a\"\nkind = \"slow\"\n";
        check(good, &[]);
        check(&good.replace("1.0", "\"fast\""), &["1: invalid type: string \"fast\", expected a number"]);
        check(
            "speed = \"fast\"\ncount = -1\nname = 123\nkind = \"quick\"\nspee = 1\n",
            &[
                "1: invalid type: string \"fast\", expected a number",
                "2: invalid value: integer `-1`, expected a whole number above 0",
                "3: invalid type: integer `123`, expected a string",
                "4: unknown variant `quick`, expected `slow` or `very-fast`",
                "5: unknown field `spee`",
            ],
        );
    }

    #[test]
    fn a_value_that_fits_no_replacement_is_one_mistake() {
        #[derive(Debug, serde::Deserialize)]
        #[expect(dead_code, reason = "only whether it can be read is of interest")]
        struct File {
            band: Band,
            count: u8,
        }
        #[derive(Debug, serde::Deserialize)]
        #[serde(try_from = "(f64, f64)")]
        struct Band;
        impl TryFrom<(f64, f64)> for Band {
            type Error = String;
            fn try_from((low, high): (f64, f64)) -> Result<Band, String> {
                if low < high { Ok(Band) } else { Err(format!("found {low} to {high}")) }
            }
        }
        let said =
            |text: &str| parse::<File>(text).err().unwrap_or_default().into_iter().map(|it| it.1).collect::<Vec<_>>();
        let low = "invalid type: string \"low\", expected a number";
        assert_eq!(said("count = 1\nband = [\"low\", -5.0]\n"), [low]);
        let count = "invalid type: string \"one\", expected a whole number from 0 to 255";
        assert_eq!(said("band = [\"low\", 9.0]\ncount = \"one\"\n"), [low, count]);
    }

    #[test]
    fn a_table_that_lacks_a_key_is_one_mistake() {
        #[derive(Debug, serde::Deserialize)]
        #[expect(dead_code, reason = "only whether it can be read is of interest")]
        struct Table {
            row: Vec<Config>,
        }
        let text = "[[row]]\nspeed = 1.0\ncount = 12\nname = \"a\"\n[[row]]\nspeed = 1.0\n";
        let found = parse::<Table>(text).err().unwrap_or_default();
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!(found[0].1, "missing field `kind`");
    }

    #[test]
    fn all_mistakes_in_the_form_are_found() {
        let text = "speed = = 1\ncount = 3\nname = \"a\nkind = \"slow\"\n";
        let found = parse::<Config>(text).err().unwrap_or_default();
        assert!(2 <= found.len(), "{found:?}");
    }

    #[test]
    fn what_has_no_end_is_bounded() {
        #[derive(Debug, serde::Deserialize)]
        struct Many {
            #[expect(dead_code, reason = "only whether it can be read is of interest")]
            values: Vec<f64>,
        }
        let text = format!("values = [{}]", "true, ".repeat(100));
        assert_eq!(parse::<Many>(&text).err().map(|it| it.len()), Some(MOST_MISTAKES));
    }
}
