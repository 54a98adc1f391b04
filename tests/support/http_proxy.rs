//! A proxy between a browser and the gateway, as people put one there, with the mistakes that they make.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::mpsc::sync_channel;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// How late the events arrive with [`Manner::Late`].
const LATE: Duration = Duration::from_secs(3);
/// More pieces of an answer than are under way at a time.
const UNDER_WAY: usize = 1000;

/// What a proxy does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Manner {
    /// It passes on what it gets.
    Honest,
    /// It answers for the gateway, in its own words.
    Unreachable,
    /// It collects an answer until that is complete: an event stream never is.
    Buffering,
    /// It passes on events as regularly as they come, and late, as the queue before a link that is too narrow does.
    Late,
    /// The gateway behind it has another page.
    Upgraded,
}

/// A proxy, for as long as it is there.
pub struct HttpProxy {
    pub address: SocketAddr,
    state: Arc<Mutex<State>>,
}

struct State {
    manner: Manner,
    open: Vec<TcpStream>,
}

impl HttpProxy {
    /// Before the gateway at `gateway`.
    pub fn before(gateway: SocketAddr) -> HttpProxy {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
        let address = listener.local_addr().expect("it has an address");
        let state = Arc::new(Mutex::new(State { manner: Manner::Honest, open: Vec::new() }));
        let shared = state.clone();
        std::thread::spawn(move || {
            for browser in listener.incoming().flatten() {
                let state = shared.clone();
                std::thread::spawn(move || {
                    let manner = {
                        let mut state = state.lock().unwrap();
                        state.open.extend(browser.try_clone());
                        state.manner
                    };
                    // A connection that is cut is the end of its request.
                    let _ = pass(browser, gateway, manner);
                });
            }
        });
        HttpProxy { address, state }
    }

    /// Does this from now on, and cuts what is under way.
    pub fn behave(&self, manner: Manner) {
        let mut state = self.state.lock().unwrap();
        state.manner = manner;
        state.open.drain(..).for_each(|it| {
            let _ = it.shutdown(Shutdown::Both);
        });
    }
}

/// One request and its answer.
fn pass(mut browser: TcpStream, gateway: SocketAddr, manner: Manner) -> std::io::Result<()> {
    let mut reader = BufReader::new(browser.try_clone()?);
    let (mut head, mut length) = (String::new(), 0);
    loop {
        let mut line = String::new();
        if reader.read_line(&mut line)? == 0 {
            return Ok(());
        }
        let (name, value) = line.split_once(':').unwrap_or((&line, ""));
        match name.to_ascii_lowercase().as_str() {
            "connection" => continue,
            // It reads and changes answers.
            "accept-encoding" if manner == Manner::Upgraded => continue,
            "content-length" => length = value.trim().parse().unwrap_or(0),
            _ => {}
        }
        if line == "\r\n" {
            break;
        }
        head += &line;
    }
    let mut body = vec![0; length];
    reader.read_exact(&mut body)?;
    if manner == Manner::Unreachable {
        let page = "<html><h1>502 Bad Gateway</h1></html>";
        let head = "HTTP/1.1 502 Bad Gateway\r\nContent-Type: text/html\r\nConnection: close\r\n";
        return write!(browser, "{head}Content-Length: {}\r\n\r\n{page}", page.len());
    }
    let mut there = TcpStream::connect(gateway)?;
    write!(there, "{head}Connection: close\r\n\r\n")?;
    there.write_all(&body)?;
    let of = |part: &str| head.lines().next().is_some_and(|it| it.contains(part));
    match manner {
        Manner::Buffering if of("/events") => {
            let mut all = Vec::new();
            there.read_to_end(&mut all)?;
            browser.write_all(&all)
        }
        Manner::Late if of("/events") => pass_late(there, &mut browser),
        Manner::Upgraded if of("/session") => {
            let mut all = String::new();
            there.read_to_string(&mut all)?;
            let (before, after) = all.split_once("\"page\":\"").unwrap_or((&all, ""));
            write!(browser, "{before}\"page\":\"{}{}", "0".repeat(16), &after[16.min(after.len())..])
        }
        _ => std::io::copy(&mut there, &mut browser).map(drop),
    }
}

/// Passes on each piece of the answer a while after it has come.
fn pass_late(mut there: TcpStream, browser: &mut TcpStream) -> std::io::Result<()> {
    let (sender, pieces) = sync_channel(UNDER_WAY);
    std::thread::spawn(move || {
        let mut piece = [0; 8192];
        while let Ok(length @ 1..) = there.read(&mut piece) {
            if sender.send((Instant::now() + LATE, piece[..length].to_vec())).is_err() {
                return;
            }
        }
    });
    for (due, piece) in pieces {
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        browser.write_all(&piece)?;
    }
    Ok(())
}
