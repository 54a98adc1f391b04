//! A parsed expression.

use crate::values::value::Value;

/// An expression. Keys are slots of the blackboard.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Expr {
    Literal(Value),
    Key(u32),
    Unary(Unary, Box<Expr>),
    Binary(Binary, Box<Expr>, Box<Expr>),
    /// `a < b <= c` is true if `a < b` and `b <= c`.
    Compare(Box<Expr>, Vec<(Comparison, Expr)>),
    /// `a ? b : c`
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
    /// `:=` makes the key if it does not exist.
    Create,
    /// `=` needs a key that exists.
    Set,
    /// `+=`, `-=`, `*=` or `/=`.
    With(Binary),
}

/// What an expression does with a key.
pub(crate) enum Use<'e> {
    Read(u32),
    Assign(u32, Assignment, &'e Expr),
}

impl Expr {
    /// Calls `each` for everything that this expression does with keys.
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

impl Binary {
    pub(crate) const fn sign(self) -> &'static str {
        match self {
            Binary::Plus => "+",
            Binary::Minus => "-",
            Binary::Times => "*",
            Binary::Divide => "/",
            Binary::Concat => "..",
            Binary::BitAnd => "&",
            Binary::BitOr => "|",
            Binary::BitXor => "^",
            Binary::And => "&&",
            Binary::Or => "||",
        }
    }
}

impl Comparison {
    pub(crate) const fn sign(self) -> &'static str {
        match self {
            Comparison::Equal => "==",
            Comparison::NotEqual => "!=",
            Comparison::Less => "<",
            Comparison::Greater => ">",
            Comparison::LessEqual => "<=",
            Comparison::GreaterEqual => ">=",
        }
    }
}
