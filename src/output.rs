//! Lines for the user.
//!
//! A reader that has gone away (`kittiwake status | head -1`) is no reason to fail, least of all for
//! a launcher whose vehicle flies.

use std::io::Write;

/// On standard output.
pub fn line(text: impl std::fmt::Display) {
    let _ = is_read(text);
}

/// On standard output, for who has nothing else to do: false once nobody reads it any more.
pub fn is_read(text: impl std::fmt::Display) -> bool {
    writeln!(std::io::stdout(), "{text}").is_ok()
}

/// On standard error.
pub fn error_line(text: impl std::fmt::Display) {
    let _ = writeln!(std::io::stderr(), "{text}");
}
