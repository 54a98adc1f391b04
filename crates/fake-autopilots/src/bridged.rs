//! A vehicle backend of two: an autopilot, and the bridge to it. To the bus they are one node.

use std::time::Duration;

use domain::declared_skill::DeclaredSkills;
use domain::time::{Now, Time};
use kittiwake_proto::topics::{Request, Response, Service, Topic};
use kittiwake_proto::v1;
use mavlink_bridge::MavlinkBridge;
use mavlink_bridge::config::Config;
use mavlink_bridge::link::Link;
use mavlink_bridge::signing::{Key, SignedLink, Signing};
use node::{Effect, Event, Node};

use crate::FakeAutopilot;
use crate::wire::Wire;

/// Kills the bridge; the argument is after how many seconds it is started again.
pub const BRIDGE_DIES: &str = "bridge_dies";

/// An autopilot with its bridge.
#[derive(Debug)]
pub struct Bridged {
    autopilot: FakeAutopilot,
    config: Config,
    wire: Wire,
    bridge: MavlinkBridge<Box<dyn Link>>,
    skills: DeclaredSkills,
    key: Option<Key>,
    /// The bridge is dead until then.
    dead_until: Option<Time>,
}

impl Bridged {
    /// The bridge to `autopilot` over its `wire`.
    pub fn new(autopilot: FakeAutopilot, config: &Config, wire: Wire) -> Bridged {
        let bridge = MavlinkBridge::new(config, signed(&wire, None));
        let (config, skills) = (config.clone(), DeclaredSkills::default());
        Bridged { autopilot, config, wire, bridge, skills, key: None, dead_until: None }
    }

    /// The same, with a bridge that signs what it says and believes nothing that is not signed.
    pub fn signing_with(self, key: Key) -> Bridged {
        let bridge = MavlinkBridge::new(&self.config, signed(&self.wire, Some(&key)));
        Bridged { bridge, key: Some(key), ..self }
    }

    /// The same, with declared skills, of which the autopilot carries out those with a command.
    pub fn with_skills(self, skills: &DeclaredSkills) -> Bridged {
        Bridged { bridge: self.bridge.with_skills(skills), skills: skills.clone(), ..self }
    }

    /// The same, with a ground station behind `link`; a bridge that was started again has none.
    pub fn seen_from_the_ground(mut self, link: impl Link + 'static) -> Bridged {
        self.bridge = self.bridge.seen_from_the_ground(link);
        self
    }

    fn dies(&mut self, request: &v1::FaultRequest, now: Time) {
        let seconds = request.args.first().and_then(|it| it.parse::<f64>().ok()).unwrap_or_default();
        self.dead_until = Some(now + Duration::from_secs_f64(seconds));
    }
}

/// Signatures count from a clock that stands still: each frame is one unit later than the one before.
fn signed(wire: &Wire, key: Option<&Key>) -> Box<dyn Link> {
    match key {
        Some(key) => Box::new(SignedLink::new(wire.clone(), Signing::new(key.clone(), 1), || 0)),
        None => Box::new(wire.clone()),
    }
}

impl Node for Bridged {
    fn name(&self) -> &'static str {
        "mavlink-bridge"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        self.bridge.subscriptions()
    }

    fn serves(&self) -> &'static [Service] {
        &[Service::Fault]
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        match event {
            Event::Request { request: Request::Fault(ref request), token, .. } if request.name == BRIDGE_DIES => {
                self.dies(request, now.time);
                let reply = v1::FaultReply { accepted: true, detail: "the bridge is dead".into(), known: Vec::new() };
                effects.push(Effect::Reply { token, response: Response::Fault(reply) });
            }
            Event::Request { .. } => self.autopilot.on(now, event, effects),
            _ if self.dead_until.is_none() => self.bridge.on(now, event, effects),
            _ => {}
        }
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.autopilot.act(now, effects);
        if self.dead_until.is_some_and(|until| until <= now.time) {
            self.dead_until = None;
            let bridge = MavlinkBridge::new(&self.config, signed(&self.wire, self.key.as_ref()));
            self.bridge = bridge.with_skills(&self.skills);
        }
        match self.dead_until {
            None => self.bridge.act(now, effects),
            // Nobody listens to what arrives.
            Some(_) => self.wire.drop_arrived(now.time),
        }
    }

    fn deadline(&self) -> Option<Time> {
        let bridge = self.dead_until.or_else(|| self.bridge.deadline());
        [self.autopilot.deadline(), bridge].into_iter().flatten().min()
    }
}
