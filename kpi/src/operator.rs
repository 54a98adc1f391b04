//! `kittiwake-kpi --operator`: what the gateway does for those who look on.
//!
//! A vehicle flies its mission at real time while somebody in its namespace publishes decisions that
//! carry the moment at which they were published. Event streams of the gateway are read by one client,
//! then by a thousand, in this process: the figures hold for the machine with all of them on it.

#![expect(clippy::disallowed_methods, reason = "what it measures is on the wall clock, and the clients are polled")]

use std::fmt::Write as _;
use std::net::{SocketAddr, TcpListener};
use std::path::Path;
use std::time::{Duration, Instant};

use control_tower::policy::Policy;
use domain::time::{Now, Time};
use gateway::access::{Role, entry};
use kittiwake::run::run_file::{self, RunFolder};
use kittiwake::service::Service;
use kittiwake::settings::Settings;
use kittiwake_proto::topics::Topic;
use kittiwake_proto::v1::DecisionRecord;
use node::{Effect, Event, Node};
use serde::Serialize;

use crate::audience::{Audience, Count, MARK};
use crate::load::{self, Watch};
use crate::statistics::Statistics;
use crate::system::{self, System};

const CLIENTS: u64 = 1000;
/// Clients with the same token: each may make a limited number of requests at once.
const CLIENTS_OF_A_TOKEN: u64 = 80;
/// Events a second while latencies are measured, and for how long.
const RATE_ALONE_HZ: u32 = 50;
const RATE_CROWD_HZ: u32 = 5;
const MEASURE: Duration = Duration::from_secs(12);
/// Events a second that are tried with all clients, each for some seconds.
const RATES_HZ: [u32; 6] = [10, 20, 40, 80, 160, 320];
const TRY: Duration = Duration::from_secs(5);
/// An event that has not arrived this long after the last one was published is late.
const LATE: Duration = Duration::from_secs(1);
/// Whatever is waited for comes within this.
const LIMIT: Duration = Duration::from_secs(30);

/// What was measured.
#[derive(Debug, Serialize)]
pub(crate) struct Operator {
    machine: String,
    load_before: f64,
    clients: u64,
    /// From publication in the vehicle to arrival over HTTP, in milliseconds, for one client and for all.
    latency_alone_ms: Statistics,
    latency_crowd_ms: Statistics,
    /// Of the gateway, in megabytes, and its share of one core with a handful of events a second.
    memory_alone_mb: f64,
    memory_crowd_mb: f64,
    cpu_alone_percent: f64,
    cpu_crowd_percent: f64,
    tries: Vec<Try>,
}

/// All clients at one rate.
#[derive(Debug, Serialize)]
struct Try {
    published_hz: u32,
    /// Events that should have arrived, and that did, in time.
    wanted: u64,
    arrived: u64,
    /// Clients that had to start over.
    resyncs: u64,
    latency_ms: Option<Statistics>,
}

/// Flies with the executable `program`, and looks on.
pub(crate) fn measure(program: &Path, config: &Path, vehicle: &str) -> Result<Operator, String> {
    let load_before = load::load_average();
    gateway::sockets::make_room(2 * CLIENTS).map_err(|it| it.to_string())?;
    let badges = Badges::create().map_err(|it| it.to_string())?;
    let address = free_address().map_err(|it| it.to_string())?;
    let mut settings = Settings::of_file(config);
    settings.permissions = Some(Policy::Grant);
    settings.http = Some(address);
    settings.access = Some(badges.folder.0.clone());
    let system = System::start(program, &settings, vehicle, &system::processes(None))?;
    let audience = Audience::new()?;
    let sight = Sight { system: &system, audience: &audience, address, vehicle };
    crate::say("operator: one client");
    sight.first(&badges.tokens[0])?;
    let (alone, latency_alone) = sight.watch(RATE_ALONE_HZ, MEASURE)?;
    crate::say(&format!("operator: {CLIENTS} clients"));
    for number in 1..CLIENTS {
        let token = &badges.tokens[(number / CLIENTS_OF_A_TOKEN) as usize];
        audience.join(address, vehicle, token);
    }
    sight.until("everybody to be served", |it| it.served == CLIENTS)?;
    let (crowd, latency_crowd) = sight.watch(RATE_CROWD_HZ, MEASURE)?;
    let mut tries = Vec::new();
    for published_hz in RATES_HZ {
        crate::say(&format!("operator: {published_hz} events a second to each"));
        let it = sight.attempt(published_hz)?;
        let held = it.is_held();
        tries.push(it);
        if !held {
            break;
        }
    }
    Ok(Operator {
        machine: load::machine(),
        load_before,
        clients: CLIENTS,
        latency_alone_ms: latency_alone,
        latency_crowd_ms: latency_crowd,
        memory_alone_mb: alone.rss_mb,
        memory_crowd_mb: crowd.rss_mb,
        cpu_alone_percent: alone.cpu_percent,
        cpu_crowd_percent: crowd.cpu_percent,
        tries,
    })
}

/// The figures for people.
pub(crate) fn text(it: &Operator) -> String {
    let latency = |it: &Statistics| {
        format!("median {:.2} ms, p99 {:.2} ms, max {:.2} ms of {} events", it.p50, it.p99, it.max, it.count)
    };
    let mut text = format!(
        "{}; load average {:.1} before. Vehicle, gateway and clients on this machine, real time.\n\n\
         event, vehicle to client over server-sent events\n  \
         1 client        {}\n  {} clients    {}\n\n\
         gateway\n  \
         1 client        {:.0} MB, {:.0} % of a core\n  {} clients    {:.0} MB, {:.0} % of a core\n\n\
         events to {} clients, besides two statuses a second to each\n",
        it.machine,
        it.load_before,
        latency(&it.latency_alone_ms),
        it.clients,
        latency(&it.latency_crowd_ms),
        it.memory_alone_mb,
        it.cpu_alone_percent,
        it.clients,
        it.memory_crowd_mb,
        it.cpu_crowd_percent,
        it.clients,
    );
    for tried in &it.tries {
        let p99 = tried.latency_ms.as_ref().map_or(f64::NAN, |it| it.p99);
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "  {:7} a second  {}: {} of {} in time, {} resyncs, p99 {p99:.0} ms",
            u64::from(tried.published_hz) * it.clients,
            if tried.is_held() { "held" } else { "not held" },
            tried.arrived,
            tried.wanted,
            tried.resyncs,
        );
    }
    text.trim_end().to_owned()
}

impl Try {
    fn is_held(&self) -> bool {
        self.arrived == self.wanted && self.resyncs == 0
    }
}

struct Sight<'a> {
    system: &'a System,
    audience: &'a Audience,
    address: SocketAddr,
    vehicle: &'a str,
}

impl Sight<'_> {
    /// The first client is let in as soon as the gateway knows the vehicle.
    fn first(&self, token: &str) -> Result<(), String> {
        let until = Instant::now() + LIMIT;
        while self.audience.count().served == 0 {
            if until <= Instant::now() {
                return Err("the gateway serves no events".into());
            }
            let before = self.audience.count().gone;
            self.audience.join(self.address, self.vehicle, token);
            while self.audience.count().served == 0 && self.audience.count().gone == before && Instant::now() < until {
                std::thread::sleep(Duration::from_millis(100));
            }
        }
        Ok(())
    }

    /// Publishes for a while; what the gateway used meanwhile, and how late events came.
    fn watch(&self, rate_hz: u32, over: Duration) -> Result<(load::Load, Statistics), String> {
        // A client that has just come received what had happened before.
        self.audience.take_latencies_ms();
        let watch = Watch::begin(self.system);
        self.publish(rate_hz, over);
        let load = *watch.end().get(Service::Gateway.name()).ok_or("the gateway has ended")?;
        let latency = Statistics::of(&self.audience.take_latencies_ms()).ok_or("no event has arrived")?;
        Ok((load, latency))
    }

    /// Publishes at a rate; whether everything arrived.
    fn attempt(&self, published_hz: u32) -> Result<Try, String> {
        let before = self.audience.count();
        let published = self.publish(published_hz, TRY);
        let after = self.audience.count();
        if before.gone < after.gone {
            return Err(format!("{} streams have ended", after.gone - before.gone));
        }
        Ok(Try {
            published_hz,
            wanted: published * CLIENTS,
            arrived: after.events - before.events,
            resyncs: after.resyncs - before.resyncs,
            latency_ms: Statistics::of(&self.audience.take_latencies_ms()),
        })
    }

    /// Has events published, and waits until the last of them should have arrived; how many there were.
    fn publish(&self, rate_hz: u32, over: Duration) -> u64 {
        let count = u64::from(rate_hz) * over.as_secs();
        let period = Duration::from_secs(1) / rate_hz;
        // A moment to get onto the bus.
        let first = Time::after(Duration::from_millis(500));
        let stop = self.system.join(Speaker { next: first, period, left: count, sequence: 0 });
        std::thread::sleep(first.since_start() + over + LATE);
        stop.stop();
        count
    }

    fn until(&self, what: &str, reached: impl Fn(Count) -> bool) -> Result<(), String> {
        let until = Instant::now() + LIMIT;
        while !reached(self.audience.count()) {
            if until <= Instant::now() {
                return Err(format!("waited {LIMIT:?} in vain for {what}: {:?}", self.audience.count()));
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        Ok(())
    }
}

/// Publishes decisions that say when they were published.
struct Speaker {
    next: Time,
    period: Duration,
    left: u64,
    sequence: u64,
}

impl Node for Speaker {
    fn name(&self) -> &'static str {
        "operator-kpi"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[]
    }

    fn on(&mut self, _: Now, _: Event, _: &mut Vec<Effect>) {}

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        while 0 < self.left && self.next <= now.time {
            self.sequence += 1;
            effects.push(Effect::publish(DecisionRecord {
                at_s: now.time.as_secs_f64(),
                topic: "kpi".into(),
                text: format!("{MARK}{}", bus::monotonic_ns()),
                sequence: self.sequence,
                ..DecisionRecord::default()
            }));
            (self.next, self.left) = (self.next + self.period, self.left - 1);
        }
    }

    fn deadline(&self) -> Option<Time> {
        (0 < self.left).then_some(self.next)
    }
}

/// Tokens for all clients, in a folder that is gone with the value.
struct Badges {
    folder: RunFolder,
    tokens: Vec<String>,
}

impl Badges {
    fn create() -> std::io::Result<Badges> {
        let folder = RunFolder::create("kpi")?;
        let count = CLIENTS / CLIENTS_OF_A_TOKEN + 1;
        let tokens: std::io::Result<Vec<_>> = (0..count).map(|_| kittiwake::setup::access::random_hex(32)).collect();
        let badges = Badges { folder, tokens: tokens? };
        let name = |number: usize| format!("client-{number}");
        let entries = badges.tokens.iter().enumerate().map(|(n, token)| entry(&name(n), &[Role::Observer], token));
        run_file::write_private(&badges.folder.0.join("tokens.toml"), entries.collect::<String>().as_bytes())?;
        Ok(badges)
    }
}

/// A port that nobody has at the moment.
fn free_address() -> std::io::Result<SocketAddr> {
    TcpListener::bind("127.0.0.1:0")?.local_addr()
}
