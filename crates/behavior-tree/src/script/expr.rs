//! A parsed expression.

use crate::value::Value;

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Expr {
    Literal(Value),
    Key(u32),
    Unary(Unary, Box<Expr>),
    Binary(Binary, Box<Expr>, Box<Expr>),
    /// `a < b <= c` holds if `a < b` and `b <= c`.
    Compare(Box<Expr>, Vec<(Comparison, Expr)>),
    If(Box<Expr>, Box<Expr>, Box<Expr>),
    Assign(u32, Assignment, Box<Expr>),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unary {
    Negate,
    Complement,
    Not,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Binary {
    Plus,
    Minus,
    Times,
    Divide,
    Concat,
    BitAnd,
    BitOr,
    BitXor,
    And,
    Or,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Comparison {
    Equal,
    NotEqual,
    Less,
    Greater,
    LessEqual,
    GreaterEqual,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Assignment {
    /// `:=`, makes the key if it does not exist.
    Create,
    /// `=`, the key must exist.
    Set,
    /// `+=` and its like.
    With(Binary),
}

/// What an expression does with a key.
pub(crate) enum Use<'e> {
    Read(u32),
    Assign(u32, Assignment, &'e Expr),
}

impl Expr {
    /// Everything this expression does with keys.
    pub(crate) fn uses<'e>(&'e self, each: &mut dyn FnMut(Use<'e>)) {
        match self {
            Expr::Literal(_) => {}
            Expr::Key(key) => each(Use::Read(*key)),
            Expr::Unary(_, operand) => operand.uses(each),
            Expr::Binary(_, left, right) => {
                left.uses(each);
                right.uses(each);
            }
            Expr::Compare(first, rest) => {
                first.uses(each);
                rest.iter().for_each(|(_, operand)| operand.uses(each));
            }
            Expr::If(condition, then, otherwise) => {
                condition.uses(each);
                then.uses(each);
                otherwise.uses(each);
            }
            Expr::Assign(key, how, value) => {
                value.uses(each);
                each(Use::Assign(*key, *how, value));
            }
        }
    }
}
