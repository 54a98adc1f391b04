//! Does the troubles to real processes. Each is a thread of its own: a long one delays none that follows.

use std::io::{self, Write};
use std::net::TcpStream;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc::SyncSender;
use std::time::{Duration, Instant};

use nix::sys::signal::Signal;

use crate::figures::How;
use crate::flood;
use crate::run::Heard;
use crate::system::{children, signal, wait_until};
use crate::trouble::{Garbling, Order, Trouble, Victim};

/// A process that was killed is back within this.
const BACK: Duration = Duration::from_secs(20);
/// An order is given again and again for this long: its gateway may be dead and come back.
const ORDER: Duration = Duration::from_secs(30);
/// Strangers stay for this long.
const STAY: Duration = Duration::from_secs(3);

/// A system as troubles see it.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    pub(crate) program: PathBuf,
    pub(crate) launcher: u32,
    pub(crate) locator: String,
    /// The gateway's address, without a scheme.
    pub(crate) http: String,
    pub(crate) state: PathBuf,
    pub(crate) heard: SyncSender<Heard>,
}

impl Scene {
    /// Begins a trouble. A loss of power is not for here: it ends the scene.
    pub(crate) fn begin(&self, trouble: Trouble) {
        let scene = self.clone();
        std::thread::spawn(move || scene.perform(trouble));
    }

    fn perform(&self, trouble: Trouble) {
        match trouble {
            Trouble::Kill(victim) => self.kill(victim),
            Trouble::Stop(victim, time) => self.stop(victim, time),
            Trouble::DoubleKill(first, second, apart) => {
                self.kill(first);
                std::thread::sleep(apart);
                self.kill(second);
            }
            Trouble::CrashLoop(victim, times) => self.crash_loop(victim, times),
            Trouble::FullDisk(time) => {
                self.note(fill(&self.state, time).err().map(|it| format!("the disk was not filled: {it}")))
            }
            Trouble::GarbledState(victim, garbling) => self.garble(victim, garbling),
            Trouble::Strangers(count) => self.strangers(count),
            Trouble::Flood(rate_hz, time) => flood::flood(&self.locator, rate_hz, time),
            Trouble::Ordered(order) => self.order(order),
            Trouble::PowerLoss(_) => {}
        }
    }

    fn note(&self, text: Option<String>) {
        if let Some(text) = text {
            // Fails only once the run is over. The same below.
            let _ = self.heard.send(Heard::Note(text));
        }
    }

    fn find(&self, victim: Victim) -> Option<u32> {
        let mut found = None;
        wait_until(BACK, || {
            found = children(self.launcher).into_iter().find(|(name, _)| name == victim.name()).map(|it| it.1);
            found.is_some() || !Path::new(&format!("/proc/{}", self.launcher)).exists()
        });
        found
    }

    fn lost(&self, victim: Victim, id: u32, how: How) {
        let _ = self.heard.send(Heard::Lost { victim, id, how });
    }

    fn kill(&self, victim: Victim) {
        if let Some(id) = self.find(victim) {
            self.lost(victim, id, How::Killed);
            signal(id, Signal::SIGKILL);
        }
    }

    fn stop(&self, victim: Victim, time: Duration) {
        let Some(id) = self.find(victim) else { return };
        self.lost(victim, id, How::Hung);
        signal(id, Signal::SIGSTOP);
        std::thread::sleep(time);
        // Not another process with the number of one that was killed meanwhile.
        if children(self.launcher).contains(&(victim.name().to_owned(), id)) {
            let _ = self.heard.send(Heard::Continued { id });
            signal(id, Signal::SIGCONT);
        }
    }

    fn crash_loop(&self, victim: Victim, times: u32) {
        let mut before = None;
        for _ in 0..times {
            let mut found = None;
            wait_until(BACK, || {
                found = self.find(victim).filter(|it| Some(*it) != before);
                found.is_some() || !Path::new(&format!("/proc/{}", self.launcher)).exists()
            });
            let Some(id) = found else { return };
            self.lost(victim, id, How::Killed);
            signal(id, Signal::SIGKILL);
            before = Some(id);
        }
    }

    fn garble(&self, victim: Victim, garbling: Garbling) {
        let Some(id) = self.find(victim) else { return };
        // Stopped, so that it does not write a good state over it.
        signal(id, Signal::SIGSTOP);
        let files = garble_all(&self.state, victim, garbling);
        self.lost(victim, id, How::Killed);
        signal(id, Signal::SIGKILL);
        self.note(Some(format!("files of {victim} garbled: {files}")));
    }

    fn strangers(&self, count: u32) {
        let router = self.locator.split_once('/').map(|it| it.1).unwrap_or_default();
        let garbage = [0xa5; 512];
        let mut doors: Vec<Box<dyn Write>> = Vec::new();
        for number in 0..count {
            let door: io::Result<Box<dyn Write>> = match number % 2 {
                0 => TcpStream::connect(&self.http).map(|it| Box::new(it) as Box<dyn Write>),
                _ => UnixStream::connect(router).map(|it| Box::new(it) as Box<dyn Write>),
            };
            let Ok(mut door) = door else { continue };
            // To hang up on a stranger is right, so an error here is none.
            let _ = door.write_all(&garbage);
            doors.push(door);
        }
        self.note(Some(format!("{} of {count} strangers were let in at the doors", doors.len())));
        std::thread::sleep(STAY);
    }

    /// Gives the order until it is accepted.
    pub(crate) fn order(&self, order: Order) {
        let until = Instant::now() + ORDER;
        loop {
            let output = Command::new(&self.program)
                .args(["vehicle", order.verb(), "--pid", &self.launcher.to_string()])
                .stdin(Stdio::null())
                .output();
            let (accepted, said) = match output {
                Ok(it) => {
                    let said = String::from_utf8_lossy(&[it.stdout, it.stderr].concat()).trim().to_owned();
                    (it.status.success(), said)
                }
                Err(cause) => (false, cause.to_string()),
            };
            let is_over = until <= Instant::now() || !Path::new(&format!("/proc/{}", self.launcher)).exists();
            if accepted || is_over {
                let _ = self.heard.send(Heard::Ordered { order, accepted, said });
                return;
            }
            std::thread::sleep(Duration::from_millis(500));
        }
    }
}

/// Garbles every generation of a process's state; the number of files.
fn garble_all(state: &Path, victim: Victim, garbling: Garbling) -> usize {
    let entries = std::fs::read_dir(state).into_iter().flatten().flatten();
    let is_state = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        name.strip_prefix(victim.name()).is_some_and(|it| matches!(it, ".0" | ".1"))
    };
    let files: Vec<PathBuf> = entries.map(|it| it.path()).filter(is_state).collect();
    let garbled = files.iter().filter(|path| {
        let spoilt = std::fs::read(path).map(|bytes| spoil(bytes, garbling));
        spoilt.and_then(|bytes| std::fs::write(path, bytes)).is_ok()
    });
    garbled.count()
}

fn spoil(mut bytes: Vec<u8>, garbling: Garbling) -> Vec<u8> {
    let middle = bytes.len() / 2;
    match garbling {
        Garbling::Flipped => bytes.iter_mut().skip(middle).take(8).for_each(|it| *it ^= 0x5a),
        Garbling::Cut => bytes.truncate(middle),
        Garbling::Emptied => bytes.clear(),
    }
    bytes
}

/// Fills the disk of a folder for a while.
fn fill(folder: &Path, time: Duration) -> io::Result<()> {
    let path = folder.join("filler");
    let mut file = std::fs::File::create(&path)?;
    // To the last byte.
    for length in [65_536, 4096, 1] {
        while file.write_all(&vec![0; length]).is_ok() {}
    }
    std::thread::sleep(time);
    std::fs::remove_file(&path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_spoilt_differs_in_the_way_that_was_drawn() {
        let good: Vec<u8> = (0..100).collect();
        let flipped = spoil(good.clone(), Garbling::Flipped);
        assert_eq!((flipped.len(), flipped.iter().zip(&good).filter(|(a, b)| a != b).count()), (100, 8));
        assert_eq!(spoil(good.clone(), Garbling::Cut), good[..50]);
        assert!(spoil(good, Garbling::Emptied).is_empty());
    }
}
