//! `kittiwake ros-bridge`: a vehicle of a gateway as a ROS 2 node, over a router of ROS's.

#![expect(clippy::disallowed_methods, reason = "the bridge runs on the wall clock, which its core is given")]

use std::convert::Infallible;
use std::time::{Duration, Instant, SystemTime};

use bus::{BusError, Foreign, ForeignMail, Nudge};
use clap::Args;
use reqwest::Method;
use ros_bridge::{Bridge, Effect, Names, Order, Orders, Service, Stamp, Topic};
use serde_json::json;

use crate::operate::args::GatewayArgs;
use crate::operate::failure::Failure;
use crate::operate::gateway::Gateway;
use crate::outcome::Outcome;
use crate::output;

/// How long a router of ROS's is waited for.
const ROUTER_LIMIT: Duration = Duration::from_secs(10);

const EXAMPLES: &str = "\
ROS needs `RMW_IMPLEMENTATION=rmw_zenoh_cpp`, and a router: `ros2 run rmw_zenoh_cpp rmw_zenohd`, or this bridge with --listen.
An order takes command of the vehicle if nobody has it. docs/ros.md lists topics, services and the action.

Examples:
    kittiwake ros-bridge                                        the system that runs here, to ROS on this machine
    kittiwake ros-bridge --listen tcp/127.0.0.1:7447            the same where no rmw_zenohd runs
    kittiwake ros-bridge --url https://ground:8443 --token-file token --vehicle uav1 --domain 42";

/// For `kittiwake ros-bridge`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct RosBridgeArgs {
    #[command(flatten)]
    pub gateway: GatewayArgs,
    /// The router of ROS to connect to
    #[arg(long, value_name = "LOCATOR", default_value = "tcp/127.0.0.1:7447", conflicts_with = "listen")]
    pub router: String,
    /// Be the router of ROS, and listen here
    #[arg(long, value_name = "LOCATOR")]
    pub listen: Option<String>,
    /// ROS's domain
    #[arg(long, env = "ROS_DOMAIN_ID", default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..=232))]
    pub domain: u8,
    /// How often the gateway is asked for the vehicle's state, per second; it knows a new one 20 times a second
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u8).range(1..=20))]
    pub rate_hz: u8,
}

/// Runs until it is ended, or cannot begin.
pub fn ros_bridge(args: &RosBridgeArgs) -> Outcome {
    match run(args) {
        Ok(never) => match never {},
        Err(failure) => {
            output::error_line(failure.why);
            failure.outcome
        }
    }
}

fn run(args: &RosBridgeArgs) -> Result<Infallible, Failure> {
    let gateway = Gateway::find(&args.gateway)?;
    let vehicle = gateway.vehicle()?;
    // Another one may come: orders go to the vehicle that is shown.
    let gateway = gateway.of_vehicle(&vehicle);
    let nudge = Nudge::default();
    let waiter = nudge.waiter();
    let mut ros = Ros::open(args, &vehicle, &nudge).map_err(|it| Failure::unreachable(without_router(&it, args)))?;
    output::error_line(format_args!("{vehicle} is in ROS's domain {} over {}", args.domain, ros.place));
    let mut bridge = Bridge::new(&vehicle);
    let mut orders = OverGateway(&gateway);
    let period = Duration::from_secs(1) / u32::from(args.rate_hz);
    let (mut next, mut rounds) = (Instant::now(), 0_u64);
    loop {
        for (service, number, payload) in ros.requests() {
            let effects = bridge.on_request(service, number, &payload, now(), &mut orders);
            ros.perform(effects);
        }
        if next <= Instant::now() {
            next = (next + period).max(Instant::now());
            let effects = match gateway.state(&vehicle) {
                Ok(document) => bridge.on_document(&document, &mut orders),
                Err(failure) => vec![bridge.on_silence(&failure.why, now())],
            };
            ros.perform(effects);
            // Decisions once a second: the gateway keeps them.
            if rounds.is_multiple_of(args.rate_hz.into())
                && let Ok(decisions) = gateway.decisions(&vehicle, bridge.decided())
            {
                ros.perform(bridge.on_decisions(&decisions));
            }
            rounds += 1;
        }
        // Ends at a request or at the next round.
        let _ = waiter.recv_timeout(next.saturating_duration_since(Instant::now()));
    }
}

fn without_router(error: &BusError, args: &RosBridgeArgs) -> String {
    match args.listen {
        Some(_) => error.to_string(),
        None => format!(
            "{error}\nstart ROS's router with `ros2 run rmw_zenoh_cpp rmw_zenohd`, or let the bridge be the router: --listen {}",
            args.router
        ),
    }
}

fn now() -> Stamp {
    Stamp::of(SystemTime::now())
}

/// The session with ROS.
struct Ros {
    session: Foreign,
    names: Names,
    place: String,
    /// How many samples each topic had.
    sent: [i64; Topic::ALL.len()],
}

impl Ros {
    fn open(args: &RosBridgeArgs, vehicle: &str, nudge: &Nudge) -> Result<Ros, BusError> {
        let mut session = match &args.listen {
            Some(endpoint) => Foreign::listen(endpoint, nudge)?,
            None => Foreign::connect(&args.router, ROUTER_LIMIT, nudge)?,
        };
        let place = args.listen.as_ref().map_or_else(|| args.router.clone(), |_| session.locators().join(", "));
        let names = Names::new(args.domain, vehicle, &session.id());
        for service in Service::ALL {
            session.serve(&names.of_service(service))?;
        }
        for token in names.tokens() {
            session.announce(&token)?;
        }
        Ok(Ros { session, names, place, sent: [0; Topic::ALL.len()] })
    }

    fn requests(&self) -> Vec<(Service, u64, Vec<u8>)> {
        let request = |mail| match mail {
            ForeignMail::Request { number, key, payload } => Some((self.names.service(&key)?, number, payload)),
            ForeignMail::Sample { .. } | ForeignMail::Token { .. } => None,
        };
        self.session.take().into_iter().filter_map(request).collect()
    }

    fn perform(&mut self, effects: impl IntoIterator<Item = Effect>) {
        for effect in effects {
            match effect {
                Effect::Publish(topic, payload) => {
                    let sent = &mut self.sent[topic as usize];
                    *sent += 1;
                    let attachment = self.names.attachment(topic, *sent, now());
                    self.session.put(&self.names.of_topic(topic), payload, Some(attachment));
                }
                Effect::Reply(number, payload) => self.session.reply(number, payload),
            }
        }
    }
}

/// Orders under the roles of the bridge's token.
struct OverGateway<'a>(&'a Gateway);

impl Orders for OverGateway<'_> {
    fn order(&mut self, order: Order<'_>) -> Result<String, String> {
        let (method, path, body) = match order {
            Order::Start => (Method::POST, "start", None),
            Order::Pause => (Method::POST, "pause", None),
            Order::Resume => (Method::POST, "resume", None),
            Order::Return => (Method::POST, "return", None),
            Order::Abort => (Method::POST, "abort", None),
            Order::Upload(text) => (Method::PUT, "mission", Some(json!({ "text": text }))),
        };
        let done = self.0.order(method, &[path], body).map_err(|failure| failure.why)?;
        Ok(done["text"].as_str().unwrap_or_default().to_owned())
    }
}
