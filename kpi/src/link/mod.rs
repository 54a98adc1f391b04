//! `kittiwake-kpi --link`: what a narrow link does to orders and telemetry, and for how long a cut is felt.
//!
//! Figures depend on the machine and its load, so they are measured here and no test asserts them.

#![expect(clippy::disallowed_methods, reason = "what it measures is on the wall clock, over a link with faults")]

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use bus::{Link, Process, Scope, Stop, Tap, Tapped, monotonic_ns};
use domain::time::{Now, Time};
use faulty_link::{CLEAR, Direction, Shape};
use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1::GroundContact;
use node::{Effect, Event, Node, VehicleId};
use serde::Serialize;

use crate::load;
use crate::statistics::Statistics;

mod rig;

use rig::Rig;

/// A modem's link: 64 kbit/s and a round trip of 200 ms, without and with losses.
const NARROW: Shape = Shape { bits_per_s: Some(64_000.0), delay: Duration::from_millis(100), loss: 0.0 };
const LOSSY: Shape = Shape { loss: 0.02, ..NARROW };
/// For each shape.
const MEASURE: Duration = Duration::from_secs(30);
/// Between two messages from the ground: in step with no period of the telemetry.
const PERIOD: Duration = Duration::from_millis(117);
/// Long enough for the flag `link_lost`.
const CUT: Duration = Duration::from_secs(15);
/// Whatever is waited for comes within this.
const LIMIT: Duration = Duration::from_secs(60);

/// What was measured.
#[derive(Debug, Serialize)]
pub(crate) struct Measured {
    machine: String,
    load_before: f64,
    shapes: Vec<Figures>,
    /// From the cut to the flag on board, and from the end of the cut to fresh data on the ground, in seconds.
    link_lost_after_s: f64,
    fresh_after_s: f64,
}

/// Over a link of one shape.
#[derive(Debug, Serialize)]
struct Figures {
    name: &'static str,
    /// Bytes a second with encryption.
    down_bytes_s: f64,
    up_bytes_s: f64,
    /// From publication to arrival, in milliseconds: of what has an order's class, and of the introspection.
    order_ms: Option<Statistics>,
    introspection_ms: Option<Statistics>,
}

/// Measures with the executable `program`.
pub(crate) fn measure(program: &Path, config: &Path, vehicle: &str) -> Result<Measured, String> {
    let load_before = load::load_average();
    let rig = Rig::start(program, config, vehicle, 1)?;
    let (ground_tap, ground) = tap(&rig.ground, Scope::Fleet, &[Topic::Introspection])?;
    let scope = Scope::Vehicle(vehicle.to_owned());
    let (board_tap, board) = tap(&rig.on_board, scope, &[Topic::GroundContact, Topic::Introspection])?;
    let stop = Stop::new();
    let speaker = speak(&rig.ground, vehicle, &stop);
    wait(&ground, |_| Some(()))?;
    wait(&board, |it| matches!(it.message, Message::GroundContact(_)).then_some(()))?;
    let mut shapes = Vec::new();
    for (name, shape) in [("clear", CLEAR), ("narrow", NARROW), ("narrow and lossy", LOSSY)] {
        crate::say(&format!("link: {name}"));
        rig.proxy.shape(shape);
        shapes.push(figures(name, &rig, &ground, &board));
    }
    rig.proxy.shape(CLEAR);
    crate::say("link: a cut");
    let cut = monotonic_ns();
    rig.proxy.cut(&[Direction::Down, Direction::Up]);
    let lost = wait(&board, |it| match &it.message {
        Message::Introspection(list) if list.flags.iter().any(|it| it.name == "link_lost") => Some(it.received_ns),
        _ => None,
    })?;
    let left = CUT.saturating_sub(Duration::from_nanos(monotonic_ns().saturating_sub(cut)));
    collect(&board, left);
    let healed = monotonic_ns();
    rig.proxy.heal();
    let fresh = wait(&ground, |it| (healed < it.published_ns).then_some(it.received_ns))?;
    stop.stop();
    let _ = speaker.join();
    drop((ground_tap, board_tap));
    let seconds = |from: u64, to: u64| to.saturating_sub(from) as f64 / 1e9;
    let (link_lost_after_s, fresh_after_s) = (seconds(cut, lost), seconds(healed, fresh));
    Ok(Measured { machine: load::machine(), load_before, shapes, link_lost_after_s, fresh_after_s })
}

fn figures(name: &'static str, rig: &Rig, ground: &Receiver<Tapped>, board: &Receiver<Tapped>) -> Figures {
    // What was under way under another shape.
    collect(board, Duration::from_secs(1));
    while ground.try_recv().is_ok() {}
    let (start, down, up) = (Instant::now(), rig.proxy.bytes(Direction::Down), rig.proxy.bytes(Direction::Up));
    let orders = collect(board, MEASURE);
    let rate = |way, before| (rig.proxy.bytes(way) - before) as f64 / start.elapsed().as_secs_f64();
    let (down_bytes_s, up_bytes_s) = (rate(Direction::Down, down), rate(Direction::Up, up));
    let introspections: Vec<Tapped> = std::iter::from_fn(|| ground.try_recv().ok()).collect();
    let of = |heard: &[Tapped], topic| Statistics::of(&latencies_ms(heard, topic));
    let (order_ms, introspection_ms) = (of(&orders, Topic::GroundContact), of(&introspections, Topic::Introspection));
    Figures { name, down_bytes_s, up_bytes_s, order_ms, introspection_ms }
}

/// Of each message, over whichever connection it came first.
fn latencies_ms(heard: &[Tapped], topic: Topic) -> Vec<f64> {
    let mut first: BTreeMap<u64, u64> = BTreeMap::new();
    for it in heard.iter().filter(|it| it.message.topic() == topic) {
        let received = first.entry(it.published_ns).or_insert(it.received_ns);
        *received = it.received_ns.min(*received);
    }
    first.iter().map(|(published, received)| received.saturating_sub(*published) as f64 / 1e6).collect()
}

fn tap(router: &str, scope: Scope, topics: &[Topic]) -> Result<(Tap, Receiver<Tapped>), String> {
    let link = Link { connect: vec![router.to_owned()], scope, open_timeout: LIMIT };
    let (hear, heard) = channel();
    // Fails only at the end of the measurement.
    let tap = Tap::open(&link, topics, move |it| drop(hear.send(it)));
    Ok((tap.map_err(|it| it.to_string())?, heard))
}

/// Everything that comes in this time.
fn collect(heard: &Receiver<Tapped>, time: Duration) -> Vec<Tapped> {
    let until = Instant::now() + time;
    let next = || heard.recv_timeout(until.saturating_duration_since(Instant::now())).ok();
    std::iter::from_fn(next).collect()
}

fn wait<T>(heard: &Receiver<Tapped>, mut find: impl FnMut(&Tapped) -> Option<T>) -> Result<T, String> {
    let until = Instant::now() + LIMIT;
    loop {
        let left = until.saturating_duration_since(Instant::now());
        let it = heard.recv_timeout(left).map_err(|_| format!("nothing was heard for {LIMIT:?}"))?;
        if let Some(found) = find(&it) {
            return Ok(found);
        }
    }
}

/// Says something of an order's class and size from the ground, again and again.
fn speak(router: &str, vehicle: &str, stop: &Stop) -> std::thread::JoinHandle<()> {
    let link = Link { connect: vec![router.to_owned()], scope: Scope::Fleet, open_timeout: LIMIT };
    let (vehicle, stop) = (VehicleId::from(vehicle), stop.clone());
    std::thread::spawn(move || {
        let mut speaker = Speaker { vehicle, next: Time::default() };
        if let Err(cause) = Process::of(&mut speaker, &link).run(&stop) {
            tracing::warn!(%cause, "not on the bus");
        }
    })
}

struct Speaker {
    vehicle: VehicleId,
    next: Time,
}

impl Node for Speaker {
    fn name(&self) -> &'static str {
        "kpi-speaker"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[]
    }

    fn on(&mut self, _: Now, _: Event, _: &mut Vec<Effect>) {}

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        if self.next <= now.time {
            self.next = now.time + PERIOD;
            let message = Message::GroundContact(GroundContact { heard_age_wall_s: 0.0, ..Default::default() });
            effects.push(Effect::Publish { vehicle: Some(self.vehicle.clone()), message });
        }
    }

    fn deadline(&self) -> Option<Time> {
        Some(self.next)
    }
}

/// As a table.
pub(crate) fn text(it: &Measured) -> String {
    let mut text = format!("{}, load {:.1} before\n", it.machine, it.load_before);
    let ms = |it: &Option<Statistics>| match it {
        Some(it) => format!("{:.0} / {:.0} / {:.0} of {}", it.p50, it.p99, it.max, it.count),
        None => "none arrived".to_owned(),
    };
    let _ = writeln!(
        text,
        "{:18} {:>9} {:>7}  {:32} {:32}",
        "link", "down B/s", "up B/s", "order, ms: p50 / p99 / max", "introspection, ms"
    );
    for shape in &it.shapes {
        let (order, introspection) = (ms(&shape.order_ms), ms(&shape.introspection_ms));
        let Figures { name, down_bytes_s, up_bytes_s, .. } = shape;
        let _ = writeln!(text, "{name:18} {down_bytes_s:9.0} {up_bytes_s:7.0}  {order:32} {introspection:32}");
    }
    let _ = writeln!(
        text,
        "cut of {CUT:?}: link_lost after {:.1} s, fresh data {:.1} s after its end",
        it.link_lost_after_s, it.fresh_after_s
    );
    text
}
