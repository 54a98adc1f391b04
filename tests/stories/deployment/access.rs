//! Who may send what over the link: every role with every key, over real TLS sessions.
//!
//! A role is a session with a certificate (or none) at the link's end of a router that runs as it is shipped; a session
//! on the router's own side listens. To show that a message is refused and not merely late, an allowed one is sent
//! after it on the same way, and that one arrives.

use std::collections::BTreeSet;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use kittiwake_proto::topics::{Service, Topic};
use zenoh::config::Config;
use zenoh::query::{ConsolidationMode, QueryTarget};
use zenoh::{Session, Wait};

use super::world::{Credentials, Router};
use crate::support::{LIMIT, wait_for};

/// What may cross, written by hand a second time, since the table is under test.
const DOWN: &[&str] = &[
    "fmu/out/vehicle_status",
    "fmu/out/transponder_report",
    "fmu/out/wind",
    "fmu/out/picture",
    "monitor/introspection",
    "health",
    "mcm/status",
    "skill/event",
    "mcm/decision",
    "mission/status",
    "skill/feedback",
    "mcm/tree",
];
const UP: &[&str] = &["permission/ledger", "ground/contact"];
const ANSWERED_ON_BOARD: &[&str] = &["mcm/command", "mission/request"];
const ANSWERED_ON_THE_GROUND: &[&str] = &["permission/request"];

fn set(keys: &[&'static str]) -> BTreeSet<&'static str> {
    keys.iter().copied().collect()
}

fn topics() -> Vec<&'static str> {
    Topic::ALL.iter().map(|it| it.key()).collect()
}

fn services() -> Vec<&'static str> {
    Service::ALL.iter().map(|it| it.key()).collect()
}

fn base(mode: &str) -> Config {
    let mut config = Config::default();
    for (key, value) in [
        ("mode", format!("\"{mode}\"")),
        ("scouting/multicast/enabled", "false".into()),
        ("scouting/gossip/enabled", "false".into()),
        ("scouting/delay", "0".into()),
    ] {
        config.insert_json5(key, &value).unwrap();
    }
    config
}

/// With the certificate of `name`, or none.
fn with_credentials(config: &mut Config, credentials: &Credentials, name: Option<&str>) {
    let file = |name: &str, it: &str| credentials.of(name).join(it).to_string_lossy().into_owned();
    // The client trusts the right authority; whom the router trusts is under test.
    let mut tls =
        serde_json::json!({ "root_ca_certificate": file("ground-router", "authority.pem"), "enable_mtls": true });
    if let Some(name) = name {
        for side in ["connect", "listen"] {
            tls[format!("{side}_certificate")] = file(name, "certificate.pem").into();
            tls[format!("{side}_private_key")] = file(name, "key.pem").into();
        }
    }
    config.insert_json5("transport/link/tls", &tls.to_string()).unwrap();
}

fn connect(config: Config, locator: &str) -> Result<Session, String> {
    let mut config = config;
    config.insert_json5("connect/endpoints", &format!("[\"{locator}\"]")).unwrap();
    zenoh::open(config).wait().map_err(|cause| cause.to_string())
}

/// A session on a router's own side.
fn inside(router: &Router) -> Session {
    connect(base("client"), &router.inside).expect("one's own side may connect")
}

/// Everything that is published to `session`, as it arrives: each key by itself, as the services listen.
fn listen(session: &Session, vehicle: &str) -> Receiver<String> {
    let (sender, heard) = channel();
    for key in topics() {
        let sender = sender.clone();
        session
            .declare_subscriber(format!("kw/{vehicle}/{key}"))
            .callback(move |sample| drop(sender.send(sample.key_expr().to_string())))
            .background()
            .wait()
            .unwrap();
    }
    heard
}

/// Publishes every topic of `vehicle`, then `fence`, again and again until the fence and all of `expected` were heard, and then once
/// more; fails if anything else was heard.
#[track_caller]
fn assert_crossing(
    from: &Session,
    heard: &Receiver<String>,
    vehicle: &str,
    fence: &str,
    expected: &[&'static str],
    what: &str,
) {
    let prefix = format!("kw/{vehicle}/");
    let mut crossed = BTreeSet::new();
    let mut say_all = || {
        topics().iter().for_each(|key| from.put(format!("{prefix}{key}"), "x").wait().unwrap());
        from.put(fence, "x").wait().unwrap();
        let mut fence_is_heard = false;
        // Until nothing more comes: the question here is how much comes.
        while let Ok(key) = heard.recv_timeout(Duration::from_millis(500)) {
            fence_is_heard |= key == fence;
            let topic = key.strip_prefix(&prefix).and_then(|it| topics().into_iter().find(|key| *key == it));
            crossed.extend(topic);
        }
        (fence_is_heard, crossed.clone())
    };
    // Subscriptions are announced one topic after the other: the fence may arrive before another one is let through.
    let expected = set(expected);
    let mut arrived = false;
    wait_for(&format!("the link to carry {expected:?}: {what}"), || {
        let (fence_is_heard, crossed) = say_all();
        arrived |= fence_is_heard;
        (arrived && expected.is_subset(&crossed)).then_some(())
    });
    assert_eq!(say_all().1, expected, "{what}");
}

/// Answers every service of `vehicle` at `session`, declared as the services declare it.
fn serve(session: &Session, vehicle: &str) {
    for key in services() {
        session
            .declare_queryable(format!("kw/{vehicle}/{key}"))
            .complete(true)
            .callback(|query| drop(query.reply(query.key_expr(), "answer").wait()))
            .background()
            .wait()
            .unwrap();
    }
}

/// Which services of `vehicle` answer to `from`; asks until `expected` do, and then once more.
fn answered(from: &Session, vehicle: &str, expected: &BTreeSet<&'static str>) -> BTreeSet<&'static str> {
    let ask = |key: &&'static str| {
        let replies = from.get(format!("kw/{vehicle}/{key}")).payload("x").timeout(Duration::from_millis(700)).wait();
        replies.unwrap().into_iter().any(|it| it.result().is_ok())
    };
    wait_for("the allowed services to answer", || expected.iter().all(ask).then_some(()));
    services().into_iter().filter(ask).collect()
}

/// A ground router that lets uav1 and uav2 in.
fn ground(credentials: &Credentials) -> Router {
    Router::ground(credentials, &["uav1", "uav2"])
}

fn at_the_ground(ground: &Router, credentials: &Credentials, name: Option<&str>) -> Result<Session, String> {
    let mut config = base("client");
    with_credentials(&mut config, credentials, name);
    connect(config, &format!("tls/localhost:{}", ground.link_address().port()))
}

#[test]
fn a_vehicle_says_to_the_ground_what_is_in_the_table_and_as_itself_only() {
    let credentials = Credentials::make(&["uav1", "uav2"], &[]);
    let ground = ground(&credentials);
    let tower = inside(&ground);
    let (own, other) = (listen(&tower, "uav1"), listen(&tower, "uav2"));
    let uav1 = at_the_ground(&ground, &credentials, Some("uav1-router")).expect("uav1 is let in");
    assert_crossing(&uav1, &own, "uav1", "kw/uav1/health", DOWN, "what uav1 says of itself");
    while other.try_recv().is_ok() {}
    // The fence has a key of uav1's own, so it is heard as uav1's; nothing of uav2's is heard.
    let listened = listen(&tower, "uav1");
    let (both, as_other) = channel();
    for receiver in [listened, other] {
        let both = both.clone();
        std::thread::spawn(move || receiver.into_iter().for_each(|it| drop(both.send(it))));
    }
    assert_crossing(&uav1, &as_other, "uav2", "kw/uav1/health", &[], "what uav1 says of uav2");
}

#[test]
fn the_ground_says_to_a_vehicle_what_is_in_the_table_and_to_the_right_one() {
    let credentials = Credentials::make(&["uav1", "uav2"], &[]);
    let ground = ground(&credentials);
    let tower = inside(&ground);
    let uav1 = at_the_ground(&ground, &credentials, Some("uav1-router")).expect("uav1 is let in");
    let heard = listen(&uav1, "uav1");
    let _ = uav1.declare_subscriber("kw/**").callback(|_| ()).background().wait();
    assert_crossing(&tower, &heard, "uav1", "kw/uav1/permission/ledger", UP, "what uav1 hears");
    let uav2 = at_the_ground(&ground, &credentials, Some("uav2-router")).expect("uav2 is let in");
    let (sender, heard) = channel();
    for pattern in ["kw/uav1/**", "kw/**", "kw/uav2/permission/ledger"] {
        let sender = sender.clone();
        uav2.declare_subscriber(pattern)
            .callback(move |sample| drop(sender.send(sample.key_expr().to_string())))
            .background()
            .wait()
            .unwrap();
    }
    assert_crossing(&tower, &heard, "uav1", "kw/uav2/permission/ledger", &[], "what uav2 hears of uav1");
}

#[test]
fn only_the_services_of_the_table_are_answered_over_the_link() {
    let credentials = Credentials::make(&["uav1", "uav2"], &[]);
    let ground = ground(&credentials);
    let tower = inside(&ground);
    serve(&tower, "*");
    let uav1 = at_the_ground(&ground, &credentials, Some("uav1-router")).expect("uav1 is let in");
    let expected = set(ANSWERED_ON_THE_GROUND);
    assert_eq!(answered(&uav1, "uav1", &expected), expected, "what the ground answers uav1");
    assert_eq!(answered(&uav1, "uav2", &set(&[])), set(&[]), "what the ground answers uav1 as uav2");
    drop(tower);
    let ground = self::ground(&credentials);
    let gateway = inside(&ground);
    let uav1 = at_the_ground(&ground, &credentials, Some("uav1-router")).expect("uav1 is let in");
    serve(&uav1, "uav1");
    serve(&uav1, "uav2");
    let expected = set(ANSWERED_ON_BOARD);
    assert_eq!(answered(&gateway, "uav1", &expected), expected, "what uav1 answers the ground");
    assert_eq!(answered(&gateway, "uav2", &set(&[])), set(&[]), "what uav1 answers the ground as uav2");
}

#[test]
fn strangers_are_not_let_in() {
    let credentials = Credentials::make(&["uav1", "uav2", "uav9"], &[]);
    let (foreign, expired) = (Credentials::make(&["uav1"], &[]), Credentials::make(&["uav1"], &["--days=-1"]));
    let mut ground = ground(&credentials);
    assert!(at_the_ground(&ground, &credentials, None).is_err(), "without a certificate");
    assert!(at_the_ground(&ground, &expired, Some("uav1-router")).is_err(), "with an expired certificate");
    // It trusts our authority, but shows a certificate of another one.
    let mut config = base("client");
    with_credentials(&mut config, &foreign, Some("uav1-router"));
    let authority = credentials.of("ground-router").join("authority.pem").to_string_lossy().into_owned();
    config.insert_json5("transport/link/tls/root_ca_certificate", &format!("\"{authority}\"")).unwrap();
    let locator = format!("tls/localhost:{}", ground.link_address().port());
    assert!(connect(config, &locator).is_err(), "with a certificate of another authority");
    // A certificate of our authority for an unexpected vehicle connects, but may do nothing.
    let tower = inside(&ground);
    let heard = listen(&tower, "uav9");
    let uav9 = at_the_ground(&ground, &credentials, Some("uav9-router")).expect("a connection");
    serve(&tower, "*");
    assert_eq!(answered(&uav9, "uav9", &set(&[])), set(&[]), "what the ground answers uav9");
    let fence = "kw/uav9/fence";
    let (sender, fenced) = channel();
    let hear = move |it: String| drop(sender.send(it));
    let fence_heard = hear.clone();
    tower
        .declare_subscriber(fence)
        .callback(move |sample| fence_heard(sample.key_expr().to_string()))
        .background()
        .wait()
        .unwrap();
    std::thread::spawn(move || heard.into_iter().for_each(hear));
    topics().iter().for_each(|key| uav9.put(format!("kw/uav9/{key}"), "x").wait().unwrap());
    // Its earlier requests were refused one by one, so these are refused too; our own message arrives.
    let _ = answered(&uav9, "uav9", &set(&[]));
    inside(&ground).put(fence, "x").wait().unwrap();
    assert_eq!(fenced.recv_timeout(LIMIT).as_deref(), Ok(fence), "what uav9 says");
    assert!(ground.process().runs());
}

/// Listens as a ground with these credentials, and returns the address.
fn listen_as(credentials: &Credentials, name: &str) -> (Session, std::net::SocketAddr) {
    let mut config = base("router");
    with_credentials(&mut config, credentials, Some(name));
    config.insert_json5("listen/endpoints", "[\"tls/127.0.0.1:0\"]").unwrap();
    let session = zenoh::open(config).wait().unwrap();
    let locator = session.info().locators().wait().remove(0).to_string();
    (session, locator.trim_start_matches("tls/").parse().unwrap())
}

#[test]
fn an_aircraft_talks_to_its_own_ground_only() {
    let credentials = Credentials::make(&["uav1", "uav2"], &[]);
    let foreign = Credentials::make(&["uav1"], &[]);
    let link_token = |router: &Router| {
        let found = inside(router).liveliness().get("router/**").wait().unwrap();
        let is_link = |it: &zenoh::sample::Sample| it.key_expr().as_str().starts_with("router/uav1-router/link/");
        found.into_iter().filter(|it| it.result().is_ok_and(is_link)).count()
    };
    for (credentials_of_ground, name, why) in [
        (&foreign, "ground-router", "its certificate is not accepted: invalid peer certificate"),
        (
            &credentials,
            "uav2-router",
            "its certificate is not accepted: invalid peer certificate: certificate not valid for name",
        ),
    ] {
        let (_impostor, address) = listen_as(credentials_of_ground, name);
        let mut aircraft = Router::aircraft(&credentials, "uav1", address);
        let said = aircraft.process().wait_for("has been down for");
        assert!(said.contains(why), "{said}");
        assert_eq!(link_token(&aircraft), 0, "{said}");
    }
    let (real, address) = listen_as(&credentials, "ground-router");
    let mut aircraft = Router::aircraft(&credentials, "uav1", address);
    aircraft.process().wait_for("the link to ground-router is up");
    let onboard = inside(&aircraft);
    let heard = listen(&onboard, "uav1");
    assert_crossing(&real, &heard, "uav1", "kw/uav1/permission/ledger", UP, "what the ground says on board");
    serve(&onboard, "uav1");
    let expected = set(ANSWERED_ON_BOARD);
    assert_eq!(answered(&real, "uav1", &expected), expected, "what is answered on board");
    let heard = listen(&real, "uav1");
    assert_crossing(&onboard, &heard, "uav1", "kw/uav1/health", DOWN, "what leaves the aircraft");
}

#[test]
fn a_key_with_wildcards_stands_for_nothing_that_is_not_in_the_table() {
    const WILD: [&str; 5] = ["kw/uav1/**", "kw/*/mcm/*", "kw/uav1/fmu/in/*", "kw/**", "**"];
    let credentials = Credentials::make(&["uav1"], &[]);
    let (ground, address) = listen_as(&credentials, "ground-router");
    let mut aircraft = Router::aircraft(&credentials, "uav1", address);
    aircraft.process().wait_for("the link to ground-router is up");
    let onboard = inside(&aircraft);
    for key in services() {
        let key = format!("kw/uav1/{key}");
        let own = key.clone();
        let queryable = onboard.declare_queryable(key).callback(move |it| drop(it.reply(&own, "answer").wait()));
        queryable.background().wait().unwrap();
    }
    let ask = |key: &str| -> Vec<String> {
        let get = ground.get(key).payload("x").target(QueryTarget::All).consolidation(ConsolidationMode::None);
        let replies = get.timeout(Duration::from_millis(700)).wait().unwrap().into_iter();
        replies.filter_map(|it| it.result().ok().map(|it| it.key_expr().to_string())).collect()
    };
    // Over both connections: wildcards find the declarations of the second one.
    wait_for("both connections", || (ask("kw/uav1/mcm/command").len() == 2).then_some(()));
    for key in WILD {
        let allowed = |it: &String| ANSWERED_ON_BOARD.iter().any(|key| it.strip_prefix("kw/uav1/") == Some(key));
        let answered = ask(key);
        assert!(answered.iter().all(allowed), "{key}: {answered:?}");
    }
    let heard = listen(&onboard, "uav1");
    let fence = "kw/uav1/permission/ledger";
    let mut strange = Vec::new();
    wait_for("the link to carry what is allowed", || {
        WILD.iter().for_each(|key| ground.put(*key, "x").wait().unwrap());
        ground.put(fence, "y").wait().unwrap();
        let came: Vec<String> = std::iter::from_fn(|| heard.recv_timeout(Duration::from_millis(500)).ok()).collect();
        let (allowed, other): (Vec<_>, Vec<_>) =
            came.into_iter().partition(|it| UP.iter().any(|key| it.strip_prefix("kw/uav1/") == Some(key)));
        strange.extend(other);
        (!allowed.is_empty()).then_some(())
    });
    assert_eq!(strange, Vec::<String>::new(), "what the ground says on board");
}
