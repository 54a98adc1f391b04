//! # `AlwaysSuccess`
//!
//! | | the node |
//! |---|---|
//! | ticked | answers success |

use super::{BuiltIn, Class};
use crate::kind::Kind;

pub(crate) const BUILT_IN: BuiltIn =
    BuiltIn { tag: "AlwaysSuccess", class: Class::Action, children: 0..=0, ports: &[], kind: |_| Kind::AlwaysSuccess };
