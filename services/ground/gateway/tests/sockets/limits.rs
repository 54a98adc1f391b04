//! What strangers and the holders of one token may take of the gateway, and what is left for the others.

#![expect(clippy::disallowed_methods, reason = "a test waits for what other threads do, up to a limit")]

use kittiwake_proto::v1;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::task::JoinSet;

use crate::stories::sockets::{LIMIT, Served, read_to_end, request, tls_over};
use crate::stories::world::{self, World};

/// Between two requests that ask whether something has changed.
const ASK_AGAIN: std::time::Duration = std::time::Duration::from_millis(50);

/// A world whose gateway has these limits instead, and is in no hurry.
fn with_limits(limits: &[(&str, &str)]) -> World {
    let patient = ("head_timeout_s = 0.5", "head_timeout_s = 60.0");
    World::configured_with(&[&[patient], limits].concat())
}

/// An answer to a request on a connection that stays open.
async fn ask(stream: &mut (impl AsyncRead + AsyncWrite + Unpin), path: &str, token: &str, part: &str) -> String {
    let request = format!("GET {path} HTTP/1.1\r\nhost: x\r\nauthorization: Bearer {token}\r\n\r\n");
    let _ = stream.write_all(request.as_bytes()).await;
    read_until(stream, part).await
}

/// What has arrived once `part` is in it, or the end.
async fn read_until(stream: &mut (impl AsyncRead + Unpin), part: &str) -> String {
    let mut seen = Vec::new();
    let reading = async {
        while !String::from_utf8_lossy(&seen).contains(part) {
            match stream.read_buf(&mut seen).await {
                Ok(0) | Err(_) => break,
                Ok(_) => {}
            }
        }
    };
    tokio::time::timeout(LIMIT, reading).await.expect("neither an answer nor an end");
    String::from_utf8_lossy(&seen).into_owned()
}

/// What is answered to a client that connects once; nothing if its connection is displaced, which may be before it is encrypted.
async fn try_once(served: &Served) -> String {
    let request = request(&format!("GET {VEHICLE}"), "");
    let tcp = served.tcp().await;
    match &served.certificates {
        None => answer_over(tcp, &request).await,
        Some(it) => match tls_over(tcp, Some(&it.ca)).await {
            Ok(stream) => answer_over(stream, &request).await,
            Err(_) => String::new(),
        },
    }
}

async fn answer_over(mut stream: impl AsyncRead + AsyncWrite + Unpin, request: &str) -> String {
    let _ = stream.write_all(request.as_bytes()).await;
    read_to_end(&mut stream).await
}

const VEHICLE: &str = "/api/v1/vehicles/uav1";
const EVENTS: &str = "/api/v1/vehicles/uav1/events";

/// Strangers take every seat that there is for them, again and again; an operator is served each time. A new connection
/// may be the one that is displaced, and tries again.
#[tokio::test(flavor = "multi_thread")]
async fn strangers_in_every_seat_keep_no_operator_out() {
    for encrypted in [false, true] {
        let served = Served::start(with_limits(&[]), encrypted).await;
        let mut sitting = Vec::new();
        for _ in 0..25 {
            sitting.push(served.tcp().await);
            let start = std::time::Instant::now();
            while !try_once(&served).await.contains(" 200 OK") {
                assert!(start.elapsed() < LIMIT, "strangers keep the operator out");
            }
        }
        // Of the strangers all but four had to leave, one for each newcomer: whom the gateway has heard first, on a crowded machine not
        // always who came first.
        let mut leaving: JoinSet<String> =
            sitting.into_iter().map(|mut stream| async move { read_to_end(&mut stream).await }).collect();
        for _ in 0..21 {
            assert_eq!(leaving.join_next().await.unwrap().unwrap(), "");
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn who_has_shown_a_token_is_not_displaced() {
    let served = Served::start(with_limits(&[]), false).await;
    let mut operator = served.tcp().await;
    assert!(ask(&mut operator, VEHICLE, "operator-token", "200 OK").await.contains("200 OK"));
    let _strangers: Vec<_> = {
        let mut all = Vec::new();
        for _ in 0..30 {
            all.push(served.tcp().await);
        }
        // One that came later is answered: all have been let in.
        let start = std::time::Instant::now();
        while !ask(&mut served.tcp().await, "/healthz", "", "200 OK").await.contains("200 OK") {
            assert!(start.elapsed() < LIMIT, "no newcomer stays");
        }
        all
    };
    assert!(ask(&mut operator, VEHICLE, "operator-token", "200 OK").await.contains("200 OK"));
}

/// Then it is a stranger's connection as any other, and has to leave for newcomers.
#[tokio::test(flavor = "multi_thread")]
async fn a_connection_whose_token_runs_out_keeps_no_seat() {
    let start = std::time::Instant::now();
    // On a crowded machine it may have run out before it is shown.
    let (served, mut brief) = loop {
        let served = Served::start(with_limits(&[]), false).await;
        let mut brief = served.tcp().await;
        if ask(&mut brief, VEHICLE, "brief-token", "}").await.contains("200 OK") {
            break (served, brief);
        }
        assert!(start.elapsed() < LIMIT, "a token that is valid is refused");
    };
    let mut displaced = tokio::spawn(async move { read_to_end(&mut brief).await });
    let mut strangers = Vec::new();
    while tokio::time::timeout(ASK_AGAIN, &mut displaced).await.is_err() {
        strangers.push(served.tcp().await);
        assert!(start.elapsed() < LIMIT, "the seat is kept");
    }
}

/// Its token was valid when the order began to arrive. That the rest comes late keeps it valid no longer.
#[tokio::test(flavor = "multi_thread")]
async fn an_order_whose_token_runs_out_before_its_body_has_come_is_refused() {
    let start = std::time::Instant::now();
    let head = "POST /api/v1/vehicles/uav1/pause HTTP/1.1\r\nhost: x\r\nauthorization: Bearer brief-token\r\n\
        idempotency-key: k\r\nconnection: close\r\nexpect: 100-continue\r\ncontent-length: 2\r\n\r\n";
    // On a crowded machine it may have run out before it is shown.
    let (served, mut slow) = loop {
        let served =
            Served::start(with_limits(&[("request_timeout_s = 5.0", "request_timeout_s = 60.0")]), false).await;
        let mut slow = served.tcp().await;
        slow.write_all(head.as_bytes()).await.unwrap();
        if read_until(&mut slow, "\r\n\r\n").await.contains("100 Continue") {
            break (served, slow);
        }
        assert!(start.elapsed() < LIMIT, "a token that is valid is refused");
    };
    while !ask(&mut served.tcp().await, VEHICLE, "brief-token", "}").await.contains(" 401 ") {
        assert!(start.elapsed() < LIMIT, "the token does not run out");
    }
    slow.write_all(b"{}").await.unwrap();
    let answer = read_to_end(&mut slow).await;
    assert!(answer.contains(" 401 ") && answer.contains("the token is unknown or has expired"), "{answer}");
    assert_eq!(served.world.heard(), Vec::<String>::new());
}

#[tokio::test(flavor = "multi_thread")]
async fn one_token_has_a_number_of_connections_and_streams_and_others_are_served() {
    let limits = [
        ("connections_per_token = 2000", "connections_per_token = 3"),
        ("streams_per_token = 2000", "streams_per_token = 2"),
    ];
    let served = Served::start(with_limits(&limits), false).await;
    let mut streams = [served.tcp().await, served.tcp().await, served.tcp().await];
    for stream in &mut streams[..2] {
        assert!(ask(stream, EVENTS, "observer-token", "event: status").await.contains("200 OK"));
    }
    let refused = ask(&mut streams[2], EVENTS, "observer-token", "}").await;
    let why = "observer has 2 event streams open, the most that one token may have; close one of them";
    assert!(refused.starts_with("HTTP/1.1 429") && refused.contains(why), "{refused}");
    // The fourth connection is refused; another token's is not.
    let mut fourth = served.tcp().await;
    let refused = ask(&mut fourth, VEHICLE, "observer-token", "}").await;
    assert!(refused.starts_with("HTTP/1.1 429") && refused.contains("3 connections open"), "{refused}");
    assert!(ask(&mut fourth, EVENTS, "operator-token", "event: status").await.contains("200 OK"));
    // A stream that is closed is free again.
    let [first, ..] = streams;
    drop(first);
    let start = std::time::Instant::now();
    while !ask(&mut served.tcp().await, EVENTS, "observer-token", "}").await.contains("200 OK") {
        assert!(start.elapsed() < LIMIT, "a stream that was closed still counts");
        tokio::time::sleep(ASK_AGAIN).await;
    }
}

/// A recording that fits in no buffer.
fn write_large_file(world: &World) -> &'static str {
    std::fs::write(world.recordings.path().join(format!("{}.mcap", world::RECORDING)), vec![7; 8 << 20]).unwrap();
    "/api/v1/recordings/not-a-recording/file"
}

#[tokio::test(flavor = "multi_thread")]
async fn downloads_that_nobody_reads_do_not_keep_others_from_theirs() {
    let world = with_limits(&[]);
    let file = write_large_file(&world);
    let served = Served::start(world, false).await;
    let mut idle = [served.tcp().await, served.tcp().await, served.tcp().await];
    for stream in &mut idle[..2] {
        assert!(ask(stream, file, "observer-token", "\r\n\r\n").await.contains("200 OK"));
    }
    let refused = ask(&mut idle[2], file, "observer-token", "}").await;
    assert!(refused.starts_with("HTTP/1.1 429") && refused.contains("observer has 2 downloads open"), "{refused}");
    assert!(ask(&mut served.tcp().await, file, "operator-token", "\r\n\r\n").await.contains("200 OK"));
}

/// Neither a download nor an event stream is kept for a client that takes nothing: it is disconnected, its share is free.
#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_takes_nothing_of_what_is_sent_is_disconnected() {
    for encrypted in [false, true] {
        let world = with_limits(&[("write_timeout_s = 60.0", "write_timeout_s = 0.3")]);
        let file = write_large_file(&world);
        let served = Served::start(world, encrypted).await;
        let mut idle = Vec::new();
        for _ in 0..2 {
            let mut stream = served.connect().await;
            stream.write_all(request(&format!("GET {file}"), "").as_bytes()).await.unwrap();
            let mut first = [0; 12];
            stream.read_exact(&mut first).await.unwrap();
            assert_eq!(&first, b"HTTP/1.1 200");
            idle.push(stream);
        }
        // Both shares of this token are taken until the gateway gives up on their clients.
        let start = std::time::Instant::now();
        loop {
            let mut stream = served.connect().await;
            stream.write_all(request(&format!("GET {file}"), "").as_bytes()).await.unwrap();
            let mut first = [0; 12];
            stream.read_exact(&mut first).await.unwrap();
            if &first == b"HTTP/1.1 200" {
                break;
            }
            assert!(start.elapsed() < LIMIT, "a client that takes nothing keeps its download");
            // More requests in a row than the gateway lets one token make would be refused for that.
            tokio::time::sleep(ASK_AGAIN).await;
        }
    }
}

/// Clients that ask for much and read nothing keep a part of the memory, and leave the rest to others.
#[tokio::test(flavor = "multi_thread")]
async fn answers_that_nobody_reads_are_limited_and_others_get_theirs() {
    const DECISIONS: &str = "/api/v1/vehicles/uav1/decisions";
    const STATUS_LINE: &str = "\r\n";
    for encrypted in [false, true] {
        let world = with_limits(&[("max_connections = 10", "max_connections = 40")]);
        // As JSON it is many times as long.
        world.say(v1::DecisionRecord { text: "\u{1}".repeat(300_000), ..Default::default() });
        let served = Served::start(world, encrypted).await;
        let start = std::time::Instant::now();
        let length = loop {
            let length = served.world.get(DECISIONS, "operator").await.text.len();
            if 300_000 < length {
                break length;
            }
            assert!(start.elapsed() < LIMIT, "the decision does not arrive");
            tokio::time::sleep(ASK_AGAIN).await;
        };
        assert!((2 << 20..4 << 20).contains(&length), "{length}");
        let mut idle = Vec::new();
        loop {
            let mut stream = served.connect().await;
            let answer = ask(&mut stream, DECISIONS, "observer-token", STATUS_LINE).await;
            if answer.starts_with("HTTP/1.1 429") {
                break;
            }
            assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
            idle.push(stream);
        }
        assert_eq!(idle.len(), (8 << 20) / length, "of eight megabytes");
        let mut stream = served.connect().await;
        assert!(ask(&mut stream, VEHICLE, "observer-token", "}").await.contains("200 OK"), "small answers always come");
        let mut operator = served.connect().await;
        assert!(ask(&mut operator, DECISIONS, "operator-token", "]").await.contains("200 OK"));
        drop(idle);
        while !ask(&mut served.connect().await, DECISIONS, "observer-token", STATUS_LINE).await.contains("200 OK") {
            assert!(start.elapsed() < LIMIT, "answers of closed connections still count");
            tokio::time::sleep(ASK_AGAIN).await;
        }
    }
}
