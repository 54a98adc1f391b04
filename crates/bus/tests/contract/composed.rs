//! The shell that runs the nodes of a vehicle in one process, as a story sees it.

use std::collections::BTreeMap;

use bus::{Composition, Direct, Hosted, Nudge};
use domain::time::Pace;
use node::{Scope, VehicleId};

use crate::stories::contract::probe::{Gate, Probe, Seen};
use crate::stories::contract::shell::{Real, Shell};

/// A router, a thread for each node on the ground, and for each vehicle one thread for all of its nodes that are there when the story
/// first waits. A node that comes later has a thread of its own, as in a process that is started later.
pub struct Composed {
    real: Real,
    waiting: BTreeMap<VehicleId, Vec<(Probe, Option<Direct>)>>,
}

impl Composed {
    /// The router alone. The nodes of a vehicle are linked directly to those before them that are in another process; to those in their own
    /// they are not, although they are to be.
    pub fn start() -> Composed {
        Composed { real: Real::linked(), waiting: BTreeMap::new() }
    }

    fn begin(&mut self) {
        for (vehicle, mut probes) in std::mem::take(&mut self.waiting) {
            let link = self.real.link(Scope::Vehicle(vehicle));
            self.real.spawn(move |stop| {
                let mut nodes = Vec::new();
                for (node, direct) in &mut probes {
                    nodes.push(Hosted { node, direct: direct.take(), nudge: Nudge::default() });
                }
                Composition { nodes, link: &link, pace: Pace::REAL_TIME, is_only_one: false }.run(stop).unwrap();
            });
        }
    }
}

impl Shell for Composed {
    fn add(&mut self, scope: Scope, probe: Probe) -> Seen {
        match scope {
            Scope::Fleet => self.real.add(scope, probe),
            Scope::Vehicle(vehicle) => {
                let (seen, direct) = (probe.seen.clone(), self.real.direct(&probe));
                self.waiting.entry(vehicle).or_default().push((probe, direct));
                seen
            }
        }
    }

    fn wait_for(&mut self, what: &str, done: &mut dyn FnMut() -> bool) {
        self.begin();
        self.real.wait_for(what, done);
    }

    /// On board nobody may be kept: the others have the same thread.
    fn gate(&self, scope: &Scope) -> Gate {
        match scope {
            Scope::Fleet => self.real.gate(scope),
            Scope::Vehicle(_) => Gate::without_threads(),
        }
    }

    fn bounds_mailboxes(&self) -> bool {
        false
    }
}
