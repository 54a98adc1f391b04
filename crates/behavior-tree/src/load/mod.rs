//! From tree files to checked templates.
//!
//! Files are parsed into documents (`parse`), whose trees and models make a `forest`. Every tree is then walked by
//! `expand`, which finds the kind of node that each element names (`meaning`), reads its `attributes` and enters
//! subtrees (`connect`). Keys are resolved on the way (`keys`); what is known of them is collected in `slots` and
//! checked once the whole tree is known. Mistakes never end the loading: they are collected in `mistakes` and reported
//! together.

mod attributes;
mod builder;
mod connect;
pub(crate) mod expand;
pub(crate) mod files;
pub(crate) mod forest;
mod keys;
mod meaning;
pub(crate) mod mistake;
pub(crate) mod mistakes;
mod model;
mod names;
pub(crate) mod nearest;
pub(crate) mod parse;
mod ports;
mod scripts;
mod slots;
