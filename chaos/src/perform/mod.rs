//! Does the troubles to real processes. Each is a thread of its own: a long one delays none that follows.

use std::io::{self, Write};
use std::net::TcpStream;
use std::os::unix::net::UnixStream;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::mpsc::SyncSender;
use std::time::{Duration, Instant};

use nix::sys::signal::Signal;

use crate::figures::How;
use crate::flood;
use crate::run::heard::Heard;
use crate::system::{Processes, Reach, Setup, signal, wait_until};
use crate::trouble::{Garbling, Order, Trouble, Victim};

mod disk_state;

/// A process that was killed is back within this.
const BACK: Duration = Duration::from_secs(20);
/// An order is given again and again for this long, apart from faults of the link and a computer without power: its gateway may be dead
/// and come back.
const ORDER: Duration = Duration::from_secs(30);
/// Strangers stay for this long.
const STAY: Duration = Duration::from_secs(3);

/// A system as troubles see it.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    pub(crate) setup: Arc<Setup>,
    pub(crate) processes: Processes,
    pub(crate) reach: Reach,
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
            Trouble::Kill(victim) => self.kill(victim, How::Killed),
            Trouble::Stop(victim, time) => self.stop(victim, time),
            Trouble::DoubleKill(first, second, apart) => {
                self.kill(first, How::OneOfTwo);
                std::thread::sleep(apart);
                self.kill(second, How::OneOfTwo);
            }
            Trouble::CrashLoop(victim, times) => self.crash_loop(victim, times),
            Trouble::CompanionOff(time) => self.take_power_from_companion(time),
            Trouble::FullDisk(time) => self.note(
                disk_state::fill(&self.setup.state(), time).err().map(|it| format!("the disk was not filled: {it}")),
            ),
            Trouble::GarbledState(victim, garbling) => self.garble(victim, garbling),
            Trouble::Strangers(count) => self.strangers(count),
            Trouble::Flood(rate_hz, time) => flood::of_unknown(&self.reach.on_board, rate_hz, time),
            Trouble::Storm(draw, time) => match flood::known_flags(&self.setup.config, draw) {
                Ok(flags) => flood::storm(&self.reach.on_board, flags, time),
                Err(cause) => self.note(Some(format!("no storm: {cause}"))),
            },
            Trouble::ClockStep(machine, by_ms) => {
                let stepped = self.setup.clocks.as_ref().map_or(Ok(()), |it| it.step(machine, by_ms));
                self.note(stepped.err().map(|it| format!("the clock was not set: {it}")));
            }
            Trouble::Cut(ways, time, order) => {
                if let Some(link) = self.setup.link.get() {
                    link.cut(ways, time, || order.into_iter().for_each(|it| self.order_once(it)));
                }
            }
            Trouble::Slow(delay, time) => self.shape(delay, None, time),
            Trouble::Narrow(bits_per_s, time) => self.shape(Duration::ZERO, Some(bits_per_s), time),
            Trouble::Ordered(order) => self.order(order),
            Trouble::Revocation => self.revoke(),
            Trouble::PowerLoss(_) => {}
        }
    }

    fn note(&self, text: Option<String>) {
        if let Some(text) = text {
            // Fails only once the run is over. The same below.
            let _ = self.heard.send(Heard::Note(text));
        }
    }

    fn shape(&self, delay: Duration, bits_per_s: Option<u64>, time: Duration) {
        if let Some(link) = self.setup.link.get() {
            link.shape(delay, bits_per_s, time);
        }
    }

    fn find(&self, victim: Victim) -> Option<u32> {
        self.find_another(victim, None)
    }

    /// One that is not `before`, which was killed.
    fn find_another(&self, victim: Victim, before: Option<u32>) -> Option<u32> {
        let mut found = None;
        wait_until(BACK, || {
            found = self.processes.find(victim.name()).filter(|it| Some(*it) != before);
            found.is_some() || !self.processes.are_kept_up()
        });
        found
    }

    fn lost(&self, victim: Victim, id: u32, how: How) {
        let _ = self.heard.send(Heard::Lost { victim, id, how });
    }

    fn kill(&self, victim: Victim, how: How) {
        if let Some(id) = self.find(victim) {
            self.lost(victim, id, how);
            signal(id, Signal::SIGKILL);
        }
    }

    /// Who is not there at the moment is kept away all the same.
    fn take_power_from_companion(&self, time: Duration) {
        for victim in Victim::ON_COMPANION {
            if let Some(id) = self.processes.find(victim.name()) {
                self.lost(victim, id, How::CompanionOff);
            }
        }
        self.processes.take_down_companion(Instant::now() + time);
    }

    fn stop(&self, victim: Victim, time: Duration) {
        let Some(id) = self.find(victim) else { return };
        // One that was waited for is stopped as soon as it is watched, not in its start, for which it has more time.
        wait_until(BACK, || self.processes.is_ready(id) || self.processes.find(victim.name()) != Some(id));
        if self.processes.find(victim.name()) != Some(id) {
            return;
        }
        self.lost(victim, id, How::Hung);
        signal(id, Signal::SIGSTOP);
        std::thread::sleep(time);
        // Not another process with the number of one that was killed meanwhile.
        if self.processes.find(victim.name()) == Some(id) {
            let _ = self.heard.send(Heard::Continued { id });
            signal(id, Signal::SIGCONT);
        }
    }

    fn crash_loop(&self, victim: Victim, times: u32) {
        let mut before = None;
        for _ in 0..times {
            let Some(id) = self.find_another(victim, before) else { return };
            self.lost(victim, id, How::AgainAndAgain);
            signal(id, Signal::SIGKILL);
            before = Some(id);
        }
    }

    fn garble(&self, victim: Victim, garbling: Garbling) {
        let Some(id) = self.find(victim) else { return };
        // Stopped, so that it does not write a good state over it.
        signal(id, Signal::SIGSTOP);
        let files = disk_state::garble_all(&self.setup.state(), victim, garbling);
        self.lost(victim, id, How::Garbled);
        signal(id, Signal::SIGKILL);
        self.note(Some(format!("files of {victim} garbled: {files}")));
    }

    fn strangers(&self, count: u32) {
        let router = self.reach.on_board.split_once('/').map(|it| it.1).unwrap_or_default();
        let garbage = [0xa5; 512];
        let mut doors: Vec<Box<dyn Write>> = Vec::new();
        for number in 0..count {
            let door: io::Result<Box<dyn Write>> = match number % 3 {
                0 => TcpStream::connect(&self.reach.http).map(|it| Box::new(it) as Box<dyn Write>),
                // With one router there is no door for the link.
                1 => match self.setup.link.get() {
                    Some(link) => TcpStream::connect(link.ground()).map(|it| Box::new(it) as Box<dyn Write>),
                    None => continue,
                },
                _ => UnixStream::connect(router).map(|it| Box::new(it) as Box<dyn Write>),
            };
            let Ok(mut door) = door else { continue };
            // The other end may hang up on a stranger, so ignore an error here.
            let _ = door.write_all(&garbage);
            doors.push(door);
        }
        self.note(Some(format!("{} of {count} strangers were let in at the doors", doors.len())));
        std::thread::sleep(STAY);
    }

    /// Gives the order until it is accepted.
    fn order(&self, order: Order) {
        let mut until = Instant::now() + ORDER;
        loop {
            let (accepted, said) = self.give(order);
            let is_link_faulty = self.setup.link.get().is_some_and(|it| it.is_faulty());
            if is_link_faulty || self.processes.is_companion_off() {
                until = Instant::now() + ORDER;
            }
            if accepted || until <= Instant::now() || !self.processes.are_kept_up() {
                let _ = self.heard.send(Heard::Ordered { order, accepted, said });
                return;
            }
            std::thread::sleep(Duration::from_millis(500));
        }
    }

    /// Revokes what is granted; where nothing is, what is granted next.
    fn revoke(&self) {
        let until = Instant::now() + ORDER;
        while Instant::now() < until && self.processes.are_kept_up() {
            let decided =
                self.setup.permission_areas.iter().map(|area| (area, self.kittiwake(&["permission", "revoke", area])));
            let revoked: Vec<&str> = decided.filter(|(_, (is_done, _))| *is_done).map(|it| it.0.as_str()).collect();
            if !revoked.is_empty() {
                return self.note(Some(format!("revoked: {}", revoked.join(", "))));
            }
            std::thread::sleep(Duration::from_millis(500));
        }
        self.note(Some("nothing was there to revoke".to_owned()));
    }

    /// Gives the order once, and does not wait for its outcome.
    fn order_once(&self, order: Order) {
        let scene = self.clone();
        std::thread::spawn(move || {
            let (accepted, said) = scene.give(order);
            let _ = scene.heard.send(match accepted {
                true => Heard::Ordered { order, accepted, said },
                false => Heard::NotAccepted { order, said },
            });
        });
    }

    /// Whether it was accepted, and what was answered.
    fn give(&self, order: Order) -> (bool, String) {
        let _ = self.heard.send(Heard::Given(order));
        let (accepted, said) = self.kittiwake(&["vehicle", order.verb()]);
        let _ = self.heard.send(Heard::Answered { order, accepted });
        (accepted, said)
    }

    /// Whether the command succeeded, and what it said.
    fn kittiwake(&self, arguments: &[&str]) -> (bool, String) {
        let mut command = Command::new(&self.setup.program);
        command.args(arguments).args(&self.reach.target).stdin(Stdio::null());
        match command.output() {
            Ok(it) => {
                let said = String::from_utf8_lossy(&[it.stdout, it.stderr].concat()).trim().to_owned();
                (it.status.success(), said)
            }
            Err(cause) => (false, cause.to_string()),
        }
    }
}
