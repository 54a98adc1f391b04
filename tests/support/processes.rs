//! The processes of a system, by their ids.

use std::time::Instant;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use super::{System, wait_for};

/// A process of a system under test.
#[derive(Debug, Clone, Copy)]
pub struct Process(Pid);

impl Process {
    /// Its id.
    pub fn id(self) -> Pid {
        self.0
    }

    /// Sends it a signal.
    #[track_caller]
    pub fn signal(self, signal: Signal) {
        self.try_signal(signal).expect("the process is there");
    }

    /// Sends it a signal, if it is still there.
    pub fn try_signal(self, signal: Signal) -> nix::Result<()> {
        kill(self.0, signal)
    }

    /// Whether it runs. One that has ended and was not waited for yet does not.
    pub fn runs(self) -> bool {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.0)).unwrap_or_default();
        // The name before it may hold anything but ends at the last bracket.
        stat.rsplit(')').next().and_then(|it| it.trim().chars().next()).is_some_and(|state| state != 'Z')
    }
}

impl System {
    /// The launcher itself.
    pub fn launcher(&self) -> Process {
        Process(Pid::from_raw(self.pid() as i32))
    }

    /// The process of a service, as it runs now.
    #[track_caller]
    pub fn process(&self, service: &str) -> Process {
        let found = self.children().into_iter().find(|(name, _)| name == service);
        found.unwrap_or_else(|| panic!("no {service} runs")).1
    }

    /// All children of the launcher by the names for `kittiwake run`.
    pub fn children(&self) -> Vec<(String, Process)> {
        let of = format!("/proc/{0}/task/{0}/children", self.pid());
        let ids = std::fs::read_to_string(of).unwrap_or_default();
        let child = |id: &str| {
            let command = std::fs::read(format!("/proc/{id}/cmdline")).ok()?;
            let name = command.split(|it| *it == 0).nth(2)?;
            Some((String::from_utf8_lossy(name).into_owned(), Process(Pid::from_raw(id.parse().ok()?))))
        };
        ids.split_whitespace().filter_map(child).collect()
    }
}

/// Waits until none of the processes runs any more; how long that took.
#[track_caller]
pub fn wait_until_gone(processes: &[(String, Process)]) -> std::time::Duration {
    let start = Instant::now();
    wait_for("every process to end", || {
        let left: Vec<_> = processes.iter().filter(|(_, it)| it.runs()).collect();
        left.is_empty().then_some(())
    });
    start.elapsed()
}
