//! Text from outside as it may go to a terminal. A name or a reason from a file or from the network can have characters that move the
//! cursor, erase lines or begin new ones, and so look like words of this program.

use std::borrow::Cow;
use std::fmt::Write as _;

use domain::control_character::is_control;

/// The text of one line: control characters are written out, as JSON does.
pub fn one_line(text: &str) -> Cow<'_, str> {
    written_out(text, |it| it == '\t')
}

/// Text that may have several lines.
pub fn lines(text: &str) -> Cow<'_, str> {
    written_out(text, |it| matches!(it, '\t' | '\n'))
}

fn written_out(text: &str, stays: fn(char) -> bool) -> Cow<'_, str> {
    let goes = |it: char| is_control(it) && !stays(it);
    if !text.contains(goes) {
        return Cow::Borrowed(text);
    }
    let mut visible = String::with_capacity(text.len() + 16);
    for it in text.chars() {
        match it {
            '\n' if goes(it) => visible.push_str("\\n"),
            '\r' => visible.push_str("\\r"),
            _ if goes(it) => {
                for unit in it.encode_utf16(&mut [0; 2]) {
                    // Writing to a string cannot fail.
                    let _ = write!(visible, "\\u{unit:04x}");
                }
            }
            _ => visible.push(it),
        }
    }
    Cow::Owned(visible)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_from_outside_begins_a_line_or_a_command_of_the_terminal() {
        #[track_caller]
        fn check(text: &str, on_one_line: &str, on_lines: &str) {
            assert_eq!((&*one_line(text), &*lines(text)), (on_one_line, on_lines));
        }
        check("harbour `Ä`\t2", "harbour `Ä`\t2", "harbour `Ä`\t2");
        check("d\nmission over", "d\\nmission over", "d\nmission over");
        check("A\r\u{1b}[2KX", "A\\r\\u001b[2KX", "A\\r\\u001b[2KX");
        check(
            "\u{202e}tnarg\u{2028}A\u{e0041}",
            "\\u202etnarg\\u2028A\\udb40\\udc41",
            "\\u202etnarg\\u2028A\\udb40\\udc41",
        );
        check("\u{7f}\u{9b}31m\0", "\\u007f\\u009b31m\\u0000", "\\u007f\\u009b31m\\u0000");
    }
}
