//! Messages to a client as zenoh-pico is one: without priorities, and with small batches.

#![expect(clippy::disallowed_methods, reason = "a test waits for what other threads do, up to a limit")]

use std::sync::mpsc::channel;
use std::time::Duration;

use bus::{Foreign, ForeignLink, Nudge};
use zenoh::{Session, Wait};

/// Much longer than any wait on a machine in order.
const LIMIT: Duration = Duration::from_secs(60);
/// More than wait anywhere on the way.
const BURST: u32 = 5000;

fn client(endpoint: &str) -> Session {
    let mut config = zenoh::Config::default();
    let settings = [
        ("mode", "\"client\"".to_owned()),
        ("connect/endpoints", format!("[\"{endpoint}\"]")),
        ("scouting/multicast/enabled", "false".to_owned()),
        ("transport/unicast/qos/enabled", "false".to_owned()),
        ("transport/link/tx/batch_size", "256".to_owned()),
    ];
    for (key, value) in settings {
        config.insert_json5(key, &value).expect("a setting of zenoh");
    }
    zenoh::open(config).wait().expect("the router")
}

#[test]
fn after_a_burst_that_a_link_without_priorities_cannot_take_at_once_it_still_hears_what_is_sent() {
    let link = ForeignLink {
        listen: "tcp/127.0.0.1:0".into(),
        receive: "out/**".into(),
        tokens: "tokens/**".into(),
        keeps_newest_only: |_| false,
    };
    let foreign = Foreign::open(&link, &Nudge::default()).expect("a port");
    let session = client(&foreign.locators()[0]);
    let (sender, heard) = channel();
    let subscriber = session.declare_subscriber("in/setpoint").callback(move |sample| {
        // Fails only at the end.
        let _ = sender.send(u32::from_le_bytes(sample.payload().to_bytes()[..4].try_into().expect("a number")));
    });
    let _subscriber = subscriber.wait().expect("a subscriber");
    let put = |number: u32| {
        let mut payload = vec![0; 160];
        payload[..4].copy_from_slice(&number.to_le_bytes());
        foreign.put("in/setpoint", payload, None);
    };
    // What is sent before the subscriber is known is lost.
    let begins = (0..LIMIT.as_millis() / 10).any(|_| {
        put(0);
        heard.recv_timeout(Duration::from_millis(10)).is_ok()
    });
    assert!(begins, "nothing is heard");
    (1..=BURST).for_each(put);
    let mut last = 0;
    while last < BURST {
        last = heard.recv_timeout(LIMIT).unwrap_or_else(|_| panic!("{last} was the last of {BURST} that is heard"));
    }
}

#[test]
fn a_session_that_connects_is_announced_and_answers_its_requests_but_no_wildcard() {
    let router = Foreign::listen("tcp/127.0.0.1:0", &Nudge::default()).expect("a port");
    let nudge = Nudge::default();
    let waiter = nudge.waiter();
    let mut foreign = Foreign::connect(&router.locators()[0], LIMIT, &nudge).expect("the router");
    foreign.serve("0/uav1/pause").expect("a key");
    foreign.announce("@ros2_lv/0/node").expect("a key");
    let session = client(&router.locators()[0]);

    // Once the token is seen the queryable, which was declared before it, is known too.
    let token = (0..LIMIT.as_millis() / 10).any(|_| {
        let tokens = session.liveliness().get("@ros2_lv/**").timeout(LIMIT).wait().expect("a query");
        tokens.recv_timeout(Duration::from_millis(10)).is_ok_and(|it| it.is_some())
    });
    assert!(token, "no token is seen");

    let all = session.get("0/**").timeout(LIMIT).wait().expect("a query");
    assert!(all.recv().is_err(), "it ends without a reply");
    let replies = session.get("0/uav1/pause").payload("now").attachment("of 5").timeout(LIMIT).wait().expect("a query");
    waiter.recv_timeout(LIMIT).expect("it is woken");
    let mail = foreign.take();
    let [bus::ForeignMail::Request { number, key, payload }] = mail.as_slice() else { panic!("{mail:?}") };
    assert_eq!((key.as_str(), payload.as_slice()), ("0/uav1/pause", &b"now"[..]));
    foreign.reply(*number, b"done".to_vec());
    let reply = replies.recv().expect("a reply").into_result().expect("a sample");
    assert_eq!(reply.payload().to_bytes(), &b"done"[..]);
    assert_eq!(reply.attachment().map(|it| it.to_bytes().into_owned()), Some(b"of 5".to_vec()));
}
