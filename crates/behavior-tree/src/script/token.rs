//! From text to tokens.

use super::parse::SyntaxError;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Token<'a> {
    Name(&'a str),
    Text(&'a str),
    Int(i64),
    Float(f64),
    Bool(bool),
    /// An operator or a bracket.
    Sign(&'static str),
}

/// Longer ones first, so that `<=` is not read as `<`.
const SIGNS: [&str; 27] = [
    "..", "&&", "||", "==", "!=", "<=", ">=", ":=", "+=", "-=", "*=", "/=", "+", "-", "*", "/", "&", "|", "^", "~",
    "!", "<", ">", "=", "?", ":", ";",
];

const BRACKETS: [&str; 2] = ["(", ")"];

/// The next token and what follows it; `None` at the end.
pub(crate) fn next_token(text: &str) -> Result<Option<(Token<'_>, &str)>, SyntaxError> {
    let text = text.trim_start_matches([' ', '\t', '\n', '\r']);
    let Some(first) = text.chars().next() else {
        return Ok(None);
    };
    let found = if first == '\'' {
        quoted(text)?
    } else if first.is_ascii_digit() {
        number(text)?
    } else if first.is_ascii_alphabetic() || first == '_' || first == '@' {
        name(text)
    } else {
        let sign = SIGNS.iter().chain(&BRACKETS).find(|sign| text.starts_with(**sign));
        let sign = sign.ok_or_else(|| SyntaxError::new(format!("unexpected `{first}`")))?;
        (Token::Sign(sign), &text[sign.len()..])
    };
    Ok(Some(found))
}

fn quoted(text: &str) -> Result<(Token<'_>, &str), SyntaxError> {
    match text[1..].split_once('\'') {
        Some((inside, rest)) => Ok((Token::Text(inside), rest)),
        None => Err(SyntaxError::new("a text in quotes does not end".to_owned())),
    }
}

fn name(text: &str) -> (Token<'_>, &str) {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let end = text[1..].find(|c| !is_part(c)).map_or(text.len(), |end| end + 1);
    let (name, rest) = text.split_at(end);
    match name {
        "true" => (Token::Bool(true), rest),
        "false" => (Token::Bool(false), rest),
        _ => (Token::Name(name), rest),
    }
}

fn number(text: &str) -> Result<(Token<'_>, &str), SyntaxError> {
    let hexadecimal = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X"));
    if let Some(digits) = hexadecimal {
        let end = digits.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(digits.len());
        let (digits, rest) = digits.split_at(end);
        let number = i64::from_str_radix(digits, 16);
        let number = number.map_err(|_| SyntaxError::new(format!("0x{digits} is not a whole number")))?;
        return Ok((Token::Int(number), rest));
    }
    let (literal, rest) = text.split_at(decimal_end(text));
    let is_glued = rest.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_');
    let lacks_fraction = literal.split_once('.').is_some_and(|(_, it)| !it.starts_with(|c: char| c.is_ascii_digit()));
    let is_whole = literal.bytes().all(|digit| digit.is_ascii_digit());
    let token = match is_whole {
        true => literal.parse().ok().map(Token::Int),
        false => literal.parse().ok().filter(|it: &f64| it.is_finite()).map(Token::Float),
    };
    match token {
        Some(token) if !is_glued && !lacks_fraction => Ok((token, rest)),
        _ => Err(SyntaxError::new(format!("`{literal}` is not a number"))),
    }
}

/// The length of the number at the start. `65..` is the number 65 before the operator `..`.
fn decimal_end(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits = |from: usize| bytes[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let mut end = digits(0);
    if bytes.get(end) == Some(&b'.') && bytes.get(end + 1) != Some(&b'.') {
        end += 1 + digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        end += 1 + sign;
        end += digits(end.min(bytes.len()));
    }
    end.min(bytes.len())
}
