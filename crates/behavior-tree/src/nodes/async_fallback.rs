//! # `AsyncFallback`
//!
//! A [`Fallback`](super::fallback) that lets the rest of the tree look between two children that finish at once.
//!
//! | the child answers | the fallback |
//! |---|---|
//! | failure, in the tick it was started, and it is not the last | answers running and asks to be ticked again at once |
//! | anything else | as [`Fallback`](super::fallback) |

use super::{BuiltIn, Class, MANY};
use crate::kind::Kind;

pub(crate) const BUILT_IN: BuiltIn = BuiltIn {
    tag: "AsyncFallback",
    class: Class::Control,
    children: 1..=MANY,
    ports: &[],
    kind: |_| Kind::Fallback { interruptible: true },
};
