//! Runs a skill manager and an autopilot together, and records what happens.

use std::time::Duration;

use domain::geometry::Ned;
use domain::skill::{Goal, kind_name, outcome_name};
use domain::task::TaskGoal;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{Message, Request, Response};
use kittiwake_proto::v1::{self, SkillOutcome, SkillState, WhenBusy, vehicle_command::Command};
use node::{Effect, Event, Node, Token};
use skill_manager::SkillManager;

use super::autopilot::{Autopilot, Reaction};

/// How long a message takes from the autopilot, in wall time.
const LATENCY: Duration = Duration::from_millis(5);

/// Straight to this far north of the origin, at 10 m.
pub(crate) fn fly_to(north_m: f64) -> Goal {
    Goal::fly_to(Ned::new(north_m, 0.0, -10.0), 5.0)
}

pub(crate) struct Rig {
    node: SkillManager,
    pace: Pace,
    pub(crate) autopilot: Autopilot,
    pub(crate) now: Time,
    /// Messages on their way to the node.
    inbox: Vec<(Time, Message)>,
    next_step: Time,
    replies: Vec<Response>,
    requests: u64,
    pub(crate) events: Vec<v1::SkillEvent>,
    pub(crate) feedback: Vec<v1::SkillFeedback>,
    /// How it said last that somebody else flies; empty: nobody does.
    pub(crate) other: String,
    /// Messages that were refused, and why.
    pub(crate) refused: Vec<String>,
    /// What the processes of declared skills were told.
    pub(crate) task_orders: Vec<v1::TaskOrder>,
    /// When setpoints were sent.
    pub(crate) setpoints: Vec<Time>,
    story: String,
}

impl Rig {
    /// Has run for a second, so that every source was heard.
    pub(crate) fn new(autopilot: Autopilot) -> Rig {
        let mut rig = Rig::silent(autopilot);
        rig.run(1.0);
        rig
    }

    /// Has not heard the vehicle yet.
    pub(crate) fn silent(autopilot: Autopilot) -> Rig {
        Rig::at_speed(1, autopilot)
    }

    /// Mission time runs `speed` times as fast as the wall clock, to which the rates keep.
    pub(crate) fn at_speed(speed: u32, autopilot: Autopilot) -> Rig {
        let config = toml::from_str(super::CONFIG).unwrap();
        let pace = Pace::new(speed.into()).unwrap();
        Rig {
            node: SkillManager::new(&config, pace),
            pace,
            autopilot: autopilot.at_speed(speed),
            now: Time::ZERO,
            inbox: Vec::new(),
            next_step: Time::ZERO,
            replies: Vec::new(),
            requests: 0,
            events: Vec::new(),
            feedback: Vec::new(),
            other: String::new(),
            refused: Vec::new(),
            task_orders: Vec::new(),
            setpoints: Vec::new(),
            story: String::new(),
        }
    }

    /// Sets what becomes of the next commands.
    pub(crate) fn expect(&mut self, reactions: impl IntoIterator<Item = Reaction>) -> &mut Rig {
        self.autopilot.reactions.extend(reactions);
        self
    }

    /// Requests a skill that replaces the running one. Returns its id.
    #[track_caller]
    pub(crate) fn start(&mut self, goal: Goal) -> u64 {
        let reply = self.ask(goal, WhenBusy::Replace, 0);
        assert_eq!(reply.refusal, "");
        reply.skill_id
    }

    /// The same with a task that goes on meanwhile.
    #[track_caller]
    pub(crate) fn start_with(&mut self, goal: Goal, along: &TaskGoal) -> u64 {
        self.requests += 1;
        let reply = self.request(v1::SkillRequest {
            request_id: format!("r{}", self.requests),
            goal: Some(goal.into()),
            when_busy: WhenBusy::Replace as i32,
            along: vec![along.into()],
            ..Default::default()
        });
        assert_eq!(reply.refusal, "");
        reply.skill_id
    }

    /// Requests a skill, with all the options.
    pub(crate) fn ask(&mut self, goal: Goal, when_busy: WhenBusy, gave_up_skill_id: u64) -> v1::SkillReply {
        self.requests += 1;
        self.request(v1::SkillRequest {
            request_id: format!("r{}", self.requests),
            goal: Some(goal.into()),
            when_busy: when_busy as i32,
            gave_up_skill_id,
            ..Default::default()
        })
    }

    /// Requests a skill by an operator's order to take control back. Returns its id.
    #[track_caller]
    pub(crate) fn take_back(&mut self, goal: Goal) -> u64 {
        self.requests += 1;
        let reply = self.request(v1::SkillRequest {
            request_id: format!("r{}", self.requests),
            goal: Some(goal.into()),
            when_busy: WhenBusy::Replace as i32,
            takes_control: true,
            ..Default::default()
        });
        assert_eq!(reply.refusal, "");
        reply.skill_id
    }

    /// Sends a request.
    pub(crate) fn request(&mut self, request: v1::SkillRequest) -> v1::SkillReply {
        match self.call(Request::Skill(request)) {
            Response::Skill(it) => it,
            other => panic!("{other:?}"),
        }
    }

    /// Cancels a skill, or returns why not.
    pub(crate) fn cancel(&mut self, skill_id: u64) -> Result<(), String> {
        match self.call(Request::SkillCancel(v1::SkillCancelRequest { skill_id })) {
            Response::SkillCancel(it) if it.accepted => Ok(()),
            Response::SkillCancel(it) => Err(it.refusal),
            other => panic!("{other:?}"),
        }
    }

    pub(crate) fn table(&mut self) -> Vec<v1::SkillEvent> {
        match self.call(Request::SkillTable(v1::SkillTableRequest {})) {
            Response::SkillTable(it) => it.skills,
            other => panic!("{other:?}"),
        }
    }

    /// Lets mission time pass.
    pub(crate) fn run(&mut self, seconds: f64) -> &mut Rig {
        let end = self.now + Duration::from_secs_f64(seconds);
        self.run_while(end, |_| true);
        self.now = end;
        self
    }

    /// Lets time pass until a skill has ended. Returns its outcome.
    #[track_caller]
    pub(crate) fn outcome(&mut self, skill_id: u64) -> SkillOutcome {
        let end = self.now + Duration::from_secs(600);
        self.run_while(end, |rig| rig.ending(skill_id).is_none());
        self.ending(skill_id).unwrap_or_else(|| panic!("skill {skill_id} has not ended\n{}", self.story)).outcome()
    }

    /// The last event of a skill that has ended.
    pub(crate) fn ending(&self, skill_id: u64) -> Option<&v1::SkillEvent> {
        self.events.iter().find(|it| it.skill_id == skill_id && it.state() == SkillState::Ended)
    }

    /// Why a skill ended.
    pub(crate) fn reason(&self, skill_id: u64) -> &str {
        self.ending(skill_id).map_or("", |it| it.reason.as_str())
    }

    /// Compares what was commanded and what happened to the skills.
    #[track_caller]
    pub(crate) fn check(&self, expected: &str) {
        let clean = |text: &str| text.lines().map(str::trim).filter(|it| !it.is_empty()).collect::<Vec<_>>().join("\n");
        let (story, expected) = (clean(&self.story), clean(expected));
        assert!(story == expected, "\n--- happened\n{story}\n--- expected\n{expected}\n");
    }

    /// Forgets what was recorded.
    pub(crate) fn forget(&mut self) -> &mut Rig {
        self.story.clear();
        self.setpoints.clear();
        self.feedback.clear();
        self.autopilot.commands.clear();
        self
    }

    /// Delivers a message now.
    pub(crate) fn deliver(&mut self, message: Message) {
        self.on(Event::Message { vehicle: "uav1".into(), message });
        self.act();
    }

    fn call(&mut self, request: Request) -> Response {
        self.on(Event::Request { vehicle: "uav1".into(), token: Token(1), request });
        self.act();
        assert_eq!(self.replies.len(), 1, "every request is answered at once, exactly once");
        self.replies.remove(0)
    }

    fn run_while(&mut self, end: Time, goes_on: impl Fn(&Rig) -> bool) {
        let mut calls_at_once = 0;
        while goes_on(self) {
            let delivery = self.inbox.first().map(|it| it.0);
            let deadline = self.node.deadline();
            let next = [Some(self.next_step), delivery, deadline].into_iter().flatten().min().unwrap();
            if end < next {
                return;
            }
            calls_at_once = if next <= self.now { calls_at_once + 1 } else { 0 };
            assert!(calls_at_once < 100, "a deadline that never passes: {deadline:?} at {:?}", self.now);
            self.now = self.now.max(next);
            if delivery == Some(next) {
                let (_, message) = self.inbox.remove(0);
                self.deliver(message);
            } else if deadline == Some(next) {
                self.act();
            } else {
                let said = self.autopilot.fly(self.now);
                self.next_step = self.now + self.autopilot.step();
                self.post(said);
            }
        }
    }

    fn post(&mut self, messages: Vec<Message>) {
        let at = self.now + self.pace.wall(LATENCY);
        self.inbox.extend(messages.into_iter().map(|it| (at, it)));
    }

    fn moment(&self) -> Now {
        Now { time: self.now, utc_ms: 0 }
    }

    fn on(&mut self, event: Event) {
        let mut effects = Vec::new();
        self.node.on(self.moment(), event, &mut effects);
        self.perform(effects);
    }

    fn act(&mut self) {
        let mut effects = Vec::new();
        self.node.act(self.moment(), &mut effects);
        self.perform(effects);
    }

    fn perform(&mut self, effects: Vec<Effect>) {
        for effect in effects {
            match effect {
                Effect::Reply { response, .. } => self.replies.push(response),
                Effect::Publish { message, .. } => {
                    self.record(&message);
                    let answers = self.autopilot.receive(&message, self.now);
                    self.post(answers);
                }
                Effect::Call { .. } => panic!("a skill manager calls no other service"),
                Effect::Refused { what, why } => self.refused.push(format!("{}: {why}", what.key())),
            }
        }
    }

    fn record(&mut self, message: &Message) {
        let line = match message {
            Message::VehicleCommand(it) => format!("command {}", command_name(it.command.as_ref().unwrap())),
            Message::SkillEvent(it) => {
                self.events.push(it.clone());
                let state = it.state().as_str_name().trim_start_matches("SKILL_STATE_").to_lowercase();
                let what = if it.state() == SkillState::Ended { outcome_name(it.outcome()) } else { &state };
                let reason = if it.reason.is_empty() { String::new() } else { format!(": {}", it.reason) };
                format!("{} {} {what}{reason}", kind_name(it.kind()), it.skill_id)
            }
            Message::SkillFeedback(it) => return self.feedback.push(*it),
            Message::TaskOrder(it) => return self.task_orders.push(it.clone()),
            Message::SkillControl(it) => return self.other.clone_from(&it.flown_by_other),
            Message::TrajectorySetpoint(_) => return self.setpoints.push(self.now),
            _ => return,
        };
        self.story.push_str(&line);
        self.story.push('\n');
    }
}

fn command_name(command: &Command) -> String {
    match command {
        Command::Arm(_) => "arm".into(),
        Command::Disarm(_) => "disarm".into(),
        Command::Takeoff(it) => format!("takeoff {:.1}", it.altitude_m),
        Command::Land(_) => "land".into(),
        Command::Release(_) => "release".into(),
        Command::SetMode(it) => it.mode().as_str_name().trim_start_matches("FLIGHT_MODE_").to_lowercase(),
    }
}
