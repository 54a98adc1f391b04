//! Many clients of an event stream, over real sockets.

use std::net::SocketAddr;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, Mutex};

use nix::sys::resource::{Resource, getrlimit, setrlimit};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;
use tokio::runtime::{Builder, Runtime};

/// Clients that read as fast as they can. They leave with the value.
pub struct Crowd {
    _runtime: Runtime,
    counts: Arc<Counts>,
}

/// What all clients have received together.
#[derive(Default)]
struct Counts {
    /// Clients that have received a status.
    served: AtomicUsize,
    /// The last words to each client that was refused, or whose stream has ended.
    gone: Mutex<Vec<String>>,
    statuses: AtomicUsize,
    decisions: AtomicUsize,
}

impl Crowd {
    /// `size` clients that send `request`.
    pub fn gather(size: usize, address: SocketAddr, request: &str) -> Crowd {
        let runtime =
            Builder::new_multi_thread().worker_threads(1).enable_all().build().expect("a runtime can be made");
        let counts = Arc::new(Counts::default());
        for _ in 0..size {
            let (request, counts) = (request.to_owned(), counts.clone());
            runtime.spawn(async move {
                let end = listen(address, &request, &counts).await;
                counts.gone.lock().unwrap().push(end.unwrap_or_else(|cause| cause.to_string()));
            });
        }
        Crowd { _runtime: runtime, counts }
    }

    /// Clients that have received a status.
    pub fn served(&self) -> usize {
        self.counts.served.load(Relaxed)
    }

    /// The last words to the first client that was refused, or whose stream has ended.
    pub fn gone(&self) -> Option<String> {
        self.counts.gone.lock().unwrap().first().cloned()
    }

    /// Statuses that all clients have received.
    pub fn statuses(&self) -> usize {
        self.counts.statuses.load(Relaxed)
    }

    /// Decisions that all clients have received.
    pub fn decisions(&self) -> usize {
        self.counts.decisions.load(Relaxed)
    }
}

/// Counts events until the stream ends, and returns the last bytes.
async fn listen(address: SocketAddr, request: &str, counts: &Counts) -> std::io::Result<String> {
    let mut stream = TcpStream::connect(address).await?;
    stream.write_all(request.as_bytes()).await?;
    let mut bytes = vec![0; 64 * 1024];
    let (mut kept, mut last, mut served) = (0, 0, false);
    loop {
        let read = stream.read(&mut bytes[kept..]).await?;
        if read == 0 {
            return Ok(String::from_utf8_lossy(&bytes[..last]).into_owned());
        }
        let all = &bytes[..kept + read];
        // The type of an event stands in a line of its own.
        let lines = all.iter().enumerate().filter(|(_, it)| **it == b'\n').map(|(at, _)| &all[at..]);
        let (mut statuses, mut decisions) = (0, 0);
        for line in lines {
            statuses += usize::from(line.starts_with(STATUS));
            decisions += usize::from(line.starts_with(DECISION));
        }
        counts.statuses.fetch_add(statuses, Relaxed);
        counts.decisions.fetch_add(decisions, Relaxed);
        if 0 < statuses && !std::mem::replace(&mut served, true) {
            counts.served.fetch_add(1, Relaxed);
        }
        // The end may be the beginning of such a line; it is too short to be counted twice.
        let tail = all.len() - (STATUS.len() - 1).min(all.len())..all.len();
        (kept, last) = (tail.len(), all.len());
        bytes.copy_within(tail, 0);
    }
}

const STATUS: &[u8] = b"\nevent: status";
/// As long as `STATUS`, so that neither is cut or counted twice.
const DECISION: &[u8] = b"\nevent: decisi";

/// Raises this process's limit of open sockets; returns the new limit.
pub fn raise_socket_limit() -> u64 {
    let (_, hard) = getrlimit(Resource::RLIMIT_NOFILE).expect("the limit can be read");
    let wanted = hard.min(8192);
    setrlimit(Resource::RLIMIT_NOFILE, wanted, hard).expect("the limit can be raised up to the hard one");
    wanted
}
