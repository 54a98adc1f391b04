//! Traces reach a collector, and a collector that hangs delays nothing: `cargo test --features otlp --test stories telemetry`.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, Sender, channel};

use opentelemetry_proto::tonic::collector::trace::v1::ExportTraceServiceRequest;
use opentelemetry_proto::tonic::common::v1::any_value::Value;
use prost::Message;

use crate::support::{LIMIT, System, wait_for};

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
    system.wait_for("mission over: ");
    let ending = system.end();
    ending.expect(0, &["SUCCESS", "SUCCESS"]);
    assert!(start.elapsed() < LIMIT);
}

/// A span as a collector sees it.
#[derive(Debug)]
struct Span {
    service: String,
    name: String,
    trace: String,
    parent: String,
}

/// A collector that accepts everything.
fn collector() -> (String, Receiver<Span>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let endpoint = format!("http://{}", listener.local_addr().unwrap());
    let (sender, spans) = channel();
    std::thread::spawn(move || {
        for stream in listener.incoming().map_while(Result::ok) {
            let sender = sender.clone();
            std::thread::spawn(move || collect(stream, &sender));
        }
    });
    (endpoint, spans)
}

/// Each request on `stream` until it is closed.
fn collect(stream: TcpStream, sender: &Sender<Span>) -> Option<()> {
    let mut reader = BufReader::new(stream.try_clone().ok()?);
    loop {
        let body = read_request(&mut reader)?;
        let request = ExportTraceServiceRequest::decode(body.as_slice()).expect("spans are sent as OTLP");
        for of in request.resource_spans {
            let attributes = of.resource.map(|it| it.attributes).unwrap_or_default();
            let service = attributes.into_iter().find(|it| it.key == "service.name");
            let service = match service.and_then(|it| it.value?.value) {
                Some(Value::StringValue(it)) => it,
                other => panic!("a process has a name, not {other:?}"),
            };
            for span in of.scope_spans.into_iter().flat_map(|it| it.spans) {
                let (trace, parent) = (hex(&span.trace_id), hex(&span.parent_span_id));
                sender.send(Span { service: service.clone(), name: span.name, trace, parent }).ok()?;
            }
        }
        (&stream).write_all(b"HTTP/1.1 200 OK\r\ncontent-length: 0\r\n\r\n").ok()?;
    }
}

/// The body of the next request.
fn read_request(reader: &mut impl BufRead) -> Option<Vec<u8>> {
    let mut length = 0;
    loop {
        let mut line = String::new();
        (reader.read_line(&mut line).ok()? != 0).then_some(())?;
        let line = line.trim().to_ascii_lowercase();
        if line.is_empty() {
            break;
        }
        if let Some(value) = line.strip_prefix("content-length:") {
            length = value.trim().parse().ok()?;
        }
    }
    let mut body = vec![0; length];
    reader.read_exact(&mut body).ok()?;
    Some(body)
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|it| format!("{it:02x}")).collect()
}

#[test]
fn an_order_is_one_trace_from_the_request_to_the_vehicle() {
    let (endpoint, spans) = collector();
    let variables = [("OTEL_EXPORTER_OTLP_ENDPOINT", endpoint.as_str()), ("OTEL_BSP_SCHEDULE_DELAY", "100")];
    let system = System::up(&["--speed", "5"], &variables);
    system.wait_for("fly to (0, 90, 10)");
    // Otherwise the command would wait for the acknowledgement of the one before, and belong to that trace.
    wait_for("the flight to be under way", || {
        let status = system.status();
        let running = &status["skill"]["running"];
        let flies = running["kind"] == "SKILL_KIND_OFFBOARD" && running["state"] == "SKILL_STATE_EXECUTE";
        (flies && status["aircraft"]["status"]["actualMode"] == "FLIGHT_MODE_OFFBOARD").then_some(())
    });
    let link = system.link();
    let (address, token) = link.trim_start_matches("http://").split_once("/#token=").unwrap();
    let (trace, parent) = ("0af7651916cd43dd8448eb211c80319c", "b7ad6b7169203331");
    let mut stream = TcpStream::connect(address).unwrap();
    let head = format!(
        "POST /api/v1/vehicles/uav1/pause HTTP/1.1\r\nhost: {address}\r\nauthorization: Bearer {token}\r\n\
         idempotency-key: 1\r\ntraceparent: 00-{trace}-{parent}-01\r\nconnection: close\r\n\r\n"
    );
    stream.write_all(head.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 200 OK") && answer.contains("holds until resumed"), "{answer}");

    let start = std::time::Instant::now();
    let mut seen: Vec<Span> = Vec::new();
    let along_the_way = [
        ("gateway", "POST /api/v1/vehicles/{id}/pause"),
        ("mcm", "mcm/command"),
        ("skill-manager", "skill/request"),
        ("vehicle-sim", "fmu/in/vehicle_command"),
    ];
    let has = |seen: &[Span], (service, name): &(&str, &str)| {
        seen.iter().any(|span| span.service == *service && span.name == *name)
    };
    while !along_the_way.iter().all(|it| has(&seen, it)) {
        let left = LIMIT.saturating_sub(start.elapsed());
        let span = spans.recv_timeout(left).unwrap_or_else(|_| panic!("the trace has only {seen:#?}"));
        if span.trace == trace {
            seen.push(span);
        }
    }
    let request = seen.iter().find(|it| it.name == along_the_way[0].1).expect("it was waited for");
    assert_eq!(request.parent, parent, "{seen:#?}");
}
