//! Starts `kittiwake up` and waits for what it says.

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// The program under test.
pub(crate) const KITTIWAKE: &str = env!("CARGO_BIN_EXE_kittiwake");
/// Much longer than any wait on a machine in order.
pub(crate) const LIMIT: Duration = Duration::from_secs(600);

/// A launcher with its children; they end with the value.
pub(crate) struct System {
    launcher: Child,
    lines: Receiver<String>,
    said: Vec<String>,
}

impl System {
    /// Starts what `command` is, with its output taken.
    pub(crate) fn start(mut command: Command) -> System {
        command.env("XDG_STATE_HOME", concat!(env!("CARGO_TARGET_TMPDIR"), "/state"));
        let mut launcher =
            command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
        let (sender, lines) = channel();
        let pipes: [Option<Box<dyn Read + Send>>; 2] =
            [launcher.stdout.take().map(|it| Box::new(it) as _), launcher.stderr.take().map(|it| Box::new(it) as _)];
        for pipe in pipes.into_iter().flatten() {
            let sender = sender.clone();
            std::thread::spawn(move || {
                for line in BufReader::new(pipe).lines().map_while(Result::ok) {
                    if sender.send(line).is_err() {
                        return;
                    }
                }
            });
        }
        System { launcher, lines, said: Vec::new() }
    }

    /// Waits for a line that contains `part`, and returns it.
    #[track_caller]
    pub(crate) fn wait_for(&mut self, part: &str) -> String {
        let until = Instant::now() + LIMIT;
        if let Some(line) = self.said.iter().find(|it| it.contains(part)) {
            return line.clone();
        }
        loop {
            match self.lines.recv_timeout(until.saturating_duration_since(Instant::now())) {
                Ok(line) => {
                    self.said.push(line.clone());
                    if line.contains(part) {
                        return line;
                    }
                }
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {
                    panic!("waited for `{part}` in vain; it said:\n{}", self.said.join("\n"))
                }
            }
        }
    }

    /// Waits for the end; returns the exit code and everything that was said.
    #[track_caller]
    pub(crate) fn end(mut self) -> (Option<i32>, String) {
        let until = Instant::now() + LIMIT;
        loop {
            match self.lines.recv_timeout(until.saturating_duration_since(Instant::now())) {
                Ok(line) => self.said.push(line),
                Err(RecvTimeoutError::Disconnected) => break,
                Err(RecvTimeoutError::Timeout) => panic!("it does not end; it said:\n{}", self.said.join("\n")),
            }
        }
        let code = self.launcher.wait().expect("it was started").code();
        (code, self.said.join("\n"))
    }
}

impl Drop for System {
    fn drop(&mut self) {
        // Fails only if it has ended.
        let _ = self.launcher.kill();
        let _ = self.launcher.wait();
    }
}

/// A mission of this text in a file of this name.
pub(crate) fn mission(name: &str, text: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name).with_extension("toml");
    std::fs::write(&path, text).expect("a file");
    path
}

/// Forty metres and back, with a landing at the goal.
pub(crate) const SHORT: &str = r#"
name = "short"

[[objective]]
name = "there"
north_m = 0.0
east_m = 40.0
height_m = 0.0
flying = false

[[objective]]
name = "back"
north_m = 0.0
east_m = 0.0
height_m = 0.0
flying = false
"#;
