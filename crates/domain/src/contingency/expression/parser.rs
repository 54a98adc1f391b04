//! The grammar: from tokens to a tree without types.
//!
//! From the weakest to the strongest: `or`, `and`, `not`, a comparison, `+ -`, `* /`, a sign. A comparison compares two values.

use std::ops::Range;

use super::Problem;
use super::lexer::{Symbol, Token, tokens};
use crate::contingency::unit::Unit;

/// The longest rule, in bytes, and how deep its parts may lie in each other: far more than a human reads, and so little that
/// no rule exhausts the stack.
const LONGEST: usize = 1000;
const DEEPEST: usize = 40;

/// A part of a rule, and where it is.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Node {
    pub(super) part: Part,
    pub(super) span: Range<usize>,
}

/// What a part is.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Part {
    Number(f64, Option<Unit>),
    Name(String),
    Not(Box<Node>),
    Negative(Box<Node>),
    /// Two parts, joined by a symbol that takes two.
    Pair(Symbol, Box<Node>, Box<Node>),
    /// The name of a function, and its arguments.
    Call(String, Vec<Node>),
}

/// The tree of a rule.
pub(super) fn parse(text: &str) -> Result<Node, Problem> {
    if LONGEST < text.len() {
        let message = format!("the rule has {} bytes, at most {LONGEST} are read", text.len());
        return Err(Problem::new(0..text.len(), message, "split it into two rows"));
    }
    let mut parser = Parser { tokens: tokens(text)?, at: 0, depth: 0, end: text.len() };
    let node = parser.either()?;
    match parser.peek() {
        None => Ok(node),
        Some(_) => Err(parser.unexpected("`and`, `or` or the end of the rule")),
    }
}

struct Parser {
    tokens: Vec<(Token, Range<usize>)>,
    at: usize,
    depth: usize,
    end: usize,
}

impl Parser {
    fn peek(&self) -> Option<&Token> {
        self.tokens.get(self.at).map(|(token, _)| token)
    }

    /// Where the next token is, or where one is missing.
    fn place(&self) -> Range<usize> {
        self.tokens.get(self.at).map_or(self.end..self.end, |(_, span)| span.clone())
    }

    /// Takes the next token if it is one of these symbols.
    fn take(&mut self, wanted: &[Symbol]) -> Option<Symbol> {
        match self.peek() {
            Some(Token::Symbol(symbol)) if wanted.contains(symbol) => {
                let symbol = *symbol;
                self.at += 1;
                Some(symbol)
            }
            _ => None,
        }
    }

    fn unexpected(&self, expected: &str) -> Problem {
        let found = match self.peek() {
            None => "the end of the rule".to_owned(),
            Some(Token::Number(..)) => "a number".to_owned(),
            Some(Token::Name(name)) => format!("`{name}`"),
            Some(Token::Symbol(symbol)) => format!("`{}`", symbol.written()),
        };
        Problem::new(self.place(), format!("found {found}, expected {expected}"), "")
    }

    fn either(&mut self) -> Result<Node, Problem> {
        self.chain(&[Symbol::Or], Parser::both)
    }

    fn both(&mut self) -> Result<Node, Problem> {
        self.chain(&[Symbol::And], Parser::negation)
    }

    fn negation(&mut self) -> Result<Node, Problem> {
        let from = self.place().start;
        if self.take(&[Symbol::Not]).is_none() {
            return self.comparison();
        }
        let node = self.deeper(Parser::negation)?;
        let span = from..node.span.end;
        Ok(Node { part: Part::Not(Box::new(node)), span })
    }

    fn comparison(&mut self) -> Result<Node, Problem> {
        use Symbol::{Equal, Greater, GreaterOrEqual, Less, LessOrEqual, NotEqual};
        let symbols = [Less, LessOrEqual, Greater, GreaterOrEqual, Equal, NotEqual];
        let left = self.sum()?;
        let Some(symbol) = self.take(&symbols) else { return Ok(left) };
        let node = pair(symbol, left, self.sum()?);
        if matches!(self.peek(), Some(Token::Symbol(it)) if symbols.contains(it)) {
            let message = "a comparison compares two values, this would be a third";
            return Err(Problem::new(self.place(), message, "write `a < b and b < c`"));
        }
        Ok(node)
    }

    fn sum(&mut self) -> Result<Node, Problem> {
        self.chain(&[Symbol::Plus, Symbol::Minus], Parser::product)
    }

    fn product(&mut self) -> Result<Node, Problem> {
        self.chain(&[Symbol::Times, Symbol::Divide], Parser::sign)
    }

    fn sign(&mut self) -> Result<Node, Problem> {
        let from = self.place().start;
        if self.take(&[Symbol::Minus]).is_none() {
            return self.primary();
        }
        let node = self.deeper(Parser::sign)?;
        let span = from..node.span.end;
        Ok(Node { part: Part::Negative(Box::new(node)), span })
    }

    fn primary(&mut self) -> Result<Node, Problem> {
        let span = self.place();
        match self.peek().cloned() {
            Some(Token::Number(number, unit)) => {
                self.at += 1;
                Ok(Node { part: Part::Number(number, unit), span })
            }
            Some(Token::Name(name)) => {
                self.at += 1;
                if self.take(&[Symbol::Open]).is_none() {
                    return Ok(Node { part: Part::Name(name), span });
                }
                let mut arguments = vec![self.deeper(Parser::either)?];
                while self.take(&[Symbol::Comma]).is_some() {
                    arguments.push(self.deeper(Parser::either)?);
                }
                let end = self.close()?;
                Ok(Node { part: Part::Call(name, arguments), span: span.start..end })
            }
            Some(Token::Symbol(Symbol::Open)) => {
                self.at += 1;
                let node = self.deeper(Parser::either)?;
                let end = self.close()?;
                Ok(Node { span: span.start..end, ..node })
            }
            _ => Err(self.unexpected("a field, a number or `(`")),
        }
    }

    /// Takes the closing parenthesis; returns where it ends.
    fn close(&mut self) -> Result<usize, Problem> {
        let end = self.place().end;
        self.take(&[Symbol::Close]).map(|_| end).ok_or_else(|| self.unexpected("`)`"))
    }

    /// Parts of one level, joined from the left by any of `symbols`.
    fn chain(&mut self, symbols: &[Symbol], part: fn(&mut Parser) -> Result<Node, Problem>) -> Result<Node, Problem> {
        let mut node = part(self)?;
        let mut joined = 0;
        while let Some(symbol) = self.take(symbols) {
            joined += 1;
            if DEEPEST < joined {
                return Err(self.too_deep());
            }
            node = pair(symbol, node, part(self)?);
        }
        Ok(node)
    }

    /// A part inside of another one.
    fn deeper(&mut self, part: fn(&mut Parser) -> Result<Node, Problem>) -> Result<Node, Problem> {
        self.depth += 1;
        if DEEPEST < self.depth {
            return Err(self.too_deep());
        }
        let node = part(self);
        self.depth -= 1;
        node
    }

    fn too_deep(&self) -> Problem {
        let message = format!("more than {DEEPEST} parts are joined or lie in each other here");
        Problem::new(self.place(), message, "split it into two rows")
    }
}

fn pair(symbol: Symbol, left: Node, right: Node) -> Node {
    let span = left.span.start..right.span.end;
    Node { part: Part::Pair(symbol, Box::new(left), Box::new(right)), span }
}
