//! Requests to the gateway over plain sockets, so that a test can be a slow or hostile client.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::atomic::{AtomicU32, Ordering};

use serde_json::Value;

use super::{LIMIT, System, wait_for};

/// The gateway of a system, with the token of its link.
pub struct Http {
    pub address: SocketAddr,
    pub token: String,
}

/// An answer.
pub struct Answer {
    pub status: u16,
    pub head: String,
    pub body: Vec<u8>,
}

impl System {
    /// The system's gateway.
    pub fn http(&self) -> Http {
        let link = self.link();
        let (address, token) = link.trim_start_matches("http://").split_once("/#token=").expect("a link has a token");
        Http { address: address.parse().expect("an address"), token: token.to_owned() }
    }
}

impl Http {
    /// Reads a resource.
    #[track_caller]
    pub fn get(&self, path: &str) -> Answer {
        self.send(&self.head("GET", path, ""))
    }

    /// Reads a document.
    #[track_caller]
    pub fn json(&self, path: &str) -> Value {
        let answer = self.get(path);
        let text = String::from_utf8_lossy(&answer.body);
        assert_eq!(answer.status, 200, "{path}: {text}");
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{path}: {error} in {text}"))
    }

    /// Waits until the gateway's health tells a problem in these words.
    #[track_caller]
    pub fn wait_for_problem(&self, words: &str) {
        wait_for(&format!("the health to tell `{words}`"), || {
            let health = self.json("/healthz");
            (health["status"] == "degraded" && health["problems"].to_string().contains(words)).then_some(())
        });
    }

    /// The head of a request; `more` are lines that end with `\r\n`.
    pub fn head(&self, method: &str, path: &str, more: &str) -> String {
        format!(
            "{method} {path} HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {}\r\nConnection: close\r\n{more}\r\n",
            self.token
        )
    }

    /// Gives an order, with `body` or without, and expects that it is carried out. No program is started for it: on a machine with too much
    /// to do that may take longer than what the order is for.
    #[track_caller]
    pub fn order(&self, path: &str, body: &str) {
        let answer = answer(&mut self.ask(path, body));
        assert_eq!(answer.status, 200, "{path}: {}", String::from_utf8_lossy(&answer.body));
    }

    /// Sends an order. Its answer comes on the connection, unless the system ends by it first.
    #[track_caller]
    pub fn ask(&self, path: &str, body: &str) -> TcpStream {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let key = NUMBER.fetch_add(1, Ordering::Relaxed);
        let of_body = format!("Content-Type: application/json\r\nContent-Length: {}\r\n", body.len());
        let head = self.head("POST", path, &format!("Idempotency-Key: story-{key}\r\n{of_body}"));
        let mut stream = self.connect();
        // A gateway that refuses stops reading.
        let _ = stream.write_all((head + body).as_bytes());
        stream
    }

    /// Sends a request as it stands and reads the answer to its end.
    #[track_caller]
    pub fn send(&self, request: &str) -> Answer {
        let mut stream = self.connect();
        // A gateway that refuses stops reading.
        let _ = stream.write_all(request.as_bytes());
        answer(&mut stream)
    }

    /// A connection without a request yet.
    #[track_caller]
    pub fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).expect("the gateway listens");
        stream.set_read_timeout(Some(LIMIT)).expect("a limit can be set");
        stream
    }
}

/// Reads an answer to its end.
#[track_caller]
pub fn answer(stream: &mut TcpStream) -> Answer {
    let mut bytes = Vec::new();
    // A connection that is reset after the answer still counts.
    let _ = stream.read_to_end(&mut bytes);
    let end = bytes.windows(4).position(|it| it == b"\r\n\r\n");
    let end = end.unwrap_or_else(|| panic!("no answer: {}", String::from_utf8_lossy(&bytes)));
    let head = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let status = head.split(' ').nth(1).and_then(|it| it.parse().ok()).expect("an answer has a status");
    Answer { status, head, body: bytes.split_off(end + 4) }
}
