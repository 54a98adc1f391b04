use std::collections::BTreeMap;

use proptest::collection::vec;
use proptest::prelude::*;

use super::Script;
use super::check::type_of;
use super::eval::Scene;
use super::expr::Expr;
use super::parse::parse;
use crate::board::SlotDef;
use crate::values::types::Type;
use crate::values::value::Value;

/// Keys by name, in the order they are first named.
#[derive(Default)]
struct Keys(BTreeMap<String, u32>);

impl Keys {
    fn number(&mut self, name: &str) -> Expr {
        let next = self.0.len() as u32;
        Expr::Key(*self.0.entry(name.to_owned()).or_insert(next))
    }
}

fn slots(count: usize) -> Vec<SlotDef> {
    let any = || SlotDef { ty: Type::Any, initial: None, required: false, open: false };
    (0..count).map(|_| any()).collect()
}

/// The value of a script, or the error.
fn compute(text: &str) -> Result<Value, String> {
    let mut keys = Keys::default();
    let statements = parse(text, &mut |name| keys.number(name)).map_err(|error| error.reason)?;
    let names: Vec<String> = keys.0.keys().cloned().collect();
    let mut values = vec![None; names.len()];
    let slots = slots(names.len());
    let mut scene = Scene { values: &mut values, slots: &slots, compared: None };
    Script { text: text.into(), statements }.run(&mut scene).map_err(|error| error.describe(&names))
}

#[test]
fn expressions_have_the_values_the_table_says() {
    #[track_caller]
    fn check(text: &str, expected: impl Into<Value>) {
        assert_eq!(compute(text), Ok(expected.into()), "{text}");
    }
    check("1 + 2 * 3", 7);
    check("(1 + 2) * 3", 9);
    check("10 - 2 - 3", 5);
    check("7 / 2", 3.5);
    check("2e3", 2000.0);
    check("0x2A", 42);
    check("-3 + 5 - -1", 3);
    check("~0", -1);
    check("!0", true);
    check("!'a' == false", true);
    check("6 & 3 | 8 ^ 1", 11);
    check("1 < 2 <= 2 < 3", true);
    check("1 < 2 < 2", false);
    check("1 == 1.00000001", true);
    check("1 != 1.1", true);
    check("'a' < 'b'", true);
    check("'a' + 'b'", "ab");
    check("'x' .. 65..'y'", "x65y");
    check("1.5 .. ' m'", "1.5 m");
    check("true && 0 || 2", true);
    check("false && empty", false);
    check("true || empty", true);
    check("1 > 2 ? 'a' : 1 > 0 ? 'b' : 'c'", "b");
    check("a := 3; a += 2; a *= a", 25);
    check("a := 7; a /= 2; a -= 0.5", 3.0);
    check("a := b := 2; a + b;", 4);
    check("a := 1 ; ; a", 1);
    check("t := 'ab'; t += 'c'", "abc");
    check("true + true", 2);
    check("@root := 1; _own := 2; @root + _own", 3);
    check("9223372036854775807", i64::MAX);
}

#[test]
fn malformed_expressions_are_refused_with_a_reason() {
    #[track_caller]
    fn check(text: &str, reason: &str) {
        assert_eq!(compute(text).expect_err(text), reason, "{text}");
    }
    check("", "the expression is empty");
    check(" ; ", "expected an operand, found `;`");
    check("1 +", "expected an operand, found the end");
    check("1 2", "expected an operator or `;`, found `2`");
    check("(1", "expected `)`, found the end");
    check("1 ? 2", "expected `:`, found the end");
    check("3 = 4", "only a key can be assigned to");
    check("a + b = 4", "only a key can be assigned to");
    check("'open", "a text has no closing quote");
    check("3foo", "`3foo` is not a number");
    check("1.", "`1.` is not a number");
    check("0xG", "`0xG` is not a number");
    check("99999999999999999999", "`99999999999999999999` is not a number");
    check("1e999", "`1e999` is not a number");
    check("a # b", "unexpected character `#`");
    check("ä", "unexpected character `ä`");
    check(&"(".repeat(1000), "nested deeper than 100 levels");
    check(&"1+".repeat(100_000), "nested deeper than 100 levels");
    check(&"!".repeat(100_000), "nested deeper than 100 levels");
}

#[test]
fn expressions_that_cannot_be_computed_give_a_reason() {
    #[track_caller]
    fn check(text: &str, reason: &str) {
        assert_eq!(compute(text).expect_err(text), reason, "{text}");
    }
    check("a + 1", "key `a` has no value yet");
    check("a += 1", "key `a` has no value yet");
    check("9223372036854775807 + 1", "integer overflow");
    check("'a' - 1", "`-` cannot be applied to \"a\"");
    check("1.5 & 1", "`&` cannot be applied to 1");
    check("'a' < 1", "`<` cannot be applied to \"a\"");
    check("-'a'", "`-` cannot be applied to \"a\"");
}

#[test]
fn types_are_inferred() {
    #[track_caller]
    fn check(text: &str, expected: Result<Type, &str>) {
        let types = [Type::Bool, Type::Int, Type::Float, Type::Text, Type::Any];
        let names = ["b", "i", "f", "t", "x"];
        let key = |name: &str| Expr::Key(names.iter().position(|it| *it == name).expect("a known key") as u32);
        let statements = parse(text, &mut |name| key(name)).expect("well-formed");
        let found = type_of(&statements[0], &|key| types[key as usize]);
        let found = found.map_err(|error| error.describe(&|key| names[key as usize].to_owned()));
        assert_eq!(found, expected.map_err(str::to_owned), "{text}");
    }
    check("i + 1", Ok(Type::Int));
    check("i + b", Ok(Type::Int));
    check("i + f", Ok(Type::Float));
    check("i / i", Ok(Type::Float));
    check("t + t", Ok(Type::Text));
    check("t .. i", Ok(Type::Text));
    check("i < f", Ok(Type::Bool));
    check("x + i", Ok(Type::Any));
    check("b ? i : f", Ok(Type::Float));
    check("f = i", Ok(Type::Float));
    check("t + i", Err("`+` cannot combine std::string and int"));
    check("t < i", Err("`<` cannot combine std::string and int"));
    check("i = f", Err("double cannot be assigned to key `i` of type int"));
    check("i /= 2", Err("double cannot be assigned to key `i` of type int"));
    check("!t", Err("std::string is neither true nor false"));
    check("f & i", Err("`&` cannot be applied to double"));
    check("b ? i : t", Err("`?:` cannot combine int and std::string"));
}

/// Parts of expressions, and a few texts that belong in no expression.
const PARTS: &[&str] = &[
    "a",
    "b",
    "@c",
    "_d",
    "1",
    "0",
    "2.5",
    "9223372036854775807",
    "0x10",
    "1e9",
    "true",
    "false",
    "'x'",
    "'",
    "+",
    "-",
    "*",
    "/",
    "..",
    "&&",
    "||",
    "&",
    "|",
    "^",
    "~",
    "!",
    "==",
    "!=",
    "<",
    ">",
    "<=",
    ">=",
    ":=",
    "=",
    "+=",
    "-=",
    "*=",
    "/=",
    "?",
    ":",
    "(",
    ")",
    ";",
    " ",
    ".",
    "#",
    "\u{e4}",
    "\u{0}",
    "1.",
    "1e",
    "0x",
];

/// A well-formed expression. Every byte makes a choice.
fn well_formed(bytes: &mut impl Iterator<Item = u8>, depth: usize) -> String {
    const LEAVES: [&str; 10] = ["a", "b", "@c", "0", "7", "2.5", "9223372036854775807", "true", "'x'", "''"];
    const OPERATORS: [&str; 16] =
        ["+", "-", "*", "/", "..", "&&", "||", "&", "|", "^", "==", "!=", "<", "<=", ">", ">="];
    const ASSIGNMENTS: [&str; 6] = [":=", "=", "+=", "-=", "*=", "/="];
    let chosen = usize::from(bytes.next().unwrap_or(0));
    if depth == 0 {
        return LEAVES[chosen % LEAVES.len()].to_owned();
    }
    let mut part = || well_formed(bytes, depth - 1);
    match chosen % 8 {
        0 => format!("({})", part()),
        1 => format!("{}{}", ["-", "~", "!"][chosen / 8 % 3], part()),
        2 => format!("({} ? {} : {})", part(), part(), part()),
        3 => format!("a {} {}", ASSIGNMENTS[chosen / 8 % 6], part()),
        4 => LEAVES[chosen / 8 % LEAVES.len()].to_owned(),
        _ => format!("{} {} {}", part(), OPERATORS[chosen / 8 % 16], part()),
    }
}

fn text_of(bytes: &[u8]) -> String {
    match bytes.split_first() {
        Some((first, rest)) if first % 2 == 0 => {
            let mut choices = rest.iter().copied();
            format!("a := 1; b := 'b'; {}; {}", well_formed(&mut choices, 4), well_formed(&mut choices, 2))
        }
        _ => bytes.iter().map(|byte| PARTS[usize::from(*byte) % PARTS.len()]).collect(),
    }
}

proptest! {
    #![proptest_config(crate::stories::fuzz::cases(1_000_000))]

    #[test]
    fn any_text_is_an_expression_or_a_syntax_error(bytes in vec(any::<u8>(), 0..=64)) {
        let text = text_of(&bytes);
        if let Ok(Value::Text(text)) = compute(&text) {
            prop_assert!(text.len() <= 64 * 1024);
        }
        let mut keys = Keys::default();
        if let Ok(statements) = parse(&text, &mut |name| keys.number(name)) {
            let types = statements.iter().map(|statement| type_of(statement, &|_| Type::Int));
            types.for_each(|found| drop(found.map_err(|error| error.describe(&|key| key.to_string()))));
        }
    }
}
