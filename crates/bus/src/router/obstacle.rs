//! Why a link does not come up: calls the other side as zenoh would, and tells what stands in the way.
//!
//! Zenoh tries again and again and keeps the reason to itself. A call waits for others: for a name server, which may never
//! answer, and for a host that may send a byte now and then for ever. So calls are made on a thread of their own
//! ([`Inquiry`]), never in the router's loop, and each has one deadline for all of its steps.

#![expect(clippy::disallowed_methods, reason = "a call has a deadline on the wall clock")]

use std::io::{self, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::path::PathBuf;
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use credentials::called_at;
use rustls::{ClientConnection, Stream};

use crate::crossing::Side;
use crate::link_credentials;

use super::{LinkEnd, Way};

/// For a whole call: name, connection and handshake together. What takes longer is too slow for the link as well.
const LIMIT: Duration = Duration::from_secs(5);
/// A refusal of our certificate comes after our part of the handshake is done.
const SECOND_THOUGHTS: Duration = Duration::from_millis(500);

/// Finds the addresses of `host:port`. It may take as long as it likes: nobody waits for it beyond the deadline.
pub(super) type Resolver = Arc<dyn Fn(&str) -> io::Result<Vec<SocketAddr>> + Send + Sync>;

/// What may stand in the way of one end of a link, as far as this end can tell: its own credentials, or the router that it
/// calls.
#[derive(Clone)]
pub(super) struct Inquiry {
    name: String,
    side: Side,
    credentials: PathBuf,
    /// Whom it calls: `host:port`; nobody on the ground.
    address: Option<String>,
    pub(super) limit: Duration,
    pub(super) resolver: Resolver,
}

impl Inquiry {
    pub(super) fn of(link: &LinkEnd) -> Inquiry {
        let address = match &link.way {
            Way::Dial { locator, .. } => Some(locator.trim_start_matches("tls/").to_owned()),
            Way::Accept { .. } => None,
        };
        let (name, side, credentials) = (link.name(), link.side(), link.credentials.clone());
        let resolver: Resolver = Arc::new(|address| address.to_socket_addrs().map(Iterator::collect));
        Inquiry { name, side, credentials, address, limit: LIMIT, resolver }
    }

    /// Looks on a thread of its own and hands what it found to `told`, within the limit; `None`: nothing.
    ///
    /// # Errors
    /// If the operating system gives no thread.
    pub(super) fn start(&self, told: impl FnOnce(Option<String>) + Send + 'static) -> io::Result<()> {
        let inquiry = self.clone();
        std::thread::Builder::new().name("inquiry".into()).spawn(move || told(inquiry.obstacle())).map(drop)
    }

    fn obstacle(&self) -> Option<String> {
        let invalid = link_credentials::check(&self.credentials, &self.name, self.side).err();
        if let Some(invalid) = invalid.as_ref().filter(|it| it.forbids_link()) {
            return Some(invalid.to_string());
        }
        let found = self.call(self.address.as_deref()?).err()?;
        // What forbids no link is not the reason, and is said beside it.
        Some(match invalid {
            Some(it) => format!("{found}; besides, {it}"),
            None => found,
        })
    }

    fn call(&self, address: &str) -> Result<(), String> {
        let until = Deadline::after(self.limit);
        let name = address.rsplit_once(':').map_or(address, |(host, _)| host);
        let host = called_at(address)?;
        let target = resolve(&self.resolver, address, until)
            .map_err(|cause| match silent(&cause) {
                true => format!("`{name}` is not found: the name server does not answer"),
                false => format!("`{name}` is not found: {cause}"),
            })?
            .ok_or_else(|| format!("`{name}` is not found"))?;
        let no_answer = |cause: io::Error| format!("{address} does not answer: {cause}");
        let left = until.left().map_err(no_answer)?;
        let stream = TcpStream::connect_timeout(&target, left).map_err(no_answer)?;
        let mut stream = Limited { stream, until };
        let client = link_credentials::in_folder(&self.credentials).client().map_err(|invalid| invalid.to_string())?;
        let mut connection = ClientConnection::new(Arc::new(client), host).map_err(|cause| cause.to_string())?;
        while connection.is_handshaking() {
            connection.complete_io(&mut stream).map_err(|cause| self.words(&cause))?;
        }
        stream.until = Deadline::after(SECOND_THOUGHTS);
        match Stream::new(&mut connection, &mut stream).read(&mut [0]) {
            Err(cause) if !silent(&cause) => Err(self.words(&cause)),
            // It waits for zenoh's first word.
            _ => Ok(()),
        }
    }

    fn words(&self, cause: &io::Error) -> String {
        match cause.get_ref().and_then(|it| it.downcast_ref::<rustls::Error>()) {
            Some(rustls::Error::AlertReceived(alert)) => format!("it does not accept our certificate ({alert:?})"),
            Some(error @ rustls::Error::InvalidCertificate(_)) => format!("its certificate is not accepted: {error}"),
            Some(error) => format!("no encrypted connection: {error}"),
            None if silent(cause) => format!("it takes the call, and no encrypted connection within {:?}", self.limit),
            None => format!("the connection broke off: {cause}"),
        }
    }
}

/// The first address. The thread that asks is left to itself at the deadline: a name service cannot be interrupted. It gives
/// up by its own limit, and the next inquiry begins long after this one.
fn resolve(resolver: &Resolver, address: &str, until: Deadline) -> io::Result<Option<SocketAddr>> {
    let (sender, found) = mpsc::sync_channel(1);
    let (resolver, address) = (resolver.clone(), address.to_owned());
    // Fails only once nobody waits for it.
    let ask = move || drop(sender.send(resolver(&address)));
    std::thread::Builder::new().name("resolver".into()).spawn(ask)?;
    let found = found.recv_timeout(until.left()?).map_err(|_| io::Error::from(ErrorKind::TimedOut))?;
    Ok(found?.into_iter().next())
}

/// When a call is given up, whatever it waits for.
#[derive(Debug, Clone, Copy)]
struct Deadline(Instant);

impl Deadline {
    fn after(limit: Duration) -> Deadline {
        Deadline(Instant::now() + limit)
    }

    /// What is left; never zero, which would mean no limit to a socket.
    fn left(self) -> io::Result<Duration> {
        let left = self.0.saturating_duration_since(Instant::now());
        if left.is_zero() { Err(ErrorKind::TimedOut.into()) } else { Ok(left) }
    }
}

/// A connection on which no step waits beyond the deadline, however many steps there are.
struct Limited {
    stream: TcpStream,
    until: Deadline,
}

impl Read for Limited {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.stream.set_read_timeout(Some(self.until.left()?))?;
        self.stream.read(buffer)
    }
}

impl Write for Limited {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.stream.set_write_timeout(Some(self.until.left()?))?;
        self.stream.write(buffer)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

fn silent(cause: &io::Error) -> bool {
    matches!(cause.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut)
}
