//! A narrow link: 64 kbit/s each way, a round trip of 200 ms, two packets in a hundred lost.
//!
//! Everything said arrives, within the bandwidth that the link has. A lost packet costs TCP a retransmission, 400 ms here, and
//! what follows it waits; so orders come over two connections. How long that takes depends on the machine:
//! `kittiwake kpi --link` measures it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use bus::{Link, Scope, Tap};
use faulty_link::{CLEAR, Direction, Shape};
use kittiwake_proto::topics::Topic;
use zenoh::qos::CongestionControl;
use zenoh::{Session, Wait};

use super::world::Deployment;
use crate::support::wait_for;

const NARROW: Shape = Shape { bits_per_s: Some(64_000.0), delay: Duration::from_millis(100), loss: 0.0 };
const LOSSY: Shape = Shape { loss: 0.02, ..NARROW };

const BULK: &[Topic] = &[Topic::MissionStatus, Topic::SkillFeedback, Topic::TreeSnapshot];
const STATE: &[Topic] = &[
    Topic::VehicleStatus,
    Topic::Introspection,
    Topic::Heartbeat,
    Topic::McmStatus,
    Topic::SkillEvent,
    Topic::DecisionRecord,
];

/// Messages and payload bytes of each topic that arrive on the ground.
#[derive(Clone, Default)]
struct Arrivals(Arc<Mutex<BTreeMap<Topic, (u64, u64)>>>);

impl Arrivals {
    fn look_on(&self, deployment: &Deployment) -> Tap {
        let link = Link {
            connect: vec![deployment.ground.inside.clone()],
            scope: Scope::Fleet,
            open_timeout: Duration::from_secs(10),
        };
        let counts = self.clone();
        Tap::open(&link, &[BULK, STATE].concat(), move |it| {
            let mut counts = counts.0.lock().unwrap();
            let count = counts.entry(it.message.topic()).or_default();
            *count = (count.0 + 1, count.1 + it.size as u64);
        })
        .unwrap()
    }

    fn bytes_per_s(&self, topics: &[Topic], over: Duration) -> f64 {
        let counts = self.0.lock().unwrap();
        topics.iter().filter_map(|it| counts.get(it)).map(|it| it.1).sum::<u64>() as f64 / over.as_secs_f64()
    }
}

fn session(locator: &str) -> Session {
    let mut config = zenoh::Config::default();
    config.insert_json5("mode", "\"client\"").unwrap();
    config.insert_json5("scouting/multicast/enabled", "false").unwrap();
    config.insert_json5("connect/endpoints", &format!("[\"{locator}\"]")).unwrap();
    zenoh::open(config).wait().unwrap()
}

/// Sends messages of an order's class and size, and waits until each has arrived on board.
fn all_arrive(deployment: &Deployment, count: usize) {
    let (ground, aircraft) = (session(&deployment.ground.inside), session(&deployment.aircraft.inside));
    let key = "kw/uav1/permission/ledger";
    let heard: Arc<Mutex<BTreeSet<Vec<u8>>>> = Arc::default();
    let told = heard.clone();
    aircraft
        .declare_subscriber(key)
        .callback(move |sample| {
            told.lock().unwrap().insert(sample.payload().to_bytes().to_vec());
        })
        .background()
        .wait()
        .unwrap();
    // Blocking, so that none is dropped here when this process gets no time to send it.
    let publisher = ground.declare_publisher(key).congestion_control(CongestionControl::Block).express(true);
    let publisher = publisher.wait().unwrap();
    // An empty ledger for every receiver: the ledger has no field 1000.
    let payload = |number: usize| [vec![0xc2, 0x3e, 100], format!("{number:0100}").into_bytes()].concat();
    // The first ones find out whether the other side listens to the key yet.
    wait_for("the key to be heard over there", || {
        publisher.put(payload(count)).wait().unwrap();
        heard.lock().unwrap().contains(&payload(count)).then_some(())
    });
    for number in 0..count {
        publisher.put(payload(number)).wait().unwrap();
        // Not in step with any period of the telemetry.
        std::thread::sleep(Duration::from_millis(117));
    }
    let all = || (0..count).all(|it| heard.lock().unwrap().contains(&payload(it)));
    wait_for("every one of them", || all().then_some(()));
}

/// Gives orders that change nothing; returns how many the vehicle has answered.
fn answered(deployment: &Deployment, count: usize) -> usize {
    let is_answered = |_: &usize| {
        let (status, body) = deployment.services.post("/api/v1/vehicles/uav1/contingencies/battery_low/acknowledge");
        // Refused, since that flag is not up: the answer comes from the mission manager.
        assert!(status == 409 || status == 503, "{status}: {body}");
        status == 409
    };
    (0..count).filter(is_answered).count()
}

#[test]
fn orders_pass_a_narrow_link_and_none_is_lost() {
    let deployment = Deployment::start(&["--speed", "1"]);
    deployment.services.wait_in_flight();
    for (name, shape) in [("clear", CLEAR), ("narrow", NARROW), ("narrow and lossy", LOSSY)] {
        deployment.proxy.shape(shape);
        let arrivals = Arrivals::default();
        let tap = arrivals.look_on(&deployment);
        let (start, down, up) =
            (Instant::now(), deployment.proxy.bytes(Direction::Down), deployment.proxy.bytes(Direction::Up));
        // Only the telemetry flows.
        std::thread::sleep(Duration::from_secs(5));
        let over = start.elapsed();
        let rate = |way, before| (deployment.proxy.bytes(way) - before) as f64 / over.as_secs_f64();
        let (down, up) = (rate(Direction::Down, down), rate(Direction::Up, up));
        let classes = [("state", STATE), ("bulk", BULK)];
        let classes = classes.map(|(name, topics)| format!("{name} {:.0}", arrivals.bytes_per_s(topics, over)));
        eprintln!("{name}: down {down:.0} B/s, up {up:.0} B/s; payloads down in B/s: {}", classes.join(", "));
        for (topic, (messages, bytes)) in arrivals.0.lock().unwrap().iter() {
            let seconds = over.as_secs_f64();
            let (rate, size) = (*messages as f64 / seconds, bytes / messages);
            eprintln!("    {:24} {rate:5.2} Hz of {size} bytes", topic.key());
        }
        assert!(down < 20_000.0, "{name}: {down:.0} B/s");
        wait_for("the tree", || arrivals.0.lock().unwrap().contains_key(&Topic::TreeSnapshot).then_some(()));
        drop(tap);
        all_arrive(&deployment, 40);
        assert_ne!(answered(&deployment, 20), 0, "{name}: no order was answered by the vehicle");
    }
}
