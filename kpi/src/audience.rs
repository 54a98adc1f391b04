//! Clients of the gateway's event stream, and what reaches them how late.

use std::net::SocketAddr;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex};

use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader};
use tokio::net::TcpStream;
use tokio::runtime::{Builder, Runtime};

/// Marks a decision that was made for this measurement; its stamp follows.
pub(crate) const MARK: &str = "operator-kpi ";

/// Clients that read as fast as they can. They leave with the value.
pub(crate) struct Audience {
    runtime: Runtime,
    seen: Arc<Seen>,
}

/// What they have seen together.
#[derive(Default)]
struct Seen {
    /// Clients that have had a status.
    served: AtomicU64,
    /// Clients whose stream has ended.
    gone: AtomicU64,
    events: AtomicU64,
    resyncs: AtomicU64,
    /// From the stamp in a decision to its arrival, in milliseconds.
    latencies_ms: Mutex<Vec<f64>>,
}

/// What was seen up to a moment.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Count {
    pub served: u64,
    pub gone: u64,
    pub events: u64,
    pub resyncs: u64,
}

impl Audience {
    /// Nobody yet.
    pub(crate) fn new() -> Result<Audience, String> {
        let runtime = Builder::new_multi_thread().worker_threads(1).enable_all().build();
        Ok(Audience { runtime: runtime.map_err(|it| it.to_string())?, seen: Arc::default() })
    }

    /// One more client.
    pub(crate) fn join(&self, address: SocketAddr, vehicle: &str, token: &str) {
        let seen = self.seen.clone();
        let request = format!(
            "GET /api/v1/vehicles/{vehicle}/events HTTP/1.1\r\nHost: {address}\r\nAuthorization: Bearer {token}\r\n\r\n"
        );
        self.runtime.spawn(async move {
            // Its end is counted, however it came.
            let _ = listen(address, &request, &seen).await;
            seen.gone.fetch_add(1, Relaxed);
        });
    }

    /// So far.
    pub(crate) fn count(&self) -> Count {
        let seen = &self.seen;
        Count {
            served: seen.served.load(Relaxed),
            gone: seen.gone.load(Relaxed),
            events: seen.events.load(Relaxed),
            resyncs: seen.resyncs.load(Relaxed),
        }
    }

    /// The latencies since the last time.
    pub(crate) fn take_latencies_ms(&self) -> Vec<f64> {
        std::mem::take(&mut *self.seen.latencies_ms.lock().unwrap_or_else(|poisoned| poisoned.into_inner()))
    }
}

async fn listen(address: SocketAddr, request: &str, seen: &Seen) -> std::io::Result<()> {
    let mut stream = TcpStream::connect(address).await?;
    stream.write_all(request.as_bytes()).await?;
    let mut reader = BufReader::with_capacity(64 * 1024, stream);
    let (mut line, mut served) = (Vec::new(), false);
    while 0 < reader.read_until(b'\n', &mut line).await? {
        match line.strip_prefix(b"event: ").map(|it| it.trim_ascii_end()) {
            Some(b"status") if !served => {
                served = true;
                seen.served.fetch_add(1, Relaxed);
            }
            Some(b"resync") => {
                seen.resyncs.fetch_add(1, Relaxed);
            }
            _ => {}
        }
        if let Some(stamp) = stamp_in(&line) {
            let latency_ms = bus::monotonic_ns().saturating_sub(stamp) as f64 / 1e6;
            seen.events.fetch_add(1, Relaxed);
            seen.latencies_ms.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).push(latency_ms);
        }
        line.clear();
    }
    Ok(())
}

/// The stamp of a marked decision, in nanoseconds of the monotonic clock.
fn stamp_in(line: &[u8]) -> Option<u64> {
    // A status is a hundred times as long as such a record.
    let record = line.strip_prefix(b"data: ").filter(|it| it.len() < 1000)?;
    let (_, rest) = std::str::from_utf8(record).ok()?.split_once(MARK)?;
    rest.split('"').next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stamp_is_found_in_a_decision_and_nowhere_else() {
        #[track_caller]
        fn check(line: &str, expected: Option<u64>) {
            assert_eq!(stamp_in(line.as_bytes()), expected);
        }
        check("data: {\"text\":\"operator-kpi 123\",\"sequence\":\"1\"}\n", Some(123));
        check("data: {\"text\":\"takeoff\"}\n", None);
        check("event: decision\n", None);
        check(&format!("data: {}operator-kpi 1\"", " ".repeat(2000)), None);
    }
}
