//! # `AlwaysFailure`
//!
//! | | the node |
//! |---|---|
//! | ticked | answers failure |

use super::{BuiltIn, Class};
use crate::kind::Kind;

pub(crate) const BUILT_IN: BuiltIn =
    BuiltIn { tag: "AlwaysFailure", class: Class::Action, children: 0..=0, ports: &[], kind: |_| Kind::AlwaysFailure };
