//! The node: events into the world, ticks of the tree, effects out.

use behavior_tree::{NextTick, Status, Tree};
use domain::aircraft::Aircraft;
use domain::contingency::Contingencies;
use domain::memory::MemoryLoss;
use domain::mission::Mission;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{Request, Response, Service, Topic};
use kittiwake_proto::v1;
use node::{Effect, Event, Node, Token};
use signed_permissions::key::PublicKey;

use crate::config::Config;
use crate::timing::Timing;
use crate::trees::LoadedTrees;
use crate::world::persisted::UnusableState;
use crate::world::{Reporter, World};

/// The mission and contingency manager of one vehicle.
pub struct Mcm {
    tree: Tree<World>,
    world: World,
    /// `None` where nothing is measured.
    timing: Option<Timing>,
    /// The identity of the mission that it was made for.
    configured: String,
    reporter: Reporter,
    /// When the tree is ticked even if nothing happens; `None` once it has ended.
    next_tick: Option<Time>,
    ticks: u64,
}

impl Mcm {
    /// A manager for `vehicle`. `instance` makes its request ids unique among restarts.
    ///
    /// # Errors
    /// If the trees lack the main tree, or its leaves cannot be built; [`crate::Trees::load`] has
    /// checked both, so this is a mistake in the program.
    pub fn new(
        config: &Config,
        aircraft: &Aircraft,
        vehicle: &str,
        instance: u64,
        trees: &LoadedTrees,
        table: Contingencies,
        pace: Pace,
    ) -> Result<Mcm, behavior_tree::InstantiateError> {
        Ok(Mcm {
            tree: trees.0.instantiate("mission", &[])?,
            world: World::new(config.limits(*aircraft, pace), vehicle, instance, table, trees.0.clone()),
            timing: None,
            configured: String::new(),
            reporter: Reporter::default(),
            next_tick: Some(Time::ZERO),
            ticks: 0,
        })
    }

    /// Flies `mission`; a persisted state counts only for the same mission file.
    pub fn of_mission(mut self, mission: &Mission) -> Mcm {
        self.configured = mission.identity();
        self.world.begin_mission(mission);
        self
    }

    /// Believes only permissions that the control tower has signed with the other half of this key.
    pub fn that_verifies_with(mut self, key: PublicKey) -> Mcm {
        self.world.verify_permissions_with(key);
        self
    }

    /// The persisted state, with which another process can continue.
    pub fn memory(&self) -> v1::McmMemory {
        self.world.persist(&self.configured)
    }

    /// Continues from `memory`; to be called before anything else.
    ///
    /// # Errors
    /// Why the state cannot be used; the manager then starts without it.
    pub fn resume(&mut self, memory: v1::McmMemory) -> Result<(), UnusableState> {
        self.world.resume(&self.configured, memory)
    }

    /// What a manager before has saved last is lost; to be called before anything else. See `memory_unusable` in the
    /// contingency table.
    pub fn memory_lost(&mut self, loss: MemoryLoss) {
        self.world.memory_lost(loss);
    }

    /// The outcome of the newest attempt to save. `loss` names the loss that a failure is, as long as no attempt has
    /// succeeded.
    pub fn memory_written(&mut self, outcome: Result<(), String>, loss: Option<u64>) {
        self.world.memory_written(outcome, loss);
    }

    /// Measures with `now_ns`, which reads nanoseconds of any one clock, and publishes on `mcm/timing`. Measurements
    /// decide nothing; without this call nothing is recorded.
    pub fn measured_with(mut self, now_ns: fn() -> u64) -> Mcm {
        self.timing = Some(Timing::of(&mut self.tree, now_ns));
        self
    }

    /// Publishes no `mcm/tree`: where nobody reads it, it would be most of what a flight costs. It decides nothing.
    pub fn without_its_tree(mut self) -> Mcm {
        self.reporter.leaves_out_tree = true;
        self
    }

    fn wake(&mut self, now: Now) {
        self.world.set_now(now);
        if let Some(timing) = &mut self.timing {
            timing.wake();
        }
    }

    /// Another flight begins: nothing of the tree of the one before goes on.
    fn begin_tree(&mut self, now: Now) {
        match self.world.library().instantiate("mission", &[]) {
            Ok(tree) => {
                self.tree = tree;
                if let Some(timing) = &mut self.timing {
                    timing.follow(&mut self.tree);
                }
                self.next_tick = Some(now.time);
            }
            // The same trees have made the first one.
            Err(mistake) => self.world.say("mission", format!("the tree cannot be made again: {mistake}")),
        }
    }

    /// Ticks the tree until no node asks for another tick at this moment.
    fn tick(&mut self) {
        if self.next_tick.is_none() {
            // What is wrong with a vehicle that stands there is still told.
            self.world.take_in_news();
            if !self.world.flies_unattended() {
                return;
            }
            // False touchdown, or the autopilot resumed a takeoff: land the vehicle.
            self.world.raise_ended_in_air();
        }
        let now = self.world.now();
        if let Some(timing) = &mut self.timing {
            timing.tick_begins();
        }
        let answer = self.tree.tick_once(now.since_start(), &mut self.world);
        if let Some(timing) = &mut self.timing {
            self.reporter.tick_times.add(timing.tick_ended());
        }
        self.ticks += 1;
        for error in self.tree.take_errors().0 {
            self.world.say("mission", format!("a node of the tree failed by an error: {}", error.kind));
        }
        let periodic = now + self.world.limits().tick_period;
        let waits_until = self.world.decision_now().wait.and_then(|it| it.until).filter(|it| now < *it);
        let periodic = waits_until.map_or(periodic, |it| periodic.min(it));
        self.next_tick = match (answer, self.tree.next_tick()) {
            (Status::Running, NextTick::At(at)) => Some(periodic.min(Time::after(at))),
            (Status::Running, _) => Some(periodic),
            _ => None,
        };
    }
}

impl Node for Mcm {
    fn name(&self) -> &'static str {
        "mcm"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[Topic::Introspection, Topic::SkillEvent, Topic::SkillFeedback, Topic::SkillControl, Topic::PermissionLedger]
    }

    fn serves(&self) -> &'static [Service] {
        &[Service::OperatorCommand, Service::Mission]
    }

    fn on(&mut self, now: Now, event: Event, _: &mut Vec<Effect>) {
        self.wake(now);
        match event {
            Event::Message { message, .. } => self.world.take_in(message),
            Event::Reply { call, result } => self.world.take_reply(call, result),
            Event::Request { token, request: Request::OperatorCommand(command), .. } => {
                let reply = self.world.obey(command);
                self.world.out.outbox.reply(token, Response::OperatorCommand(reply));
                if self.world.takes_new_tree() {
                    self.begin_tree(now);
                }
                if self.world.next_responder().is_some() {
                    // The tree had ended, and the vehicle flies again: an order to come down must still be obeyed.
                    self.next_tick.get_or_insert(now.time);
                }
            }
            Event::Request { token, request: Request::Mission(request), .. } => self.world.take_request(token, request),
            Event::Peer { vehicle, service, alive: true, .. } if service == "monitor" => {
                self.world.monitor_started(&vehicle);
            }
            Event::Request { .. } | Event::Peer { .. } => {}
        }
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.wake(now);
        self.tick();
        self.world.flush();
        // Decisions first: who stops listening at the report has heard why.
        self.world.publish_decisions();
        // Not while something waits to be sent: a response must not wait for what it may need later.
        if self.reporter.next <= now.time && self.world.out.outbox.is_empty() {
            self.world.look_ahead();
        }
        self.reporter.report(&self.tree, &mut self.world, self.ticks);
        if let Some(record) = self.timing.as_mut().and_then(|timing| timing.end_wake(&mut self.tree)) {
            self.world.out.outbox.publish(record);
        }
        self.world.out.outbox.drain_into(effects);
    }

    fn answers_later(&self, token: Token) -> bool {
        self.world.answers_later(token)
    }

    fn deadline(&self) -> Option<Time> {
        [self.next_tick, Some(self.reporter.next), self.world.deadline()].into_iter().flatten().min()
    }
}

#[cfg(test)]
impl Mcm {
    /// What is decided now, as far as it is kept, and from nothing.
    pub(crate) fn decided(&self) -> (crate::decide::Decision, crate::decide::Decision) {
        self.world.decided()
    }
}
