//! From tokens to expressions.

use super::expr::{Assignment, Binary, Comparison, Expr, Unary};
use super::token::{SyntaxError, Token, next_token};
use crate::values::value::Value;

/// Expressions nested deeper are refused, because checking and computing them recurses.
const MAX_DEPTH: u32 = 100;

/// Reads a script. `name` resolves a name: to a key, or to a number that has a name.
pub(crate) fn parse(text: &str, name: &mut dyn FnMut(&str) -> Expr) -> Result<Vec<Expr>, SyntaxError> {
    let mut parser = Parser { rest: text, peeked: None, name };
    parser.advance()?;
    let mut statements = Vec::new();
    while parser.peeked.is_some() {
        statements.push(parser.expression(0, 0)?.0);
        if !parser.take(";")? && parser.peeked.is_some() {
            return Err(parser.expected("an operator or `;`"));
        }
        while parser.take(";")? {}
    }
    if statements.is_empty() { Err(SyntaxError::new("the expression is empty")) } else { Ok(statements) }
}

struct Parser<'a, 'n> {
    /// What follows the next token.
    rest: &'a str,
    /// The next token. `None` at the end.
    peeked: Option<Token<'a>>,
    name: &'n mut dyn FnMut(&str) -> Expr,
}

/// An expression and how deeply it is nested.
type Parsed = Result<(Expr, u32), SyntaxError>;

// How tightly operators bind: the higher, the tighter.
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
        let expr = match self.peeked.ok_or_else(|| self.expected("an operand"))? {
            Token::Int(number) => Expr::Literal(Value::Int(number)),
            Token::Float(number) => Expr::Literal(Value::Float(number)),
            Token::Bool(flag) => Expr::Literal(Value::Bool(flag)),
            Token::Text(text) => Expr::Literal(Value::Text(text.into())),
            Token::Name(name) => (self.name)(name),
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
            self.peeked.and_then(|token| if let Token::Sign(sign) = token { comparison(sign) } else { None })
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

    /// Reads `sign`, if it is next.
    fn take(&mut self, sign: &'static str) -> Result<bool, SyntaxError> {
        let is_next = self.peeked == Some(Token::Sign(sign));
        if is_next {
            self.advance()?;
        }
        Ok(is_next)
    }

    fn expected(&self, what: &str) -> SyntaxError {
        let found = match self.peeked {
            None => "the end".to_owned(),
            Some(Token::Sign(text) | Token::Name(text)) => format!("`{text}`"),
            Some(Token::Text(text)) => format!("'{text}'"),
            Some(Token::Int(number)) => format!("`{number}`"),
            Some(Token::Float(number)) => format!("`{number}`"),
            Some(Token::Bool(flag)) => format!("`{flag}`"),
        };
        SyntaxError::new(format!("expected {what}, found {found}"))
    }
}

fn nested(depth: u32) -> Result<u32, SyntaxError> {
    if depth < MAX_DEPTH {
        Ok(depth + 1)
    } else {
        Err(SyntaxError::new(format!("nested deeper than {MAX_DEPTH} levels")))
    }
}

fn not_assignable() -> SyntaxError {
    SyntaxError::new("only a key can be assigned to")
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
