//! From text to tokens.

/// An expression cannot be read.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SyntaxError {
    pub(crate) reason: String,
}

impl SyntaxError {
    pub(super) fn new(reason: impl Into<String>) -> Self {
        SyntaxError { reason: reason.into() }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Token<'a> {
    Name(&'a str),
    Text(&'a str),
    Int(i64),
    Float(f64),
    Bool(bool),
    /// An operator or a bracket.
    Sign(&'static str),
}

/// The longer ones come first, so that `<=` is not read as `<`.
const SIGNS: [&str; 29] = [
    "..", "&&", "||", "==", "!=", "<=", ">=", ":=", "+=", "-=", "*=", "/=", "+", "-", "*", "/", "&", "|", "^", "~",
    "!", "<", ">", "=", "?", ":", ";", "(", ")",
];

/// The next token and what follows it. `None` at the end.
pub(super) fn next_token(text: &str) -> Result<Option<(Token<'_>, &str)>, SyntaxError> {
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
        let sign = SIGNS.iter().find(|sign| text.starts_with(**sign));
        let sign = sign.ok_or_else(|| SyntaxError::new(format!("unexpected character `{first}`")))?;
        (Token::Sign(sign), &text[sign.len()..])
    };
    Ok(Some(found))
}

fn quoted(text: &str) -> Result<(Token<'_>, &str), SyntaxError> {
    match text[1..].split_once('\'') {
        Some((inside, rest)) => Ok((Token::Text(inside), rest)),
        None => Err(SyntaxError::new("a text has no closing quote")),
    }
}

fn name(text: &str) -> (Token<'_>, &str) {
    let end = text[1..].find(|c| !is_part_of_name(c)).map_or(text.len(), |end| end + 1);
    let (name, rest) = text.split_at(end);
    match name {
        "true" => (Token::Bool(true), rest),
        "false" => (Token::Bool(false), rest),
        _ => (Token::Name(name), rest),
    }
}

fn is_part_of_name(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '_'
}

fn number(text: &str) -> Result<(Token<'_>, &str), SyntaxError> {
    let is_hexadecimal = text.starts_with("0x") || text.starts_with("0X");
    let end = if is_hexadecimal { 2 } else { decimal_end(text) };
    // Letters that follow belong to the number, or make it none.
    let end = text[end..].find(|c| !is_part_of_name(c)).map_or(text.len(), |letters| end + letters);
    let (literal, rest) = text.split_at(end);
    let lacks_fraction = literal.split_once('.').is_some_and(|(_, it)| !it.starts_with(|c: char| c.is_ascii_digit()));
    let is_integer = literal.bytes().all(|digit| digit.is_ascii_digit());
    let token = if is_hexadecimal {
        i64::from_str_radix(&literal[2..], 16).ok().map(Token::Int)
    } else if is_integer {
        literal.parse().ok().map(Token::Int)
    } else {
        literal.parse().ok().filter(|it: &f64| it.is_finite() && !lacks_fraction).map(Token::Float)
    };
    let token = token.ok_or_else(|| SyntaxError::new(format!("`{literal}` is not a number")))?;
    Ok((token, rest))
}

/// The length of the decimal number at the start. `65..` is the number 65 before the operator `..`.
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
