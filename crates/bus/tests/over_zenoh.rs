//! Nodes over a real router: what one publishes the other gets, calls are answered or end, and a
//! router that dies and comes back is only a pause.

#![expect(clippy::disallowed_methods, reason = "a test waits for what other threads do, up to a limit")]

use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::time::Duration;

use bus::{BusError, Composition, Direct, Hosted, Link, Nudge, Process, Scope, Stop, run_router};
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{Message, Request, Response, Service, Topic};
use kittiwake_proto::v1;
use node::{CallError, CallId, Effect, Event, Node, VehicleId};
use zenoh::Wait;

/// A node that does what the test says and tells the test what it sees.
struct Probe {
    name: &'static str,
    subscriptions: &'static [Topic],
    serves: &'static [Service],
    seen: Sender<Event>,
    /// Performed when the named service appears.
    on_peer: Option<(&'static str, Vec<Effect>)>,
}

impl Node for Probe {
    fn name(&self) -> &'static str {
        self.name
    }
    fn subscriptions(&self) -> &'static [Topic] {
        self.subscriptions
    }
    fn serves(&self) -> &'static [Service] {
        self.serves
    }
    fn on(&mut self, _: Now, event: Event, effects: &mut Vec<Effect>) {
        if let Event::Peer { service, alive: true, .. } = &event
            && self.on_peer.as_ref().is_some_and(|(name, _)| name == service)
        {
            effects.extend(self.on_peer.take().into_iter().flat_map(|(_, effects)| effects));
        }
        if let Event::Request { token, request: Request::Permission(request), .. } = &event {
            let receipt = v1::PermissionReceipt { received: true, refusal: request.area.clone() };
            effects.push(Effect::Reply { token: *token, response: Response::Permission(receipt) });
        }
        if let Event::Message { message: Message::FlagEvent(flag), .. } = &event
            && flag.name.is_empty()
        {
            effects.push(Effect::refused(Topic::FlagEvent, "`name` is missing"));
        }
        let _ = self.seen.send(event);
    }
    fn deadline(&self) -> Option<Time> {
        None
    }
}

/// Raises a flag every few milliseconds, with a number for its name.
struct Ticker {
    /// Whose, said by the ground.
    vehicle: Option<VehicleId>,
    next: Time,
    count: u64,
}

impl Ticker {
    fn new(vehicle: Option<VehicleId>) -> Ticker {
        Ticker { vehicle, next: Time::ZERO, count: 0 }
    }
}

/// Hears flags, and hangs with each until the test takes it.
struct Hanging(SyncSender<u64>);

impl Node for Hanging {
    fn name(&self) -> &'static str {
        "mcm"
    }
    fn subscriptions(&self) -> &'static [Topic] {
        &[Topic::FlagEvent]
    }
    fn serves(&self) -> &'static [Service] {
        &[]
    }
    fn on(&mut self, _: Now, event: Event, _: &mut Vec<Effect>) {
        if let Some((_, name)) = flag_name(event) {
            let _ = self.0.send(name.parse().unwrap());
        }
    }
    fn deadline(&self) -> Option<Time> {
        None
    }
}

impl Node for Ticker {
    fn name(&self) -> &'static str {
        "monitor"
    }
    fn subscriptions(&self) -> &'static [Topic] {
        &[]
    }
    fn serves(&self) -> &'static [Service] {
        &[Service::Permission]
    }
    fn on(&mut self, _: Now, event: Event, effects: &mut Vec<Effect>) {
        if let Event::Request { token, .. } = event {
            let receipt = v1::PermissionReceipt { received: true, ..Default::default() };
            effects.push(Effect::Reply { token, response: Response::Permission(receipt) });
        }
    }
    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        if self.next <= now.time {
            self.next = now.time + Duration::from_millis(5);
            self.count += 1;
            let flag = v1::FlagEvent { name: self.count.to_string(), raised: true, ..Default::default() };
            effects.push(Effect::Publish { vehicle: self.vehicle.clone(), message: flag.into() });
        }
    }
    fn deadline(&self) -> Option<Time> {
        Some(self.next)
    }
}

/// Says again and again what the planner says of a mission with two thousand areas of fifty corners.
struct LargeMission {
    next: Time,
    status: v1::MissionStatus,
}

impl LargeMission {
    fn new() -> LargeMission {
        let corner = v1::Ned { north_m: 123.4, east_m: -567.8, down_m: 0.0 };
        let area = v1::Area { name: "zone".into(), corners: vec![corner; 50], ..Default::default() };
        LargeMission { next: Time::ZERO, status: v1::MissionStatus { areas: vec![area; 2000], ..Default::default() } }
    }
}

impl Node for LargeMission {
    fn name(&self) -> &'static str {
        "planner"
    }
    fn subscriptions(&self) -> &'static [Topic] {
        &[]
    }
    fn serves(&self) -> &'static [Service] {
        &[]
    }
    fn on(&mut self, _: Now, _: Event, _: &mut Vec<Effect>) {}
    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        if self.next <= now.time {
            self.next = now.time + Duration::from_secs(1);
            effects.push(Effect::publish(self.status.clone()));
        }
    }
    fn deadline(&self) -> Option<Time> {
        Some(self.next)
    }
}

/// A router and whatever runs on it; everything ends with the value.
struct World {
    locator: String,
    stop: Stop,
    threads: Vec<std::thread::JoinHandle<()>>,
}

impl World {
    fn start() -> World {
        let stop = Stop::new();
        let (sender, receiver) = channel();
        let router_stop = stop.clone();
        let thread = std::thread::spawn(move || {
            run_router(&["tcp/127.0.0.1:0".into()], &router_stop, |bound| sender.send(bound[0].clone()).unwrap())
                .unwrap();
        });
        World { locator: receiver.recv().unwrap(), stop, threads: vec![thread] }
    }

    fn run(&mut self, scope: Scope, probe: impl FnOnce(Sender<Event>) -> Probe) -> Receiver<Event> {
        let (sender, receiver) = channel();
        self.run_linked(scope, None, probe(sender));
        receiver
    }

    fn run_linked(&mut self, scope: Scope, direct: Option<Direct>, mut node: impl Node + Send + 'static) {
        let link = Link { connect: vec![self.locator.clone()], scope, open_timeout: Duration::from_secs(20) };
        let stop = self.stop.clone();
        let run = move || Process { direct: direct.as_ref(), ..Process::of(&mut node, &link) }.run(&stop).unwrap();
        self.threads.push(std::thread::spawn(run));
    }
}

impl Drop for World {
    fn drop(&mut self) {
        self.stop.stop();
        for thread in self.threads.drain(..).rev() {
            let _ = thread.join();
        }
    }
}

fn uav(name: &str) -> Scope {
    Scope::Vehicle(name.into())
}

/// The first event that `pick` picks; what the test waits for is named when it does not come.
#[track_caller]
fn wait_for<T>(what: &str, events: &Receiver<Event>, mut pick: impl FnMut(Event) -> Option<T>) -> T {
    let limit = Duration::from_secs(20);
    let start = std::time::Instant::now();
    while let Some(left) = limit.checked_sub(start.elapsed()) {
        match events.recv_timeout(left) {
            Ok(event) => {
                if let Some(found) = pick(event) {
                    return found;
                }
            }
            Err(_) => break,
        }
    }
    panic!("waited {limit:?} for {what}")
}

fn flag(name: &str) -> Effect {
    Effect::publish(v1::FlagEvent { name: name.into(), raised: true, ..Default::default() })
}

fn flag_name(event: Event) -> Option<(String, String)> {
    match event {
        Event::Message { vehicle, message: Message::FlagEvent(flag) } => Some((vehicle.to_string(), flag.name)),
        _ => None,
    }
}

#[test]
fn the_status_of_the_largest_mission_gets_through() {
    let mut world = World::start();
    let listen =
        |name| move |seen| Probe { name, subscriptions: &[Topic::MissionStatus], serves: &[], seen, on_peer: None };
    let ground = world.run(Scope::Fleet, listen("gateway"));
    let own = world.run(uav("uav1"), listen("mcm"));
    world.run_linked(uav("uav1"), None, LargeMission::new());
    let areas = |event| match event {
        Event::Message { message: Message::MissionStatus(status), .. } => Some(status.areas.len()),
        _ => None,
    };
    assert_eq!(wait_for("the status on board", &own, areas), 2000);
    assert_eq!(wait_for("the status on the ground", &ground, areas), 2000);
}

#[test]
fn a_message_reaches_its_own_vehicle_and_the_ground_and_no_other() {
    let mut world = World::start();
    let listen =
        |name| move |seen| Probe { name, subscriptions: &[Topic::FlagEvent], serves: &[], seen, on_peer: None };
    let ground = world.run(Scope::Fleet, listen("gateway"));
    let other = world.run(uav("uav2"), listen("mcm"));
    let own = world.run(uav("uav1"), listen("mcm"));
    // A process that sees the others hears them: what is said once must not be said before.
    let mut seen = std::collections::BTreeSet::new();
    wait_for("the ground to see both vehicles", &ground, |event| {
        if let Event::Peer { vehicle, alive: true, .. } = event {
            seen.insert(vehicle.to_string());
        }
        ["uav1", "uav2"].iter().all(|it| seen.contains(*it)).then_some(())
    });
    let _talker = world.run(uav("uav1"), |seen| Probe {
        name: "monitor",
        subscriptions: &[],
        serves: &[],
        seen,
        on_peer: Some(("mcm", vec![flag("battery_low")])),
    });
    let _other_talker = world.run(uav("uav2"), |seen| Probe {
        name: "monitor",
        subscriptions: &[],
        serves: &[],
        seen,
        on_peer: Some(("mcm", vec![flag("wind")])),
    });
    assert_eq!(wait_for("the flag on board", &own, flag_name), ("uav1".into(), "battery_low".into()));
    assert_eq!(wait_for("the other flag on board", &other, flag_name), ("uav2".into(), "wind".into()));
    let mut on_ground = [wait_for("a flag", &ground, flag_name), wait_for("another", &ground, flag_name)];
    on_ground.sort();
    assert_eq!(on_ground, [("uav1".into(), "battery_low".into()), ("uav2".into(), "wind".into())]);
}

#[test]
fn a_call_is_answered_even_if_its_server_comes_later() {
    let mut world = World::start();
    let ask = |call, timeout| Effect::Call {
        call: CallId(call),
        vehicle: None,
        trace: None,
        request: Request::Permission(v1::PermissionRequest { area: "A".into(), ..Default::default() }),
        timeout,
    };
    let asker = world.run(uav("uav1"), |seen| Probe {
        name: "mcm",
        subscriptions: &[],
        serves: &[],
        seen,
        on_peer: Some(("mcm", vec![ask(1, Duration::from_millis(100)), ask(2, Duration::from_secs(20))])),
    });
    let reply = |event| match event {
        Event::Reply { call, result } => Some((call.0, result)),
        _ => None,
    };
    assert_eq!(wait_for("the end of the first call", &asker, reply), (1, Err(CallError::Unavailable)));
    let _tower = world.run(Scope::Fleet, |seen| Probe {
        name: "control-tower",
        subscriptions: &[],
        serves: &[Service::Permission],
        seen,
        on_peer: None,
    });
    let receipt = v1::PermissionReceipt { received: true, refusal: "A".into() };
    assert_eq!(wait_for("the receipt", &asker, reply), (2, Ok(Response::Permission(receipt))));
}

#[test]
fn a_refused_message_is_counted_in_the_heartbeat() {
    let mut world = World::start();
    let watcher = world.run(uav("uav1"), |seen| Probe {
        name: "gateway",
        subscriptions: &[Topic::Heartbeat],
        serves: &[],
        seen,
        on_peer: None,
    });
    let _refuser = world.run(uav("uav1"), |seen| Probe {
        name: "mcm",
        subscriptions: &[Topic::FlagEvent],
        serves: &[],
        seen,
        on_peer: None,
    });
    let _talker = world.run(uav("uav1"), |seen| Probe {
        name: "monitor",
        subscriptions: &[],
        serves: &[],
        seen,
        on_peer: Some(("mcm", vec![flag(""), flag("battery_low"), flag("")])),
    });
    wait_for("a heartbeat that counts two", &watcher, |event| match event {
        Event::Message { message: Message::Heartbeat(it), .. } => {
            (it.service == "mcm" && it.refused == 2).then_some(())
        }
        _ => None,
    });
}

#[test]
fn who_ends_is_seen_to_be_gone() {
    let mut world = World::start();
    let watcher =
        world.run(uav("uav1"), |seen| Probe { name: "mcm", subscriptions: &[], serves: &[], seen, on_peer: None });
    let mut brief = World { locator: world.locator.clone(), stop: Stop::new(), threads: Vec::new() };
    brief.run(uav("uav1"), |seen| Probe { name: "planner", subscriptions: &[], serves: &[], seen, on_peer: None });
    let planner = |wanted: bool| {
        move |event| match event {
            Event::Peer { service, alive, .. } if service == "planner" && alive == wanted => Some(()),
            _ => None,
        }
    };
    wait_for("the planner", &watcher, planner(true));
    drop(brief);
    wait_for("the planner's end", &watcher, planner(false));
}

#[test]
fn a_direct_link_brings_each_message_once_and_goes_on_without_the_router() {
    let router = World::start();
    let mut on_board = World { locator: router.locator.clone(), stop: Stop::new(), threads: Vec::new() };
    let sockets = tempfile::tempdir().unwrap();
    let private = std::os::unix::fs::PermissionsExt::from_mode(0o700);
    std::fs::set_permissions(sockets.path(), private).unwrap();
    let direct = |name: &str, connect: &[&str]| Direct {
        folder: sockets.path().to_owned(),
        listen: Some(name.to_owned()),
        connect: connect.iter().map(|it| it.to_string()).collect(),
    };
    let (sender, events) = channel();
    let asked = Effect::Call {
        call: CallId(1),
        vehicle: None,
        trace: None,
        request: Request::Permission(v1::PermissionRequest { area: "A".into(), ..Default::default() }),
        timeout: Duration::from_secs(20),
    };
    let listener = Probe {
        name: "mcm",
        subscriptions: &[Topic::FlagEvent],
        serves: &[],
        seen: sender,
        on_peer: Some(("monitor", vec![asked])),
    };
    // The one that calls is there first: a socket that is not there yet is called again.
    on_board.run_linked(uav("uav1"), Some(direct("mcm", &["monitor"])), listener);
    on_board.run_linked(uav("uav1"), Some(direct("monitor", &[])), Ticker::new(None));
    let answered = |event| matches!(event, Event::Reply { result: Ok(_), .. }).then_some(());
    wait_for("the answer", &events, answered);

    let mut last = 0;
    let mut take = |what: &str, count: u64| {
        for _ in 0..count {
            let (_, name) = wait_for(what, &events, flag_name);
            let number: u64 = name.parse().unwrap();
            assert!(last < number, "{number} after {last}: a copy");
            last = number;
        }
    };
    take("a hundred flags by both ways", 100);
    drop(router);
    let gone = |event| matches!(event, Event::Peer { alive: false, .. }).then_some(());
    wait_for("the router's end", &events, gone);
    take("a hundred flags without the router", 100);
}

#[test]
fn what_the_ground_said_while_a_node_hung_is_not_obeyed_when_it_goes_on() {
    let mut world = World::start();
    let (seen, hung) = sync_channel(0);
    world.run_linked(uav("uav1"), None, Hanging(seen));
    let other = world.run(uav("uav1"), |seen| Probe {
        name: "planner",
        subscriptions: &[Topic::FlagEvent],
        serves: &[],
        seen,
        on_peer: None,
    });
    world.run_linked(Scope::Fleet, None, Ticker::new(Some("uav1".into())));
    let limit = Duration::from_secs(20);
    let first = hung.recv_timeout(limit).expect("a flag");
    // 5 ms apart: two seconds.
    let is_later = |event| (first + 400 <= flag_name(event)?.1.parse().ok()?).then_some(());
    wait_for("four hundred flags", &other, is_later);
    let with_it_hung = hung.recv_timeout(limit).expect("the one that it hangs with");
    let next = hung.recv_timeout(limit).expect("another flag");
    assert!(
        with_it_hung < first + 300 && first + 300 < next,
        "{first}, {with_it_hung}, {next}: obeyed after half a second"
    );
}

/// A process that was stopped, or cut off, comes back and finds another one in its place; here the other one is its token alone.
#[test]
fn a_process_ends_once_a_newer_one_has_one_of_its_services_for_its_vehicle_and_not_for_an_older_one() {
    let world = World::start();
    let link = Link { connect: vec![world.locator.clone()], scope: uav("uav1"), open_timeout: Duration::from_secs(20) };
    let (sender, seen) = channel();
    let stop = world.stop.clone();
    let running = std::thread::spawn(move || {
        let probe = |name| Probe { name, subscriptions: &[], serves: &[], seen: sender.clone(), on_peer: None };
        let mut nodes = [probe("mcm"), probe("planner")];
        let nodes = nodes.iter_mut().map(|node| Hosted { node, direct: None, nudge: Nudge::default() }).collect();
        Composition { nodes, link: &link, pace: Pace::REAL_TIME, is_only_one: true }.run(&stop)
    });
    let there = |name: &'static str, number: &'static str| {
        move |event| match event {
            Event::Peer { service, instance, alive: true, .. } => {
                (service == name && instance.ends_with(number)).then_some(())
            }
            _ => None,
        }
    };
    wait_for("the process to be there", &seen, there("planner", ""));
    let mut config = zenoh::Config::default();
    config.insert_json5("mode", "\"client\"").unwrap();
    config.insert_json5("scouting/multicast/enabled", "false").unwrap();
    config.insert_json5("connect/endpoints", &format!("[\"{}\"]", world.locator)).unwrap();
    let session = zenoh::open(config).wait().unwrap();
    let declare = |key: &str| session.liveliness().declare_token(key.to_owned()).wait().unwrap();
    let others = [
        // Of a program that does not know the rule, and of one that died before.
        "kw/uav1/alive/mcm/ffffffffffffffffffffffffffffffff",
        "kw/uav1/alive/mcm/0000000000000001-4f",
        "kw/uav2/alive/mcm/ffffffffffffffff-4f",
        "kw/uav1/alive/monitor/ffffffffffffffff-5f",
    ];
    let _tokens = others.map(declare);
    wait_for("the newer one of another service to be seen", &seen, there("monitor", "-5f"));
    // Had one of those before it ended the process, its end would name that service and not the planner.
    assert!(!running.is_finished(), "it goes on beside those that are older or somebody else's");
    let _newer = declare("kw/uav1/alive/planner/ffffffffffffffff-6f");
    let ended = running.join().unwrap();
    assert!(matches!(&ended, Err(BusError::Superseded { service, .. }) if service == "planner"), "{ended:?}");
}
