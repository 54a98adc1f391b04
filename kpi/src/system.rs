//! A system under measurement: the same children that `kittiwake up` starts, and a tap on their bus.

#![expect(
    clippy::disallowed_methods,
    reason = "it waits for real processes up to a limit, and keeps all that it hears"
)]

use std::io;
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use bus::{Direct, Link, Process, Scope, Stop, Tap, Tapped};
use kittiwake::backend::Backend;
use kittiwake::composition::Composition;
use kittiwake::service::Service;
use kittiwake::settings::Settings;
use kittiwake::up::Happening;
use kittiwake::up::children::Children;
use kittiwake::up::supervise::Child;
use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1::{SkillKind, SkillState};
use node::Node;

/// A process that starts, or ends, takes no longer than this.
const LIMIT: Duration = Duration::from_secs(10);

/// The processes besides the router of a system that flies the simulated vehicle.
pub(crate) fn processes(onboard: Option<Composition>) -> Vec<Child> {
    Child::of_services(&Backend::Sim.services(), onboard)
}

/// Topics from which transitions and reactions are put together.
pub(crate) const DECISIONS: &[Topic] = &[
    Topic::McmTiming,
    Topic::McmStatus,
    Topic::SkillEvent,
    Topic::FlagEvent,
    Topic::Introspection,
    Topic::VehicleCommand,
    Topic::VehicleCommandAck,
];

/// Runs until it is dropped.
pub(crate) struct System {
    children: Children,
    happenings: Receiver<Happening>,
    tap: Option<Tap>,
    heard: Receiver<Tapped>,
    link: Link,
}

impl System {
    /// Starts the router of the executable `program`, taps its bus, then starts the other processes.
    pub(crate) fn start(
        program: &Path,
        settings: &Settings,
        vehicle: &str,
        processes: &[Child],
    ) -> Result<System, String> {
        let (sender, happenings) = channel();
        let mut children = Children::of(program.to_owned(), settings, sender).map_err(cannot_start)?;
        children.start(Child::Router, None).map_err(cannot_start)?;
        let locator = loop {
            match happenings.recv_timeout(LIMIT) {
                Ok(Happening::Line { text, .. }) => break text,
                Ok(Happening::Ended(child)) => return Err(format!("{child} has ended")),
                Ok(_) => {}
                Err(_) => return Err("the router does not listen".into()),
            }
        };
        let link =
            Link { connect: vec![locator.clone()], scope: Scope::Vehicle(vehicle.to_owned()), open_timeout: LIMIT };
        let (hear, heard) = channel();
        let tap = Tap::open(&link, DECISIONS, move |it| {
            // Fails only at the end of the measurement.
            let _ = hear.send(it);
        });
        let tap = Some(tap.map_err(|it| it.to_string())?);
        let mut system = System { children, happenings, tap, heard, link };
        for &process in processes {
            system.children.start(process, Some(&locator)).map_err(cannot_start)?;
        }
        Ok(system)
    }

    /// How to get onto its bus.
    pub(crate) fn link(&self) -> &Link {
        &self.link
    }

    /// The processes with their ids.
    pub(crate) fn processes(&self) -> Vec<(Child, u32)> {
        self.children.process_ids()
    }

    /// Ends some of the processes, in order.
    pub(crate) fn end(&mut self, which: &[Child]) {
        end(&mut self.children, &self.happenings, which);
    }

    /// The folder of the direct links.
    pub(crate) fn sockets(&self) -> &Path {
        self.children.sockets()
    }

    /// Runs `node` on its bus, on a thread of its own, until the stop is asked for. It reaches the mission manager as
    /// directly as the monitor does.
    pub(crate) fn join(&self, mut node: impl Node + Send + 'static) -> Stop {
        let (stop, link) = (Stop::new(), self.link.clone());
        let connect = vec![Service::Mcm.name().to_owned(), Service::SkillManager.name().to_owned()];
        let direct = Direct { folder: self.sockets().to_owned(), listen: None, connect };
        let until = stop.clone();
        std::thread::spawn(move || {
            let process = Process { direct: Some(&direct), ..Process::of(&mut node, &link) };
            if let Err(cause) = process.run(&until) {
                tracing::warn!(%cause, "not on the bus");
            }
        });
        stop
    }

    /// Collects what passes by until `enough` says so or `limit` is over; false if it was over.
    pub(crate) fn listen(
        &self,
        limit: Duration,
        heard: &mut Vec<Tapped>,
        mut enough: impl FnMut(&Tapped) -> bool,
    ) -> Result<bool, String> {
        let until = Instant::now() + limit;
        loop {
            while let Ok(happening) = self.happenings.try_recv() {
                match happening {
                    // The mission manager ends with its mission.
                    Happening::Ended(child) if child != Child::Service(Service::Mcm) => {
                        return Err(format!("{child} has ended"));
                    }
                    Happening::Log { child, text } => tracing::warn!(%child, text),
                    _ => {}
                }
            }
            match self.heard.recv_timeout(until.saturating_duration_since(Instant::now())) {
                Ok(it) => {
                    let done = enough(&it);
                    heard.push(it);
                    if done {
                        return Ok(true);
                    }
                }
                Err(RecvTimeoutError::Timeout) => return Ok(false),
                Err(RecvTimeoutError::Disconnected) => return Err("nothing is heard any more".into()),
            }
        }
    }
}

impl Drop for System {
    fn drop(&mut self) {
        let (routers, services): (Vec<_>, Vec<_>) =
            self.children.running().into_iter().partition(|it| *it == Child::Router);
        end(&mut self.children, &self.happenings, &services);
        self.tap = None;
        end(&mut self.children, &self.happenings, &routers);
    }
}

/// Ends children, in order where they let themselves be asked.
fn end(children: &mut Children, happenings: &Receiver<Happening>, which: &[Child]) {
    which.iter().for_each(|it| children.ask_to_end(*it));
    let until = Instant::now() + Duration::from_secs(3);
    let mut left: Vec<Child> = which.to_vec();
    while !left.is_empty() {
        match happenings.recv_timeout(until.saturating_duration_since(Instant::now())) {
            Ok(Happening::Ended(child)) => left.retain(|it| *it != child),
            Ok(_) => {}
            Err(_) => break,
        }
    }
    for child in which {
        children.kill(*child);
        children.reap(*child);
    }
}

/// Whether the message says that the mission is over.
pub(crate) fn is_report(it: &Tapped) -> bool {
    matches!(&it.message, Message::McmStatus(status) if status.report.is_some())
}

/// Collects what passes by until a skill of this kind is in this state.
pub(crate) fn await_skill(
    system: &System,
    kind: SkillKind,
    state: SkillState,
    heard: &mut Vec<Tapped>,
) -> Result<(), String> {
    let seen = system.listen(Duration::from_secs(60), heard, |it| match &it.message {
        Message::SkillEvent(event) => event.kind() == kind && event.state() == state,
        _ => false,
    })?;
    if seen { Ok(()) } else { Err(format!("skill {kind:?} did not come to {state:?}")) }
}

fn cannot_start(cause: io::Error) -> String {
    format!("cannot start: {cause}")
}
