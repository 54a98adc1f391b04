//! The two shells, each as a story sees it.

#![expect(clippy::disallowed_methods, reason = "a test waits for what other threads do, up to a limit")]

use std::sync::mpsc::channel;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use bus::{Link, Process, Stop, run_router};
use node::Scope;
use node::virtual_bus::{Machine, VirtualBus};

use crate::probe::{Gate, Probe, Seen};

/// What is waited for comes within this, on a machine that is not broken.
const LIMIT: Duration = Duration::from_secs(60);

/// Nodes run on it.
pub trait Shell {
    /// Puts a node on the bus; what it gets.
    fn add(&mut self, scope: Scope, probe: Probe) -> Seen;

    /// Lets the nodes run until `done`. `what` is what a story that fails has waited for.
    fn wait_for(&mut self, what: &str, done: &mut dyn FnMut() -> bool);

    /// A closed gate.
    fn gate(&self) -> Gate;

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

    fn gate(&self) -> Gate {
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
        Real { locator: receiver.recv().unwrap(), stop, threads: vec![router] }
    }
}

impl Shell for Real {
    fn add(&mut self, scope: Scope, mut probe: Probe) -> Seen {
        let seen = probe.seen.clone();
        let scope = match scope {
            Scope::Vehicle(vehicle) => bus::Scope::Vehicle(vehicle.to_string()),
            Scope::Fleet => bus::Scope::Fleet,
        };
        let link = Link { connect: vec![self.locator.clone()], scope, open_timeout: LIMIT };
        let stop = self.stop.clone();
        self.threads.push(std::thread::spawn(move || Process::of(&mut probe, &link).run(&stop).unwrap()));
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

    fn gate(&self) -> Gate {
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
