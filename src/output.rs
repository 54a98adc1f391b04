//! Lines for the user.
//!
//! If the reader has closed the pipe (`kittiwake status | head -1`), that is no failure, above all not for a launcher
//! whose vehicle flies.

use std::io::Write;

/// On standard output.
pub fn line(text: impl std::fmt::Display) {
    let _ = is_read(text);
}

/// On standard output, for a command that only prints: false once nobody reads it.
pub fn is_read(text: impl std::fmt::Display) -> bool {
    writeln!(std::io::stdout(), "{text}").is_ok()
}

/// On standard error.
pub fn error_line(text: impl std::fmt::Display) {
    let _ = writeln!(std::io::stderr(), "{text}");
}
