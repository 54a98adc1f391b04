//! One router: `kittiwake up`, started as a user starts it, perhaps with the nodes on board in one process.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::SyncSender;

use nix::sys::signal::Signal;

use super::{LIMIT, Reach, Setup, VEHICLE, is_there, signal, wait_until};
use crate::clock::Side;
use crate::run::heard::Heard;
use crate::trouble::{Layout, Victim};

/// The launcher; it ends with the value, and its children with it.
pub(crate) struct Launcher(Child);

impl Launcher {
    pub(super) fn start(setup: &Setup, heard: &SyncSender<Heard>) -> Result<Launcher, String> {
        let mut command = Command::new(&setup.program);
        command.args(["up", "--json", "--http", "127.0.0.1:0", "--vehicle", VEHICLE, "--speed", &setup.speed]);
        command.args(["--seed", &setup.seed.to_string(), "--permissions", setup.permissions.name()]);
        command.args(setup.ends.then_some("--exit-when-done"));
        command.arg("--config").arg(&setup.config).arg("--state").arg(setup.state());
        command.arg("--recordings").arg(setup.scratch.join("recordings"));
        if setup.layout == Layout::Composed {
            command.args(["--onboard", &Victim::Onboard.nodes().join(",")]);
        }
        if let Some(clocks) = &setup.clocks {
            clocks.give(Side::Aircraft, &mut command);
        }
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut process = command.spawn().map_err(|it| format!("{}: {it}", setup.program.display()))?;
        let (stderr, id, heard) = (process.stderr.take(), process.id(), heard.clone());
        std::thread::spawn(move || {
            let mut found = Found::default();
            for line in stderr.into_iter().flat_map(|it| BufReader::new(it).lines().map_while(Result::ok)) {
                let up = found.read(id, &line).map(|it| Heard::Up(id, it));
                if std::iter::once(Heard::Line(id, line)).chain(up).any(|it| heard.send(it).is_err()) {
                    return;
                }
            }
            // Fails only once the run is over.
            let _ = heard.send(Heard::Ended(id));
        });
        Ok(Launcher(process))
    }

    pub(super) fn id(&self) -> u32 {
        self.0.id()
    }

    pub(super) fn exit_code(&mut self) -> Option<i32> {
        self.0.wait().ok()?.code()
    }

    pub(super) fn cut_power(mut self) {
        let children = children(self.id());
        // Frozen first, so that none sees another one die.
        signal(self.id(), Signal::SIGSTOP);
        children.iter().for_each(|(_, id)| signal(*id, Signal::SIGKILL));
        let _ = self.0.kill();
        let _ = self.0.wait();
        wait_until(LIMIT, || !children.iter().any(|(_, id)| is_there(*id)));
    }
}

impl Drop for Launcher {
    fn drop(&mut self) {
        signal(self.id(), Signal::SIGINT);
        let ended = wait_until(LIMIT, || self.0.try_wait().is_ok_and(|it| it.is_some()));
        if !ended {
            let _ = self.0.kill();
            let _ = self.0.wait();
        }
    }
}

/// What the launcher's lines have said about where it can be reached.
#[derive(Default)]
struct Found {
    locator: Option<String>,
    told: bool,
}

impl Found {
    /// Reads a line; where the system can be reached, once it is known.
    fn read(&mut self, launcher: u32, line: &str) -> Option<Reach> {
        if line.contains(" is up: ") {
            self.locator = line.rsplit_once("router ").map(|it| it.1.trim().to_owned());
        }
        let http = line.strip_prefix("status: http://").and_then(|it| it.split('/').next())?;
        let locator = self.locator.clone().filter(|_| !std::mem::replace(&mut self.told, true))?;
        let target = ["--pid".into(), launcher.to_string().into()];
        Some(Reach { on_board: locator.clone(), ground: locator, http: http.to_owned(), target: target.into() })
    }
}

/// The children of a launcher, by the names for `kittiwake run`.
pub(super) fn children(launcher: u32) -> Vec<(String, u32)> {
    let ids = std::fs::read_to_string(format!("/proc/{launcher}/task/{launcher}/children")).unwrap_or_default();
    let child = |id: &str| {
        let command = std::fs::read(format!("/proc/{id}/cmdline")).ok()?;
        let name = command.split(|it| *it == 0).nth(2)?;
        Some((String::from_utf8_lossy(name).into_owned(), id.parse().ok()?))
    };
    ids.split_whitespace().filter_map(child).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_launcher_says_where_it_can_be_reached() {
        let mut found = Found::default();
        let router = "unixsock-stream//run/user/0/links/router.sock";
        let up = format!("uav1 is up: speed 8, permissions grant, seed 1, router {router}");
        assert_eq!(found.read(7, &up), None);
        let reach = found.read(7, "status: http://127.0.0.1:4711/api/v1/vehicles/uav1").expect("both are known");
        assert_eq!((reach.on_board.as_str(), reach.http.as_str()), (router, "127.0.0.1:4711"));
        assert_eq!(reach.target, ["--pid", "7"]);
    }
}
