//! The shells that run one node or all of them, each as a story sees it.

#![expect(clippy::disallowed_methods, reason = "a test waits for what other threads do, up to a limit")]

use std::sync::mpsc::channel;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use bus::{Direct, Link, Process, Stop, run_router};
use node::virtual_bus::{Machine, VirtualBus};
use node::{Node, Scope};

use tempfile::TempDir;

use crate::stories::contract::probe::{Gate, Probe, Seen};

/// What is waited for comes within this, on a machine that is not broken.
pub const LIMIT: Duration = Duration::from_secs(60);

/// Nodes run on it.
pub trait Shell {
    /// Puts a node on the bus; what it gets.
    fn add(&mut self, scope: Scope, probe: Probe) -> Seen;

    /// Lets the nodes run until `done`. `what` is what a story that fails has waited for.
    fn wait_for(&mut self, what: &str, done: &mut dyn FnMut() -> bool);

    /// A closed gate for a node of this scope.
    fn gate(&self, scope: &Scope) -> Gate;

    /// Whether a mailbox can be full.
    fn bounds_mailboxes(&self) -> bool;
}

/// All nodes in one thread, on an ideal machine.
pub struct Virtual(VirtualBus<'static>);

impl Virtual {
    /// Without nodes.
    pub fn new() -> Virtual {
        Virtual(VirtualBus::new(Machine::Ideal))
    }
}

impl Shell for Virtual {
    fn add(&mut self, scope: Scope, probe: Probe) -> Seen {
        let seen = probe.seen.clone();
        self.0.add(scope, probe);
        seen
    }

    fn wait_for(&mut self, what: &str, done: &mut dyn FnMut() -> bool) {
        assert!(self.0.run_until(LIMIT, done), "waited {LIMIT:?} of virtual time for {what}");
    }

    fn gate(&self, _: &Scope) -> Gate {
        Gate::without_threads()
    }

    fn bounds_mailboxes(&self) -> bool {
        false
    }
}

/// A router, and a thread for each node. They end with the value.
pub struct Real {
    locator: String,
    stop: Stop,
    threads: Vec<JoinHandle<()>>,
    /// The folder of the direct links, and who listens there so far.
    links: Option<(TempDir, Vec<String>)>,
}

impl Real {
    /// The router alone.
    pub fn start() -> Real {
        let stop = Stop::new();
        let (sender, receiver) = channel();
        let until = stop.clone();
        let router = std::thread::spawn(move || {
            let ready = |bound: &[String]| sender.send(bound[0].clone()).unwrap();
            run_router(&["tcp/127.0.0.1:0".into()], &until, ready).unwrap();
        });
        Real { locator: receiver.recv().unwrap(), stop, threads: vec![router], links: None }
    }

    /// The same; the nodes of one vehicle are also linked directly, each with those before it.
    pub fn linked() -> Real {
        let mut real = Real::start();
        real.links = Some((tempfile::tempdir().unwrap(), Vec::new()));
        real
    }

    /// How a node of this scope gets onto its bus.
    pub fn link(&self, scope: Scope) -> Link {
        let scope = match scope {
            Scope::Vehicle(vehicle) => bus::Scope::Vehicle(vehicle.to_string()),
            Scope::Fleet => bus::Scope::Fleet,
        };
        Link { connect: vec![self.locator.clone()], scope, open_timeout: LIMIT }
    }

    /// Runs something that ends with the value, on a thread of its own.
    pub fn spawn(&mut self, run: impl FnOnce(&Stop) + Send + 'static) {
        let stop = self.stop.clone();
        self.threads.push(std::thread::spawn(move || run(&stop)));
    }

    /// The links of a node to those before it, if there are any at all.
    pub fn direct(&mut self, probe: &Probe) -> Option<Direct> {
        let (folder, names) = self.links.as_mut()?;
        let own = format!("{}-{}", probe.name(), names.len());
        let direct = Direct { folder: folder.path().join("links"), listen: Some(own.clone()), connect: names.clone() };
        names.push(own);
        Some(direct)
    }
}

impl Shell for Real {
    fn add(&mut self, scope: Scope, mut probe: Probe) -> Seen {
        let (seen, link) = (probe.seen.clone(), self.link(scope));
        let direct = self.direct(&probe).filter(|_| matches!(link.scope, bus::Scope::Vehicle(_)));
        self.spawn(move |stop| {
            Process { direct: direct.as_ref(), ..Process::of(&mut probe, &link) }.run(stop).unwrap();
        });
        seen
    }

    fn wait_for(&mut self, what: &str, done: &mut dyn FnMut() -> bool) {
        let until = Instant::now() + LIMIT;
        while !done() {
            assert!(Instant::now() < until, "waited {LIMIT:?} for {what}");
            // The pace of asking, not something to wait for.
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    fn gate(&self, _: &Scope) -> Gate {
        Gate::closed()
    }

    fn bounds_mailboxes(&self) -> bool {
        true
    }
}

impl Drop for Real {
    fn drop(&mut self) {
        self.stop.stop();
        for thread in self.threads.drain(..).rev() {
            // A node that panicked has failed its story already.
            let _ = thread.join();
        }
    }
}
