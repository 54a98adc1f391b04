//! The node: events into the world, the world into the tree, the tree's wishes out.

use behavior_tree::{NextTick, Status, Tree};
use domain::contingency::Contingencies;
use domain::mission::Mission;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{Message, Request, Response, Service, Topic};
use kittiwake_proto::v1;
use node::{CallError, CallId, Effect, Event, Node};
use std::sync::Arc;

use crate::clients::permissions::Permissions;
use crate::clients::planner::{Held, Planner, Replanning};
use crate::clients::skills::Skills;
use crate::config::{Config, Limits};
use crate::flags::Flags;
use crate::memory::{self, Useless};
use crate::operator::{self, Operator};
use crate::outbox::{Outbox, Purpose};
use crate::status::Reporter;
use crate::timing::{Meters, Timing};
use crate::trees::LoadedTrees;
use crate::vehicle::{Shown, Vehicle};
use crate::world::{self, World};

/// The mission and contingency manager of one vehicle.
pub struct Mcm {
    tree: Tree<World>,
    world: World,
    /// The mission that it was made for, in words.
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
        vehicle: &str,
        instance: u64,
        trees: &LoadedTrees,
        table: Contingencies,
        pace: Pace,
    ) -> Result<Mcm, behavior_tree::InstantiateError> {
        let limits: Limits = config.limits(pace);
        let tree = trees.0.instantiate("mission", &[])?;
        let world = World {
            now: Now::default(),
            limits,
            flags: Flags::of(&table),
            table: Arc::new(table),
            library: trees.0.clone(),
            inbox: Default::default(),
            vehicle: None,
            shown: Shown::default(),
            skills: Skills::new(instance),
            planner: Planner::new(instance),
            permissions: Permissions::new(instance),
            mission: world::Mission { vehicle_name: vehicle.to_owned(), ..Default::default() },
            operator: Operator::default(),
            acting: None,
            in_transition: false,
            failure: Default::default(),
            outbox: Outbox::default(),
            decisions: 0,
            unsaid: Vec::new(),
            timing: Timing::default(),
            discarded: Vec::new(),
        };
        Ok(Mcm {
            tree,
            world,
            configured: String::new(),
            reporter: Reporter::default(),
            next_tick: Some(Time::ZERO),
            ticks: 0,
        })
    }

    /// Made for `mission`: what another manager knew counts only for the same one.
    pub fn of_mission(mut self, mission: &Mission) -> Mcm {
        self.configured = mission.in_words();
        self
    }

    /// What another manager needs to go on from here, should this process end.
    pub fn memory(&self) -> v1::McmMemory {
        memory::memory(&self.world, &self.configured)
    }

    /// Goes on where the manager of `memory` was; to be called before anything else.
    ///
    /// # Errors
    /// Why the memory is of no use; the manager then begins anew.
    pub fn resume(&mut self, memory: v1::McmMemory) -> Result<(), Useless> {
        memory::resume(&mut self.world, &self.configured, memory)
    }

    /// Measures what happens with `meters`; without them all takes no time. Nothing is decided by it.
    pub fn with_meters(mut self, meters: Meters) -> Mcm {
        self.world.timing = Timing::new(meters);
        self
    }

    fn take_in(&mut self, message: Message) {
        let world = &mut self.world;
        let now = world.now.time;
        match message {
            Message::Introspection(it) => {
                world.inbox.list(&it.flags);
                if let Some(vehicle) = Vehicle::from_wire(now, &it) {
                    world.inbox.vehicle = Some(vehicle);
                }
            }
            Message::FlagEvent(it) => world.inbox.flags.push(it),
            Message::SkillEvent(it) => {
                world.skills.on_event(now, &it);
                world.shown.learn_from(now, &it);
                world.vehicle = world.vehicle.map(|it| world.shown.correct(it, now, world.limits.introspection));
            }
            Message::SkillFeedback(it) => world.skills.on_feedback(now, &it),
            Message::PermissionLedger(it) => {
                for news in world.permissions.on_ledger(now, &it) {
                    world.say("permission", news);
                }
            }
            Message::PlannerStatus(it) => world.planner.on_status(it),
            _ => {}
        }
    }

    fn take_reply(&mut self, call: CallId, result: Result<Response, CallError>) {
        let world = &mut self.world;
        let (now, timeout) = (world.now.time, world.limits.request_timeout);
        match world.outbox.purpose(call) {
            Some(Purpose::StartSkill(id)) => world.skills.on_reply(now, &id, result, timeout, &mut world.outbox),
            Some(Purpose::SkillTable) => {
                if let Ok(Response::SkillTable(table)) = result {
                    world.skills.on_table(now, &table);
                }
            }
            Some(Purpose::Replan(id)) => {
                let held = Held { revision: world.permissions.revision, areas: world.held() };
                let approval = world.limits.approval();
                let news = world.planner.on_plan(now, &id, result, timeout, held, approval);
                if world.planner.replanning == Replanning::Planned {
                    world.timing.mark(v1::TimingPoint::PlanReady);
                }
                if let Some(words) = news {
                    world.say("plan", words);
                }
            }
            Some(Purpose::NextStep(after)) => world.planner.on_next(now, after, result, timeout),
            Some(Purpose::StepDone(id)) => world.planner.on_done(now, id, result, timeout),
            Some(Purpose::Permission(area)) => {
                if let Err(error) = result {
                    world.permissions.on_trouble(&area, error);
                }
            }
            // A cancelled skill says so itself.
            Some(Purpose::CancelSkill(skill_id)) if result.is_err() => world.skills.on_cancel_lost(skill_id),
            Some(Purpose::CancelSkill(_)) | None => {}
        }
    }

    /// Ticks the tree until it has nothing more to say about this moment.
    fn tick(&mut self) {
        if self.next_tick.is_none() {
            return;
        }
        let now = self.world.now.time;
        let begun = self.world.timing.tick();
        let answer = self.tree.tick_once(now.since_start(), &mut self.world);
        self.world.timing.ticked(begun);
        self.ticks += 1;
        for fault in self.tree.take_faults().0 {
            self.world.say("mission", format!("a node of the tree failed by a fault: {}", fault.kind));
        }
        let periodic = now + self.world.limits.tick_period;
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
        &[
            Topic::Introspection,
            Topic::FlagEvent,
            Topic::SkillEvent,
            Topic::SkillFeedback,
            Topic::PermissionLedger,
            Topic::PlannerStatus,
        ]
    }

    fn serves(&self) -> &'static [Service] {
        &[Service::OperatorCommand]
    }

    fn on(&mut self, now: Now, event: Event, _: &mut Vec<Effect>) {
        self.world.now = now;
        self.world.timing.wake();
        match event {
            Event::Message { message, .. } => self.take_in(message),
            Event::Reply { call, result } => self.take_reply(call, result),
            Event::Request { token, request: Request::OperatorCommand(command), .. } => {
                let reply = operator::obey(&mut self.world, command, self.next_tick.is_none());
                self.world.outbox.reply(token, Response::OperatorCommand(reply));
            }
            Event::Request { .. } | Event::Peer { .. } => {}
        }
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.world.now = now;
        self.world.timing.wake();
        // Of the wakes before this one: what is given up now can wait until its successor is under way.
        let discarded = std::mem::take(&mut self.world.discarded);
        self.tick();
        let world = &mut self.world;
        let Limits { request_timeout, skill_silence, .. } = world.limits;
        world.skills.flush(request_timeout, &mut world.outbox);
        world.skills.tend(now.time, skill_silence, request_timeout, &mut world.outbox);
        world.planner.tell(now.time, request_timeout, &mut world.outbox);
        world.planner.prefetch(now.time, request_timeout, &mut world.outbox);
        self.reporter.report(&self.tree, world, self.next_tick.is_none(), self.ticks);
        world.publish_decisions();
        if let Some(record) = world.timing.end_wake() {
            world.outbox.publish(record);
        }
        world.outbox.drain_into(effects);
        drop(discarded);
    }

    fn deadline(&self) -> Option<Time> {
        let world = &self.world;
        let wishes = [
            self.next_tick,
            Some(self.reporter.next()),
            world.skills.deadline(world.limits.skill_silence),
            world.planner.deadline(world.now.time),
        ];
        wishes.into_iter().flatten().min()
    }
}
