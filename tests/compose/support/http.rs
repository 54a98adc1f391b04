//! Asks the gateway over a socket of the host, as little as that takes.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde_json::Value;

const LIMIT: Duration = Duration::from_secs(3);

/// Reads a document: the status and the document.
pub fn get(port: u16, path: &str, token: &str) -> io::Result<(u16, Value)> {
    ask(port, "GET", path, token)
}

/// Gives an order, for which a path is enough: the status and the answer.
pub fn post(port: u16, path: &str, token: &str) -> io::Result<(u16, Value)> {
    ask(port, "POST", path, token)
}

fn ask(port: u16, method: &str, path: &str, token: &str) -> io::Result<(u16, Value)> {
    let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
    let mut stream = TcpStream::connect_timeout(&address, LIMIT)?;
    stream.set_read_timeout(Some(LIMIT))?;
    let key = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
    write!(
        stream,
        "{method} {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nAuthorization: Bearer {token}\r\n\
         Idempotency-Key: {key}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"
    )?;
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer)?;
    let answer = String::from_utf8_lossy(&answer);
    let bad = || io::Error::other(format!("no HTTP: {answer}"));
    let (head, body) = answer.split_once("\r\n\r\n").ok_or_else(bad)?;
    let status = head.split(' ').nth(1).and_then(|it| it.parse().ok()).ok_or_else(bad)?;
    Ok((status, serde_json::from_str(body).unwrap_or_default()))
}
