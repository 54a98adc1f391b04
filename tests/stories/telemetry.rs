//! Traces reach a collector, and a collector that hangs is in nobody's way.

use std::io::{BufRead, BufReader};
use std::net::{TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, channel};

use crate::support::{LIMIT, System};

/// A collector that takes every connection, reads each request's first line and never answers.
fn hanging_collector() -> (String, Receiver<String>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let endpoint = format!("http://{}", listener.local_addr().unwrap());
    let (sender, requests) = channel();
    std::thread::spawn(move || {
        let mut open: Vec<TcpStream> = Vec::new();
        for stream in listener.incoming().map_while(Result::ok) {
            let mut line = String::new();
            let reading = stream.try_clone().map(|it| BufReader::new(it).read_line(&mut line));
            open.push(stream);
            if reading.is_err() || sender.send(line).is_err() {
                return;
            }
        }
    });
    (endpoint, requests)
}

#[test]
fn a_hanging_collector_gets_traces_and_delays_nothing() {
    let (endpoint, requests) = hanging_collector();
    let system = System::start_with(&[], &[("OTEL_EXPORTER_OTLP_ENDPOINT", &endpoint)]);
    let request = requests.recv_timeout(LIMIT).expect("traces are exported");
    assert!(request.starts_with("POST /v1/traces "), "{request}");
    let start = std::time::Instant::now();
    system.wait_for("mission: over");
    let ending = system.end();
    ending.expect(0, &["SUCCESS", "SUCCESS"]);
    assert!(start.elapsed() < LIMIT);
}
