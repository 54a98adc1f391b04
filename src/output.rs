//! Lines for the user.
//!
//! If the reader has closed the pipe (`kittiwake status | head -1`), that is not a failure, above all not for a
//! launcher whose vehicle flies. Nor does a process that flies a vehicle wait for a reader that stalls (a full pipe, ^S
//! on a terminal): it has its lines written [`in_background`].
//!
//! What comes from outside is never a command to the terminal, see [`visible`].

use std::io::Write;
use std::sync::OnceLock;
use std::time::Duration;

mod background;
pub mod visible;

use background::Background;

/// A process that ends waits at most this long for its last lines to be read.
const LAST_LINES: Duration = Duration::from_secs(1);

/// Absent in commands that only print: they wait for their reader.
static BACKGROUND: OnceLock<Background> = OnceLock::new();

/// From here on nobody waits for a reader. If the operating system gives no thread for it, it stays as it was.
pub fn in_background() {
    if let (None, Ok(started)) = (BACKGROUND.get(), Background::start()) {
        // Fails only if another thread was quicker.
        let _ = BACKGROUND.set(started);
    }
}

/// Waits a moment until what was said has been written.
pub fn finish() {
    if let Some(it) = BACKGROUND.get() {
        it.finish(LAST_LINES);
    }
}

/// On standard output.
pub fn line(text: impl std::fmt::Display) {
    let text = text.to_string();
    show(move || {
        let _ = is_read(text);
    });
}

/// On standard output, for a command that only prints: false once nobody reads it.
pub fn is_read(text: impl std::fmt::Display) -> bool {
    writeln!(std::io::stdout(), "{}", visible::lines(&text.to_string())).is_ok()
}

/// On standard error.
pub fn error_line(text: impl std::fmt::Display) {
    let text = text.to_string();
    show(move || drop(writeln!(std::io::stderr(), "{}", visible::lines(&text))));
}

/// Does what writes to the terminal, in the order of all lines.
pub fn show(write: impl FnOnce() + Send + 'static) {
    match BACKGROUND.get() {
        Some(it) => it.put(Box::new(write)),
        None => write(),
    }
}

/// One record of a log, on standard error once it is whole.
#[derive(Default)]
pub struct LogRecord(Vec<u8>);

impl Write for LogRecord {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Drop for LogRecord {
    fn drop(&mut self) {
        let record = std::mem::take(&mut self.0);
        if !record.is_empty() {
            show(move || drop(std::io::stderr().write_all(&record)));
        }
    }
}
