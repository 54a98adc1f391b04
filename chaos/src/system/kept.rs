//! One process as a systemd unit keeps it (`deploy/kittiwake@.service`): started, watched by its own signs of life, started
//! again whenever it ends.

use std::ffi::OsString;
use std::io::{self, BufRead, BufReader, Read};
use std::os::unix::net::UnixDatagram;
use std::os::unix::process::ExitStatusExt;
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration, Instant};

use super::Setup;
use crate::clock::Side;
use crate::run::heard::Heard;

/// The unit's `WatchdogSec`, `TimeoutStartSec` and `RestartSec`.
const WATCHDOG: Duration = Duration::from_secs(3);
pub(super) const START_LIMIT: Duration = Duration::from_secs(30);
const RESTART: Duration = Duration::from_millis(200);
/// Lines of a process that wait to be looked through; the rest is passed over.
const LINES: usize = 64;

/// How a process is started.
#[derive(Debug)]
pub(super) struct Spec {
    /// How the campaign calls it.
    pub(super) name: &'static str,
    /// The command that runs it.
    pub(super) command: Vec<&'static str>,
    pub(super) side: Side,
    pub(super) args: Vec<OsString>,
}

/// A process that is kept up; it ends with the value.
pub(super) struct SupervisedProcess {
    pub(super) spec: Spec,
    state: State,
    /// Where its signs of life come.
    signs: UnixDatagram,
    socket: PathBuf,
    /// Takes what it says on its standard output, as long as somebody looks through that.
    said: SyncSender<String>,
}

enum State {
    Runs {
        process: Child,
        since: Instant,
        /// Its last sign of life; the first one says that it is ready.
        sign: Option<Instant>,
        /// It was killed because it hangs.
        killed: bool,
    },
    Due(Instant),
}

impl SupervisedProcess {
    /// One that is started as soon as it is looked after. What it says on its standard output comes back as well, to be looked
    /// through for an address; it may say that more than once, since one that ends is started again.
    pub(super) fn new(spec: Spec, setup: &Setup) -> Result<(SupervisedProcess, Receiver<String>), String> {
        let socket = setup.scratch.join(format!("{}.notify", spec.name));
        // Left by a loss of power.
        let _ = std::fs::remove_file(&socket);
        let signs = UnixDatagram::bind(&socket).and_then(|it| it.set_nonblocking(true).map(|()| it));
        let signs = signs.map_err(|it| format!("{}: {it}", socket.display()))?;
        let (said, lines) = sync_channel(LINES);
        Ok((SupervisedProcess { spec, state: State::Due(Instant::now()), signs, socket, said }, lines))
    }

    /// The process id, while it runs.
    pub(super) fn id(&self) -> Option<u32> {
        match &self.state {
            State::Runs { process, .. } => Some(process.id()),
            State::Due(_) => None,
        }
    }

    /// Whether it has said so.
    pub(super) fn is_ready(&self) -> bool {
        matches!(&self.state, State::Runs { sign: Some(_), .. })
    }

    /// Looks after it; returns what is to be said about it.
    pub(super) fn tend(&mut self, setup: &Setup, heard: &SyncSender<Heard>, id: u32) -> Option<String> {
        let (now, name) = (Instant::now(), self.spec.name);
        let mut message = [0; 64];
        while let Ok(length) = self.signs.recv(&mut message) {
            let is_sign = message[..length].starts_with(b"READY=1") || message[..length].starts_with(b"WATCHDOG=1");
            if let State::Runs { sign, .. } = &mut self.state
                && is_sign
            {
                *sign = Some(now);
            }
        }
        match &mut self.state {
            State::Due(at) if now < *at => None,
            State::Due(_) => match self.spawn(setup, heard, id) {
                Ok(process) => {
                    self.state = State::Runs { process, since: now, sign: None, killed: false };
                    None
                }
                Err(cause) => {
                    self.state = State::Due(now + RESTART);
                    Some(format!("{name} cannot be started: {cause}"))
                }
            },
            State::Runs { process, since, sign, killed } => {
                if let Ok(Some(status)) = process.try_wait() {
                    self.state = State::Due(now + RESTART);
                    return Some(format!("{name} ended {}; it is started again", in_words(status)));
                }
                let limit = sign.map_or(*since + START_LIMIT, |it| it + WATCHDOG);
                if now < limit || std::mem::replace(killed, true) {
                    return None;
                }
                // Fails only if it has ended meanwhile.
                let _ = process.kill();
                Some(format!("{name} does not answer to its watchdog: it is killed"))
            }
        }
    }

    /// Kills it if it runs, and starts it no earlier than `until`. To be called in each turn until then.
    pub(super) fn stay_off_until(&mut self, until: Instant) {
        match &mut self.state {
            // Fails only if it has ended meanwhile.
            State::Runs { process, .. } => drop(process.kill()),
            State::Due(at) => *at = until.max(*at),
        }
    }

    fn spawn(&self, setup: &Setup, heard: &SyncSender<Heard>, id: u32) -> io::Result<Child> {
        let mut command = Command::new(&setup.program);
        command.args(&self.spec.command).args(&self.spec.args).arg("--exit-with-parent");
        command.env("NOTIFY_SOCKET", &self.socket).env("WATCHDOG_USEC", WATCHDOG.as_micros().to_string());
        if let Some(clocks) = &setup.clocks {
            clocks.give(self.spec.side, &mut command);
        }
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut process = command.spawn()?;
        let said = self.said.clone();
        // Fails once nobody looks through it any more.
        let look = move |text: &str| drop(said.try_send(text.to_owned()));
        pass_on(process.stdout.take(), self.spec.name, heard, id, look);
        pass_on(process.stderr.take(), self.spec.name, heard, id, |_| {});
        Ok(process)
    }

    /// As a loss of power does.
    pub(super) fn kill(&mut self) {
        if let State::Runs { process, .. } = &mut self.state {
            let _ = process.kill();
        }
    }
}

impl Drop for SupervisedProcess {
    fn drop(&mut self) {
        self.kill();
        if let State::Runs { process, .. } = &mut self.state {
            let _ = process.wait();
        }
    }
}

/// Passes on the lines of a pipe, until it or the run ends.
fn pass_on(
    pipe: Option<impl Read + Send + 'static>,
    name: &'static str,
    heard: &SyncSender<Heard>,
    id: u32,
    mut look: impl FnMut(&str) + Send + 'static,
) {
    let heard = heard.clone();
    std::thread::spawn(move || {
        for line in pipe.into_iter().flat_map(|it| BufReader::new(it).lines().map_while(Result::ok)) {
            look(&line);
            if heard.send(Heard::Line(id, format!("{name}: {line}"))).is_err() {
                return;
            }
        }
    });
}

fn in_words(status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("with exit code {code}"),
        (None, signal) => format!("by signal {}", signal.unwrap_or_default()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn what_ends_is_started_again_and_what_it_says_is_heard() {
        let folder = kittiwake::run::run_file::RunFolder::create("kept-test").unwrap();
        let (setup, (sender, heard)) = (Setup::made_up("/bin/sh", &folder.0), sync_channel(100));
        let args = vec!["echo listens at 7; exit 3".into()];
        let spec = Spec { name: "router", command: vec!["-c"], side: Side::Aircraft, args };
        let (mut kept, lines) = SupervisedProcess::new(spec, &setup).unwrap();
        assert_eq!(kept.tend(&setup, &sender, 1), None);
        assert_eq!(lines.recv_timeout(START_LIMIT).as_deref(), Ok("listens at 7"));
        let mut said = Vec::new();
        let ended = |said: &[String]| said.iter().filter(|it| it.contains("ended with exit code 3")).count();
        let until = Instant::now() + START_LIMIT;
        while ended(&said) < 2 && Instant::now() < until {
            said.extend(kept.tend(&setup, &sender, 1));
            std::thread::sleep(Duration::from_millis(5));
        }
        assert_eq!(ended(&said), 2, "{said:?}");
        assert!(heard.try_iter().any(|it| matches!(it, Heard::Line(1, line) if line == "router: listens at 7")));
    }
}
