//! behavior-tree
