//! The expression language of pre- and postconditions and of `Script` nodes, described in
//! [`nodes::conditions`](crate::nodes::conditions).

pub(crate) mod check;
pub(crate) mod error;
pub(crate) mod eval;
pub(crate) mod expr;
mod operators;
pub(crate) mod parse;
mod token;

use std::sync::Arc;

/// A parsed expression whose names are resolved.
#[derive(Clone, Debug)]
pub(crate) struct Script {
    /// As written.
    pub(crate) text: Arc<str>,
    /// At least one. The value of the last one is that of the script.
    pub(crate) statements: Vec<expr::Expr>,
}

/// What an expression is for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Purpose {
    /// To be true or false.
    Condition,
    /// To assign to keys.
    Effects,
}

#[cfg(test)]
mod tests;
