//! Which flights the arguments ask for, and flying them in several threads.

use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};

use control_tower::policy::Policy;
use domain::area::AreaKind;
use domain::file::Mistakes;
use simulation::Machine;
use simulation::chaos::draw::{self, Existing};
use simulation::chaos::fly::{Flight, fly, fly_recorded};
use simulation::chaos::script::{Choice, Script};
use simulation::recording::{Entry, Header};

use super::args::SimulateArgs;
use crate::check_inputs::Inputs;

/// What all flights of one command have in common.
pub struct Flights {
    args: SimulateArgs,
    mission: Existing,
    permissions: Policy,
}

impl Flights {
    /// Those that the arguments ask for, of the mission that was read.
    pub fn of(args: &SimulateArgs, inputs: &Inputs) -> Flights {
        let asked_for = inputs.mission.areas.iter().filter(|it| it.kind == AreaKind::Permission);
        let areas = asked_for.map(|it| it.name.clone()).collect();
        let mission = args.mission.clone().map_or(Choice::Configured, Choice::File);
        let permissions = inputs.config.permissions;
        Flights { args: args.clone(), mission: Existing { mission, areas }, permissions }
    }

    /// The flight of a seed.
    pub fn script(&self, seed: u64) -> Script {
        let machine = if self.args.busy { draw::busy(seed) } else { Machine::Ideal };
        let draws_mission = self.args.mission.is_none() && !seed.is_multiple_of(4);
        let mut script = match self.args.chaos || self.args.shrink.is_some() {
            true if draws_mission => draw::random(seed, machine),
            true => draw::existing(seed, std::slice::from_ref(&self.mission), machine),
            false => {
                let (mission, permissions) = (self.mission.mission.clone(), self.permissions);
                Script { settles: false, ..Script::new(seed, mission, permissions, machine, Vec::new()) }
            }
        };
        script.troubles.extend(self.args.troubles());
        script.troubles.sort_by_key(|(at, _)| *at);
        script
    }

    /// Flies the first one, and records it.
    ///
    /// # Errors
    /// Mistakes in the files, if they were changed meanwhile.
    pub fn fly_recorded(&self) -> Result<(Flight, Header, Vec<Entry>), Mistakes> {
        fly_recorded(&self.script(self.args.seed), self.config())
    }

    /// The configuration file.
    pub fn config(&self) -> &Path {
        &self.args.config
    }

    /// Flies all of them, `done` after each; in the order of their seeds.
    ///
    /// # Errors
    /// Mistakes in the files, if they were changed meanwhile.
    pub fn fly(&self, done: impl Fn(&Flight) + Sync) -> Result<Vec<Flight>, Mistakes> {
        let SimulateArgs { seed, runs, jobs, .. } = &self.args;
        let (next, flown) = (AtomicU32::new(0), Mutex::new(Vec::new()));
        std::thread::scope(|scope| {
            for _ in 0..jobs.get().min(runs.get() as usize) {
                scope.spawn(|| {
                    loop {
                        let number = next.fetch_add(1, Ordering::Relaxed);
                        if runs.get() <= number {
                            return;
                        }
                        // The simulation lives in this thread alone.
                        let flight = fly(&self.script(seed.wrapping_add(number.into())), self.config());
                        flight.iter().for_each(&done);
                        flown.lock().unwrap_or_else(|it| it.into_inner()).push((number, flight));
                    }
                });
            }
        });
        let mut flown = flown.into_inner().unwrap_or_else(|it| it.into_inner());
        flown.sort_by_key(|(number, _)| *number);
        flown.into_iter().map(|(_, flight)| flight).collect()
    }
}
