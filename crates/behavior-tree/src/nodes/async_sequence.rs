//! # `AsyncSequence`
//!
//! A [`Sequence`](super::sequence) that lets the rest of the tree look between two children that finish at once.
//!
//! | the child answers | the sequence |
//! |---|---|
//! | success, in the tick it was started, and it is not the last | answers running and asks to be ticked again at once |
//! | anything else | as [`Sequence`](super::sequence) |

use super::{BuiltIn, Class, MANY};
use crate::kind::Kind;

pub(crate) const BUILT_IN: BuiltIn = BuiltIn {
    tag: "AsyncSequence",
    class: Class::Control,
    children: 1..=MANY,
    ports: &[],
    kind: |_| Kind::Sequence { interruptible: true },
};
