//! From tokens to expressions.

use super::expr::{Assignment, Binary, Comparison, Expr, Unary};
use super::token::{Token, next_token};
use crate::value::Value;

/// An expression cannot be read.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SyntaxError {
    pub(crate) reason: String,
}

impl SyntaxError {
    pub(crate) fn new(reason: String) -> Self {
        SyntaxError { reason }
    }
}

/// Expressions nested deeper are refused: checking and computing them recurses.
const MAX_DEPTH: u32 = 100;

/// Reads a script. `name` says what a name stands for: a key, or a number with a name.
pub(crate) fn parse(text: &str, name: &mut dyn FnMut(&str) -> Expr) -> Result<Vec<Expr>, SyntaxError> {
    let mut parser = Parser { rest: text, peeked: None, name };
    parser.advance()?;
    let mut statements = Vec::new();
    while parser.peeked.is_some() {
        statements.push(parser.expression(0, 0)?.0);
        if !parser.take(";")? && parser.peeked.is_some() {
            return Err(SyntaxError::new(format!("{} where an operator or `;` was expected", parser.found())));
        }
        while parser.take(";")? {}
    }
    if statements.is_empty() { Err(SyntaxError::new("nothing to compute".to_owned())) } else { Ok(statements) }
}

struct Parser<'a, 'n> {
    rest: &'a str,
    peeked: Option<Token<'a>>,
    name: &'n mut dyn FnMut(&str) -> Expr,
}

/// An expression and how deeply it is nested.
type Parsed = Result<(Expr, u32), SyntaxError>;

// What binds tighter has the higher number.
const TERNARY: u8 = 2;
const COMPARISON: u8 = 5;

impl<'a> Parser<'a, '_> {
    /// Reads operators that bind at least as tightly as `least`, and their operands.
    fn expression(&mut self, least: u8, depth: u32) -> Parsed {
        let is_name = matches!(self.peeked, Some(Token::Name(_)));
        let mut left = self.operand(depth)?;
        while let Some(Token::Sign(sign)) = self.peeked {
            if let Some(how) = assignment(sign) {
                return if least == 0 && is_name { self.assign(left, how, depth) } else { Err(not_assignable()) };
            }
            if sign == "?" && least <= TERNARY {
                return self.ternary(left, depth);
            }
            if comparison(sign).is_some() && least <= COMPARISON {
                left = self.comparisons(left, depth)?;
                continue;
            }
            let Some((operator, binds)) = binary(sign).filter(|(_, binds)| least <= *binds) else {
                break;
            };
            self.advance()?;
            let (right, right_depth) = self.expression(binds + 1, depth + 1)?;
            let (expr, left_depth) = left;
            left = (Expr::Binary(operator, Box::new(expr), Box::new(right)), nested(left_depth.max(right_depth))?);
        }
        Ok(left)
    }

    fn operand(&mut self, depth: u32) -> Parsed {
        nested(depth)?;
        let token = self.peeked.ok_or_else(|| SyntaxError::new("an operand is missing at the end".to_owned()))?;
        let expr = match token {
            Token::Int(it) => Expr::Literal(Value::Int(it)),
            Token::Float(it) => Expr::Literal(Value::Float(it)),
            Token::Bool(it) => Expr::Literal(Value::Bool(it)),
            Token::Text(it) => Expr::Literal(Value::Text(it.into())),
            Token::Name(it) => (self.name)(it),
            Token::Sign("(") => {
                self.advance()?;
                let inside = self.expression(0, depth + 1)?;
                return if self.take(")")? { Ok(inside) } else { Err(self.expected("`)`")) };
            }
            Token::Sign("-") => return self.unary(Unary::Negate, depth),
            Token::Sign("~") => return self.unary(Unary::Complement, depth),
            Token::Sign("!") => return self.unary(Unary::Not, depth),
            Token::Sign(_) => return Err(self.expected("an operand")),
        };
        self.advance()?;
        Ok((expr, 0))
    }

    fn unary(&mut self, operator: Unary, depth: u32) -> Parsed {
        self.advance()?;
        let (operand, operand_depth) = self.operand(depth + 1)?;
        Ok((Expr::Unary(operator, Box::new(operand)), nested(operand_depth)?))
    }

    fn assign(&mut self, left: (Expr, u32), how: Assignment, depth: u32) -> Parsed {
        let (Expr::Key(key), _) = left else {
            return Err(not_assignable());
        };
        self.advance()?;
        let (value, value_depth) = self.expression(0, depth + 1)?;
        Ok((Expr::Assign(key, how, Box::new(value)), nested(value_depth)?))
    }

    fn ternary(&mut self, condition: (Expr, u32), depth: u32) -> Parsed {
        self.advance()?;
        let (then, then_depth) = self.expression(0, depth + 1)?;
        if !self.take(":")? {
            return Err(self.expected("`:`"));
        }
        let (otherwise, otherwise_depth) = self.expression(TERNARY, depth + 1)?;
        let deepest = condition.1.max(then_depth).max(otherwise_depth);
        Ok((Expr::If(Box::new(condition.0), Box::new(then), Box::new(otherwise)), nested(deepest)?))
    }

    fn comparisons(&mut self, first: (Expr, u32), depth: u32) -> Parsed {
        let (first, mut deepest) = first;
        let mut rest = Vec::new();
        while let Some(operator) =
            self.peeked.and_then(|token| if let Token::Sign(it) = token { comparison(it) } else { None })
        {
            self.advance()?;
            let (operand, operand_depth) = self.expression(COMPARISON + 1, depth + 1)?;
            deepest = deepest.max(operand_depth);
            rest.push((operator, operand));
        }
        Ok((Expr::Compare(Box::new(first), rest), nested(deepest)?))
    }

    fn advance(&mut self) -> Result<(), SyntaxError> {
        self.peeked = match next_token(self.rest)? {
            Some((token, rest)) => {
                self.rest = rest;
                Some(token)
            }
            None => None,
        };
        Ok(())
    }

    fn take(&mut self, sign: &str) -> Result<bool, SyntaxError> {
        let is_there = matches!(self.peeked, Some(Token::Sign(it)) if it == sign);
        if is_there {
            self.advance()?;
        }
        Ok(is_there)
    }

    fn expected(&self, what: &str) -> SyntaxError {
        SyntaxError::new(format!("{} where {what} was expected", self.found()))
    }

    fn found(&self) -> String {
        match self.peeked {
            None => "the end".to_owned(),
            Some(Token::Sign(it)) => format!("`{it}`"),
            Some(Token::Name(it)) => format!("`{it}`"),
            Some(Token::Text(it)) => format!("'{it}'"),
            Some(Token::Int(it)) => format!("`{it}`"),
            Some(Token::Float(it)) => format!("`{it}`"),
            Some(Token::Bool(it)) => format!("`{it}`"),
        }
    }
}

fn nested(depth: u32) -> Result<u32, SyntaxError> {
    if depth < MAX_DEPTH {
        Ok(depth + 1)
    } else {
        Err(SyntaxError::new("too many operators in one another".to_owned()))
    }
}

fn not_assignable() -> SyntaxError {
    SyntaxError::new("only a key can be assigned to".to_owned())
}

fn assignment(sign: &str) -> Option<Assignment> {
    Some(match sign {
        ":=" => Assignment::Create,
        "=" => Assignment::Set,
        "+=" => Assignment::With(Binary::Plus),
        "-=" => Assignment::With(Binary::Minus),
        "*=" => Assignment::With(Binary::Times),
        "/=" => Assignment::With(Binary::Divide),
        _ => return None,
    })
}

fn comparison(sign: &str) -> Option<Comparison> {
    Some(match sign {
        "==" => Comparison::Equal,
        "!=" => Comparison::NotEqual,
        "<" => Comparison::Less,
        ">" => Comparison::Greater,
        "<=" => Comparison::LessEqual,
        ">=" => Comparison::GreaterEqual,
        _ => return None,
    })
}

fn binary(sign: &str) -> Option<(Binary, u8)> {
    Some(match sign {
        "||" => (Binary::Or, 3),
        "&&" => (Binary::And, 4),
        "|" => (Binary::BitOr, 6),
        "^" => (Binary::BitXor, 6),
        "&" => (Binary::BitAnd, 7),
        "+" => (Binary::Plus, 8),
        "-" => (Binary::Minus, 8),
        ".." => (Binary::Concat, 8),
        "*" => (Binary::Times, 9),
        "/" => (Binary::Divide, 9),
        _ => return None,
    })
}
