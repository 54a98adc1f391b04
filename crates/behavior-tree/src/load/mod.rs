//! From tree files to checked templates.

pub(crate) mod expand;
mod finish;
mod meaning;
pub(crate) mod mistake;
pub(crate) mod mistakes;
pub(crate) mod model;
pub(crate) mod nearest;
pub(crate) mod ports;
mod scope;
mod scripts;
mod subtree;
