//! The bridge: what the gateway says becomes messages, what ROS asks becomes orders.

use std::path::PathBuf;

use domain::file::Source;
use domain::mission::Mission;
use kittiwake_proto::v1;

use crate::cdr::{Reader, Writer};
use crate::goal::{End, Goal, GoalId};
use crate::messages::{Frames, Level, diagnose, diagnostics, log};
use crate::names::{Service, Topic};
use crate::stamp::Stamp;

/// Goals whose result is kept for clients that ask late.
const GOALS: usize = 16;

/// An order to the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order<'a> {
    /// Start a mission that waits for it.
    Start,
    /// Hold until resumed.
    Pause,
    /// Go on.
    Resume,
    /// Fly home and land.
    Return,
    /// Land here.
    Abort,
    /// Fly the mission with this text.
    Upload(&'a str),
}

/// The caller, which carries orders to the gateway.
pub trait Orders {
    /// Gives an order, and says what happened.
    ///
    /// # Errors
    /// Why it was refused, or not answered.
    fn order(&mut self, order: Order<'_>) -> Result<String, String>;
}

/// A message or a reply for ROS.
#[derive(Debug, PartialEq, Eq)]
pub enum Effect {
    /// A message on a topic.
    Publish(Topic, Vec<u8>),
    /// The reply to the request of this number.
    Reply(u64, Vec<u8>),
}

/// The state of the node: what it has published last, and its goals.
#[derive(Debug)]
pub struct Bridge {
    vehicle: String,
    frames: Frames,
    /// The time of the position that was published last, by the vehicle's clock.
    published: Option<u64>,
    /// The newest decision that was published.
    decided: u64,
    /// Of the newest document.
    mission_time_s: f64,
    report: Option<v1::MissionReport>,
    /// Oldest first; at most the last one has not ended.
    goals: Vec<Goal>,
}

impl Bridge {
    /// Of this vehicle, of which nothing is known yet.
    pub fn new(vehicle: &str) -> Bridge {
        let (vehicle, frames) = (vehicle.to_owned(), Frames::of(vehicle));
        Bridge { vehicle, frames, published: None, decided: 0, mission_time_s: 0.0, report: None, goals: Vec::new() }
    }

    /// Publishes what the gateway says about the vehicle. While the gateway does not hear it, only that is published. A goal's mission that
    /// waits for its start is started.
    pub fn on_document(&mut self, document: &v1::Vehicle, orders: &mut impl Orders) -> Vec<Effect> {
        let stamp = Stamp::parse(&document.utc);
        let mut effects = vec![self.diagnosed(stamp, diagnose(document))];
        if document.contact.is_none_or(|it| it.lost) {
            return effects;
        }
        let mission_time_s = document.mission_time_s.unwrap_or(self.mission_time_s);
        if mission_time_s < self.mission_time_s {
            // The manager has restarted, and counts its decisions from 1.
            self.decided = 0;
        }
        self.mission_time_s = mission_time_s;
        self.report.clone_from(&document.report);
        effects.push(Effect::Publish(Topic::Plan, self.frames.plan(stamp, document)));
        if let Some(aircraft) = &document.aircraft {
            effects.extend(self.aircraft(stamp, aircraft));
        }
        effects.extend(self.follow(document, orders));
        effects
    }

    /// The number of the newest decision that was published.
    pub fn decided(&self) -> u64 {
        self.decided
    }

    /// Publishes decisions that were not published before, oldest first.
    pub fn on_decisions(&mut self, decisions: &[v1::DecisionRecord]) -> Vec<Effect> {
        let new = decisions.iter().filter(|it| self.decided < it.sequence).collect::<Vec<_>>();
        self.decided = new.iter().map(|it| it.sequence).max().unwrap_or(self.decided);
        let message =
            |it: &v1::DecisionRecord| log(Stamp::of_millis(it.utc_ms), !it.flag.is_empty(), &it.topic, &it.text);
        new.into_iter().map(|it| Effect::Publish(Topic::Decisions, message(it))).collect()
    }

    /// Tells that the gateway does not answer.
    pub fn on_silence(&self, why: &str, now: Stamp) -> Effect {
        self.diagnosed(now, vec![("gateway".to_owned(), Level::Stale, why.to_owned())])
    }

    /// Answers a request, or keeps it until there is an answer.
    pub fn on_request(
        &mut self,
        service: Service,
        number: u64,
        payload: &[u8],
        now: Stamp,
        orders: &mut impl Orders,
    ) -> Vec<Effect> {
        let order = match service {
            Service::Start => Order::Start,
            Service::Pause => Order::Pause,
            Service::Resume => Order::Resume,
            Service::Return => Order::Return,
            Service::Abort => Order::Abort,
            Service::SendGoal => return self.begin(number, payload, now, orders),
            Service::GetResult => return self.result(number, payload),
            Service::CancelGoal => return self.cancel(number, payload, now, orders),
        };
        let (done, text) = match orders.order(order) {
            Ok(text) => (true, text),
            Err(why) => (false, why),
        };
        vec![Effect::Reply(number, Writer::default().bool(done).string(&text).end())]
    }

    /// Of one sample, each message once.
    fn aircraft(&mut self, stamp: Stamp, aircraft: &v1::vehicle::Aircraft) -> Vec<Effect> {
        let sampled = aircraft.local_position.as_ref().map(|it| it.timestamp_us);
        if self.published == sampled {
            return Vec::new();
        }
        self.published = sampled;
        let messages = [
            (Topic::Fix, self.frames.fix(stamp, aircraft)),
            (Topic::Odometry, self.frames.odometry(stamp, aircraft)),
            (Topic::Battery, self.frames.battery(stamp, aircraft)),
        ];
        messages.into_iter().filter_map(|(topic, it)| Some(Effect::Publish(topic, it?))).collect()
    }

    fn follow(&mut self, document: &v1::Vehicle, orders: &mut impl Orders) -> Vec<Effect> {
        let Some(goal) = self.goals.last_mut() else { return Vec::new() };
        let mut has_changed = goal.follow(document);
        if goal.awaits_start(document)
            && let Err(why) = orders.order(Order::Start)
        {
            goal.abort(why);
            has_changed = true;
        }
        let feedback = goal.feedback(document).map(|it| Effect::Publish(Topic::Feedback, it));
        feedback.into_iter().chain(if has_changed { self.settle() } else { Vec::new() }).collect()
    }

    /// Accepts a goal if the gateway takes its mission. The mission that was flown before is replaced, and so is its goal.
    fn begin(&mut self, number: u64, payload: &[u8], now: Stamp, orders: &mut impl Orders) -> Vec<Effect> {
        let reply = |accepted| Effect::Reply(number, Writer::default().bool(accepted).stamp(now).end());
        let uploaded = goal_and_mission(payload).and_then(|(id, text)| {
            if self.goals.iter().any(|it| it.id == id) {
                return Err("a goal with this id was accepted before".to_owned());
            }
            let source = Source { path: PathBuf::from("the goal's mission"), text: text.to_owned() };
            let mission = Mission::read(&source).map_err(|it| it.to_string())?;
            orders.order(Order::Upload(text)).map(|_| (id, mission.name))
        });
        match uploaded {
            Ok((id, mission)) => {
                if let Some(before) = self.goals.last_mut() {
                    before.abort("another mission was uploaded".to_owned());
                }
                self.goals.push(Goal::new(id, mission, now, self.report.clone()));
                let mut effects = vec![reply(true)];
                effects.extend(self.settle());
                effects
            }
            Err(why) => vec![reply(false), explained(now, &format!("refused: {why}"))],
        }
    }

    fn result(&mut self, number: u64, payload: &[u8]) -> Vec<Effect> {
        let id = Reader::new(payload).and_then(|mut it| it.array());
        match self.goals.iter_mut().find(|it| Some(it.id) == id) {
            None => vec![Effect::Reply(number, End::unknown().response())],
            Some(goal) => {
                goal.waiting.push(number);
                answers(goal)
            }
        }
    }

    /// One goal, or with an id of zeros the one that is flown.
    fn cancel(&mut self, number: u64, payload: &[u8], now: Stamp, orders: &mut impl Orders) -> Vec<Effect> {
        const NONE: u8 = 0;
        const REJECTED: u8 = 1;
        const UNKNOWN: u8 = 2;
        const TERMINATED: u8 = 3;
        let id: GoalId = Reader::new(payload).and_then(|mut it| it.array()).unwrap_or_default();
        let goal = self.goals.iter_mut().rev().find(|it| id == [0; 16] || it.id == id);
        let mut effects = Vec::new();
        let (code, canceling) = match goal {
            None => (UNKNOWN, None),
            Some(goal) if goal.has_ended() => (TERMINATED, None),
            Some(goal) => match orders.order(Order::Return) {
                Ok(_) => {
                    goal.is_canceled = true;
                    (NONE, Some((goal.id, goal.accepted)))
                }
                Err(why) => {
                    effects.push(explained(now, &format!("not canceled: {why}")));
                    (REJECTED, None)
                }
            },
        };
        let info = |writer: Writer, (id, accepted): (GoalId, Stamp)| writer.bytes(&id).stamp(accepted);
        effects.push(Effect::Reply(number, Writer::default().u8(code).each(canceling, info).end()));
        if canceling.is_some() {
            effects.extend(self.settle());
        }
        effects
    }

    /// After a change of a goal: the new list of them, and answers to the clients that wait for one that has ended.
    fn settle(&mut self) -> Vec<Effect> {
        let surplus = self.goals.len().saturating_sub(GOALS);
        self.goals.drain(..surplus);
        let status = |writer: Writer, it: &Goal| writer.bytes(&it.id).stamp(it.accepted).i8(it.status());
        let list = Writer::default().each(&self.goals, status).end();
        let mut effects = vec![Effect::Publish(Topic::Status, list)];
        effects.extend(self.goals.iter_mut().flat_map(answers));
        effects
    }

    fn diagnosed(&self, stamp: Stamp, all: Vec<(String, Level, String)>) -> Effect {
        Effect::Publish(Topic::Diagnostics, diagnostics(stamp, &self.vehicle, all))
    }
}

fn goal_and_mission(payload: &[u8]) -> Result<(GoalId, &str), String> {
    let mut reader = Reader::new(payload).ok_or("the request is not little-endian CDR")?;
    let id = reader.array().ok_or("the request ends within its id")?;
    let text = reader.string().ok_or("the request ends within its mission, or the mission is not UTF-8")?;
    Ok((id, text))
}

/// The reason for a refusal: the reply to a client of an action has no field for it.
fn explained(now: Stamp, text: &str) -> Effect {
    Effect::Publish(Topic::Decisions, log(now, true, "goal", text))
}

/// To the clients that wait for the result of a goal that has ended.
fn answers(goal: &mut Goal) -> Vec<Effect> {
    let Some(result) = goal.result() else { return Vec::new() };
    goal.waiting.drain(..).map(|number| Effect::Reply(number, result.clone())).collect()
}
