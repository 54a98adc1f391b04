//! Lines for the user.
//!
//! A reader that has gone away (`kittiwake status | head -1`) is no reason to fail, least of all for
//! a launcher whose vehicle flies.

use std::io::Write;

/// On standard output.
pub fn line(text: impl std::fmt::Display) {
    let _ = writeln!(std::io::stdout(), "{text}");
}

/// On standard error.
pub fn error_line(text: impl std::fmt::Display) {
    let _ = writeln!(std::io::stderr(), "{text}");
}
