//! The link is cut in flight: on board only the monitor notices it, on the ground every client sees it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use bus::{Link, Scope, Tap};
use faulty_link::{CLEAR, Direction, Proxy, Shape};
use kittiwake_proto::topics::{Message, Topic};
use serde_json::Value;

use super::world::{Deployment, ON_BOARD};
use crate::support::wait_for;

/// Length of the operator's name, which is part of every order: so an order on its way is larger than
/// any other message to the aircraft.
const NAME_BYTES: usize = 700;

const BOTH: &[Direction] = &[Direction::Down, Direction::Up];

/// In real time: the flight is long enough, since the vehicle holds while the link is lost.
const SPEED: &[&str] = &["--speed", "1"];

/// The messages heard on board by an observer.
struct OnBoard {
    _tap: Tap,
    heard: Arc<Mutex<Heard>>,
}

#[derive(Default)]
struct Heard {
    up: BTreeSet<String>,
    /// Each that has risen or fallen.
    flags: Vec<(Instant, String, bool)>,
    introspections: u64,
    decisions: Vec<String>,
    modes: Vec<i32>,
}

impl OnBoard {
    fn look_on(deployment: &Deployment) -> OnBoard {
        let heard: Arc<Mutex<Heard>> = Arc::default();
        let link = Link {
            connect: vec![deployment.aircraft.inside.clone()],
            scope: Scope::Vehicle("uav1".into()),
            open_timeout: Duration::from_secs(10),
        };
        let told = heard.clone();
        let topics = &[Topic::Introspection, Topic::DecisionRecord, Topic::VehicleStatus];
        let tap = Tap::open(&link, topics, move |it| told.lock().unwrap().take(it.message)).unwrap();
        OnBoard { _tap: tap, heard }
    }

    /// When the flag last rose or fell.
    fn flag(&self, name: &str, raised: bool) -> Option<Instant> {
        let heard = self.heard.lock().unwrap();
        heard.flags.iter().rev().find(|(_, it, up)| it == name && *up == raised).map(|(at, ..)| *at)
    }

    fn decided(&self, part: &str) -> bool {
        self.heard.lock().unwrap().decisions.iter().any(|it| it.contains(part))
    }

    fn flags(&self) -> Vec<String> {
        self.heard.lock().unwrap().flags.iter().map(|(_, name, up)| format!("{name} {up}")).collect()
    }

    /// Introspections so far.
    fn introspections(&self) -> u64 {
        self.heard.lock().unwrap().introspections
    }
}

impl Heard {
    fn take(&mut self, message: Message) {
        match message {
            Message::DecisionRecord(it) => self.decisions.push(format!("{}: {}", it.topic, it.text)),
            Message::VehicleStatus(it) => self.modes.push(it.actual_mode),
            Message::Introspection(it) => {
                self.introspections += 1;
                let up: BTreeSet<String> = it.flags.into_iter().map(|it| it.name).collect();
                let risen = up.difference(&self.up).map(|it| (it, true));
                let changed = self.up.difference(&up).map(|it| (it, false)).chain(risen);
                self.flags.extend(changed.map(|(name, raised)| (Instant::now(), name.clone(), raised)));
                self.up = up;
            }
            _ => {}
        }
    }
}

fn instances(document: &Value) -> BTreeMap<String, String> {
    let text = |it: &Value| it.as_str().unwrap_or_default().to_owned();
    let rows = document["processes"].as_array().cloned().unwrap_or_default();
    let rows = rows.iter().map(|it| (text(&it["service"]), text(&it["instance"])));
    rows.filter(|(name, _)| ON_BOARD.contains(&name.as_str())).collect()
}

/// Seconds from now until the ground holds fresh data of every kind again.
fn until_fresh(deployment: &Deployment) -> f64 {
    let start = Instant::now();
    wait_for("the ground to see the vehicle as it is", || {
        let sources = deployment.services.document()["sources"].clone();
        let young = |name: &str, limit: f64| sources[name]["wallAgeS"].as_f64().is_some_and(|age| age < limit);
        let since = start.elapsed().as_secs_f64();
        let arrived_since = |name: &str| young(name, since.clamp(0.05, 1.2));
        ["introspection", "mcmStatus", "missionStatus", "vehicleStatus"]
            .iter()
            .all(|it| arrived_since(it))
            .then_some(())
    });
    start.elapsed().as_secs_f64()
}

/// The page's own limit: older data are shown as stale.
const STALE_AFTER_S: f64 = 0.9;

/// Seconds from the cut until the data on the ground are older than the page's limit.
fn until_stale(deployment: &Deployment, cut: Instant) -> f64 {
    // From the age that was read: the time of reading does not matter.
    wait_for("the ground to see that nothing comes", || {
        let (age, now) = (deployment.services.age("introspection"), cut.elapsed().as_secs_f64());
        (STALE_AFTER_S < age).then_some(now - age + STALE_AFTER_S)
    })
}

#[test]
fn a_cut_is_seen_on_both_sides_and_nothing_old_is_obeyed_after_it() {
    let mut deployment = Deployment::start_for(&"n".repeat(NAME_BYTES), SPEED);
    let on_board = OnBoard::look_on(&deployment);
    deployment.services.wait_in_flight();
    let before = instances(&deployment.services.document());
    assert_eq!(before.len(), ON_BOARD.len(), "{before:?}");
    let cuts: [(f64, &[Direction]); 7] = [
        (0.5, BOTH),
        (0.5, &[Direction::Up]),
        (0.5, &[Direction::Down]),
        (60.0, BOTH),
        (5.0, BOTH),
        (5.0, &[Direction::Up]),
        (5.0, &[Direction::Down]),
    ];
    for (seconds, ways) in cuts {
        // On a machine with too much to do the link may be lost without a cut.
        wait_for("the link not to be lost", || {
            on_board.flags().last().is_none_or(|it| it.ends_with("false")).then_some(())
        });
        let up = ways.contains(&Direction::Up);
        let order = up.then(|| said_into_the_cut(&deployment));
        let cut = Instant::now();
        deployment.proxy.cut(ways);
        // Bytes on their way arrive when they would have arrived.
        deployment.proxy.shape(CLEAR);
        let stale = (ways.contains(&Direction::Down) && 1.0 < seconds).then(|| until_stale(&deployment, cut));
        let flag_after = (10.0 < seconds).then(|| {
            let rose = wait_for("the flag", || on_board.flag("link_lost", true).filter(|at| cut < *at));
            (rose - cut).as_secs_f64()
        });
        if flag_after.is_some() {
            wait_for("the row's action", || on_board.decided("link_lost").then_some(()));
        }
        let left = Duration::from_secs_f64(seconds).saturating_sub(cut.elapsed());
        let so_far = on_board.introspections();
        // The length of the cut is under test; nothing is waited for.
        std::thread::sleep(left);
        // On board everything goes on meanwhile.
        wait_for("more introspections on board", || (so_far < on_board.introspections()).then_some(()));
        deployment.proxy.heal();
        let fresh = until_fresh(&deployment);
        if let Some(order) = order {
            let (status, body) = order.join().expect("the order is answered");
            assert_eq!(status, 503, "said before a cut of {seconds} s: {body}");
        }
        eprintln!(
            "cut {seconds:4.1} s {ways:?}: stale {stale:.2?} s, link_lost {flag_after:.2?} s, fresh {fresh:.2} s"
        );
    }
    wait_for("the flag to fall", || on_board.flag("link_lost", false));
    // That something was silent for a second is said on a machine with too much to do as well.
    let silence = |it: &str| ["_lost", "_gone", "_stale"].iter().any(|end| it.contains(end));
    let others: Vec<_> = on_board.flags().into_iter().filter(|it| !silence(it)).collect();
    assert!(others.is_empty(), "on board: {others:?}");
    assert!(
        !on_board.decided("paus"),
        "no order from before a cut was obeyed: {:?}",
        on_board.heard.lock().unwrap().decisions
    );
    wait_for("the same processes as before", || (instances(&deployment.services.document()) == before).then_some(()));
    deployment.services.expect_all_run();
    let (status, body) = deployment.services.post("/api/v1/vehicles/uav1/pause");
    assert_eq!(status, 200, "a new order is obeyed: {body}");
}

#[test]
fn an_order_passes_while_either_of_the_two_connections_is_stuck() {
    for connection in [0, 1] {
        wait_for("an order to pass while a connection is stuck", || passes_beside(connection).then_some(()));
    }
}

/// Whether an order passes while this connection is stuck. A machine with too much to do may take longer for the order than
/// the silence after which the connection is made again, which shows nothing.
fn passes_beside(connection: u64) -> bool {
    let deployment = Deployment::start(SPEED);
    deployment.services.wait_in_flight();
    if deployment.proxy.connections() != 2 {
        return false;
    }
    deployment.proxy.hold(connection);
    let (status, body) = deployment.services.post("/api/v1/vehicles/uav1/contingencies/battery_low/acknowledge");
    eprintln!("beside connection {connection}, {} made: {status} {body}", deployment.proxy.connections());
    // Refused by the vehicle, since that flag is not up: it came there, and over the other connection.
    status == 409 && deployment.proxy.connections() == 2
}

/// An order that has left the ground and is on its way when the link is cut.
fn said_into_the_cut(deployment: &Deployment) -> std::thread::JoinHandle<(u16, Value)> {
    let delay = Duration::from_millis(150);
    deployment.proxy.shape(Shape { delay, ..CLEAR });
    let before = on_the_way(&deployment.proxy);
    let order = deployment.services.post_later("/api/v1/vehicles/uav1/pause");
    wait_for("the order to leave", || (before + (NAME_BYTES as u64) < on_the_way(&deployment.proxy)).then_some(()));
    order
}

fn on_the_way(proxy: &Proxy) -> u64 {
    proxy.bytes(Direction::Up)
}
