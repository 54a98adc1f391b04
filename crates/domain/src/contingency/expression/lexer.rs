//! Splits a rule into numbers, names and symbols.

use std::ops::Range;

use super::Problem;
use crate::contingency::unit::{Unit, suffix, suffix_names};
use crate::file::did_you_mean;

/// A word or symbol of a rule.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Token {
    /// A number in the unit that values are kept in; `None`: it was written without a unit.
    Number(f64, Option<Unit>),
    /// The name of a field, of a function or of a choice.
    Name(String),
    /// Anything else.
    Symbol(Symbol),
}

/// The symbols, and the words that stand for symbols.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Symbol {
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    Equal,
    NotEqual,
    Plus,
    Minus,
    Times,
    Divide,
    Open,
    Close,
    Comma,
    And,
    Or,
    Not,
}

/// Longer symbols before those that they begin with.
const SYMBOLS: [(&str, Symbol); 13] = [
    ("<=", Symbol::LessOrEqual),
    (">=", Symbol::GreaterOrEqual),
    ("==", Symbol::Equal),
    ("!=", Symbol::NotEqual),
    ("<", Symbol::Less),
    (">", Symbol::Greater),
    ("+", Symbol::Plus),
    ("-", Symbol::Minus),
    ("*", Symbol::Times),
    ("/", Symbol::Divide),
    ("(", Symbol::Open),
    (")", Symbol::Close),
    (",", Symbol::Comma),
];

const WORDS: [(&str, Symbol); 3] = [("and", Symbol::And), ("or", Symbol::Or), ("not", Symbol::Not)];

impl Symbol {
    /// As it is written in a rule.
    pub(super) fn written(self) -> &'static str {
        SYMBOLS.iter().chain(&WORDS).find(|(_, symbol)| *symbol == self).map_or("", |(text, _)| *text)
    }
}

/// The tokens of `text`, each with its place.
pub(super) fn tokens(text: &str) -> Result<Vec<(Token, Range<usize>)>, Problem> {
    let mut lexer = Lexer { text, at: 0 };
    let mut found = Vec::new();
    loop {
        lexer.skip_space();
        let from = lexer.at;
        let Some(first) = lexer.rest().chars().next() else { return Ok(found) };
        let token = if first.is_ascii_digit() {
            lexer.number()?
        } else if is_name(first) {
            let name = lexer.take_while(|it| is_name(it) || it == '.');
            WORDS.iter().find(|(word, _)| *word == name).map_or(Token::Name(name.to_owned()), |it| Token::Symbol(it.1))
        } else if let Some((symbol, token)) = SYMBOLS.iter().find(|(symbol, _)| lexer.rest().starts_with(symbol)) {
            lexer.at += symbol.len();
            Token::Symbol(*token)
        } else {
            let help = match first {
                '=' => "compare with `==`",
                '&' => "write `and`",
                '|' => "write `or`",
                '!' => "write `not`, or `!=`",
                _ => "a rule is made of field names, numbers with units, `< <= > >= == !=`, `and or not`, `+ - * /`",
            };
            return Err(Problem::new(from..from + first.len_utf8(), format!("found `{first}`"), help));
        };
        found.push((token, from..lexer.at));
    }
}

fn is_name(it: char) -> bool {
    it.is_ascii_alphanumeric() || it == '_'
}

struct Lexer<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> Lexer<'a> {
    fn rest(&self) -> &'a str {
        &self.text[self.at..]
    }

    fn take_while(&mut self, wanted: impl Fn(char) -> bool) -> &'a str {
        let rest = self.rest();
        let taken = &rest[..rest.find(|it: char| !wanted(it)).unwrap_or(rest.len())];
        self.at += taken.len();
        taken
    }

    fn skip_space(&mut self) {
        self.take_while(char::is_whitespace);
    }

    /// Digits with at most one point, and the unit that follows them.
    fn number(&mut self) -> Result<Token, Problem> {
        let from = self.at;
        let digits = self.take_while(|it| it.is_ascii_digit() || it == '.');
        let number = digits.parse::<f64>().ok().filter(|it| it.is_finite());
        let Some(number) = number else {
            let message = format!("`{digits}` is not a number");
            return Err(Problem::new(
                from..self.at,
                message,
                "a number is digits with at most one point, such as `2.5`",
            ));
        };
        Ok(match self.unit()? {
            Some((unit, factor)) => Token::Number(number * factor, Some(unit)),
            None => Token::Number(number, None),
        })
    }

    /// The unit at this place, if there is one; `and`, `or` and operators are not units.
    fn unit(&mut self) -> Result<Option<(Unit, f64)>, Problem> {
        let after_number = self.at;
        self.skip_space();
        let from = self.at;
        if self.rest().starts_with('%') {
            self.at += 1;
            return Ok(suffix("%"));
        }
        let word = self.take_while(is_name);
        if word.is_empty() || WORDS.iter().any(|(it, _)| *it == word) {
            self.at = after_number;
            return Ok(None);
        }
        // `10 m/s` is a speed, `10 m / wind` a quotient: a unit has no spaces.
        let after_word = self.at;
        if self.rest().starts_with('/') {
            self.at += 1;
            self.take_while(is_name);
            if let Some(unit) = suffix(&self.text[from..self.at]) {
                return Ok(Some(unit));
            }
            self.at = after_word;
        }
        if let Some(unit) = suffix(word) {
            return Ok(Some(unit));
        }
        let help = did_you_mean(word, &suffix_names());
        Err(Problem::new(from..after_word, format!("there is no unit `{word}`"), help))
    }
}
