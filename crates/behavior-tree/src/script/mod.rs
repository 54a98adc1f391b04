//! The expression language of pre- and postconditions and of `Script` nodes; its page is
//! [`nodes::conditions`](crate::nodes::conditions).

pub(crate) mod check;
pub(crate) mod eval;
pub(crate) mod expr;
pub(crate) mod parse;
pub(crate) mod token;

use std::sync::Arc;

/// A parsed expression, its names resolved.
#[derive(Clone, Debug)]
pub(crate) struct Script {
    pub(crate) text: Arc<str>,
    /// At least one; the value of the last one is that of the script.
    pub(crate) statements: Vec<expr::Expr>,
}

#[cfg(test)]
mod tests;
