//! How much memory event streams take that nobody reads: all that there may be at a time, encrypted, on real sockets.
//!
//! The test starts itself in a process of its own: other tests beside it would count as well.

#![expect(clippy::disallowed_methods, reason = "a test waits for what other threads do, up to a limit")]

use std::io::ErrorKind;
use std::net::SocketAddr;
use std::process::Command;
use std::sync::Arc;
use std::time::SystemTime;

use gateway::server::serve;
use gateway::tls::{Demand, encryption};
use kittiwake_proto::v1::DecisionRecord;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, ServerName};
use rustls::{ClientConfig, RootCertStore};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::{TcpSocket, TcpStream};
use tokio_rustls::TlsConnector;

use crate::stories::world::certificates::Certificates;
use crate::stories::world::{self, World};

/// As many as the shipped configuration allows.
const STREAMS: usize = 2000;
/// What the system buffers for each client, as the process has it (`sockets`).
const BUFFER: u32 = 16 * 1024;
/// Bytes of a decision's text: several times an ordinary one.
const TEXT: usize = 1000;
/// Decisions between two clients, so that no two of them wait for the same.
const BETWEEN: u64 = 8;
/// Megabytes that the streams may take of this process's memory: 64 KiB each, which is 46 KiB where nothing else runs and 51 KiB where much
/// does, unoptimised. What the system buffers is not among them.
const MOST_MB: u64 = 125;

/// A gateway that listens, and what its clients need.
struct Served {
    address: SocketAddr,
    connector: TlsConnector,
    world: World,
    said: u64,
    _certificates: Certificates,
    _stop: tokio::sync::oneshot::Sender<()>,
}

impl Served {
    fn start() -> Served {
        let world = World::configured_with(&[
            ("max_connections = 10", "max_connections = 2500"),
            ("requests_at_once = 1000.0", "requests_at_once = 5000.0"),
            ("head_timeout_s = 0.5", "head_timeout_s = 600.0"),
            // Who takes nothing is disconnected otherwise, but one byte now and then would do.
            ("write_timeout_s = 60.0", "write_timeout_s = 3600.0"),
            ("history_records = 100", "history_records = 4096"),
        ]);
        let socket = TcpSocket::new_v4().unwrap();
        socket.set_send_buffer_size(BUFFER).unwrap();
        socket.set_recv_buffer_size(BUFFER).unwrap();
        socket.bind("127.0.0.1:0".parse().unwrap()).unwrap();
        let listener = socket.listen(1024).unwrap();
        let address = listener.local_addr().unwrap();
        let certificates = Certificates::new();
        let (certificate, key) = certificates.sign("server", 2020, 2120);
        let mut config: gateway::config::Config = toml::from_str(world::CONFIG).unwrap();
        (config.tls_certificate, config.tls_key) = (Some(certificate), Some(key));
        let tls = encryption(&config, address, Demand::Valid, SystemTime::now()).unwrap().unwrap();
        let (stop, stopped) = tokio::sync::oneshot::channel::<()>();
        tokio::spawn(serve(
            listener,
            Some(tls.config),
            world.api.clone(),
            Box::pin(async {
                let _ = stopped.await;
            }),
        ));
        let connector = connector(&certificates.ca);
        Served { address, connector, world, said: 0, _certificates: certificates, _stop: stop }
    }

    /// The aircraft decides this many times more.
    fn decide(&mut self, count: u64) {
        for _ in 0..count {
            self.said += 1;
            let text = "x".repeat(TEXT);
            self.world.say(DecisionRecord { sequence: self.said, text, ..Default::default() });
        }
    }

    /// A client whose event stream has begun.
    async fn stream(&self) -> tokio_rustls::client::TlsStream<TcpStream> {
        let socket = TcpSocket::new_v4().unwrap();
        // The less fits there, the more stays in the gateway.
        socket.set_recv_buffer_size(4096).unwrap();
        let stream = socket.connect(self.address).await.unwrap();
        let name = ServerName::try_from("127.0.0.1").unwrap();
        let mut stream = self.connector.connect(name, stream).await.unwrap();
        begin(&mut stream).await;
        stream
    }
}

fn connector(ca: &str) -> TlsConnector {
    let mut roots = RootCertStore::empty();
    roots.add(CertificateDer::from_pem_slice(ca.as_bytes()).unwrap()).unwrap();
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let builder = ClientConfig::builder_with_provider(provider).with_safe_default_protocol_versions().unwrap();
    TlsConnector::from(Arc::new(builder.with_root_certificates(roots).with_no_client_auth()))
}

async fn begin(stream: &mut (impl AsyncRead + AsyncWrite + Unpin)) {
    let request =
        "GET /api/v1/vehicles/uav1/events HTTP/1.1\r\nhost: x\r\nauthorization: Bearer operator-token\r\n\r\n";
    stream.write_all(request.as_bytes()).await.unwrap();
    let mut first = [0; 12];
    stream.read_exact(&mut first).await.unwrap();
    assert_eq!(&first, b"HTTP/1.1 200");
}

/// Reads on until the decision with this number has come.
async fn read_up_to(stream: &mut (impl AsyncRead + Unpin), number: u64) {
    let (mut seen, wanted) = (Vec::new(), format!("\"sequence\":\"{number}\""));
    while !String::from_utf8_lossy(&seen).contains(&wanted) {
        seen.drain(..seen.len().saturating_sub(wanted.len()));
        assert!(0 < stream.read_buf(&mut seen).await.unwrap(), "the stream goes on");
    }
}

/// Bytes that have arrived for all of them.
fn arrived(clients: &[std::net::TcpStream]) -> usize {
    let mut piece = vec![0; 256 * 1024];
    let mut of = |it: &std::net::TcpStream| match it.peek(&mut piece) {
        Err(nothing_yet) if nothing_yet.kind() == ErrorKind::WouldBlock => 0,
        found => found.expect("it is still connected"),
    };
    clients.iter().map(&mut of).sum()
}

/// Resident memory of this process, in megabytes.
fn memory_mb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|it| it.strip_prefix("VmRSS:")).expect("a process has memory");
    line.trim().trim_end_matches(" kB").parse::<u64>().expect("a number") / 1024
}

/// Names the process in which the test runs alone.
const ALONE: &str = "KITTIWAKE_TEST_ALONE";

#[test]
fn as_many_unread_event_streams_as_there_may_be_take_a_bounded_memory() {
    if std::env::var_os(ALONE).is_none() {
        let name = "stories::unread::as_many_unread_event_streams_as_there_may_be_take_a_bounded_memory";
        let mut program = Command::new(std::env::current_exe().unwrap());
        let output = program.args(["--exact", name, "--nocapture"]).env(ALONE, "1").output().unwrap();
        let printed = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
        assert!(output.status.success() && printed.contains("1 passed"), "{printed}");
        return;
    }
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().unwrap();
    runtime.block_on(streams_take_a_bounded_memory());
}

async fn streams_take_a_bounded_memory() {
    // A client and a server in one process, and what it has itself.
    let (wanted, room) = (2 * STREAMS as u64 + 50, gateway::sockets::make_room(2 * STREAMS as u64 + 50).unwrap());
    assert!(wanted <= room, "it needs {wanted} descriptors, and may have {room}: ulimit -Hn");
    let mut served = Served::start();
    let mut witness = served.stream().await;
    served.decide(4096);
    read_up_to(&mut witness, served.said).await;
    let before = memory_mb();
    let mut clients = Vec::new();
    for _ in 1..STREAMS {
        // Only the socket is kept: the client's side of the encryption is not to count.
        let stream = served.stream().await.into_inner().0;
        clients.push(stream.into_std().unwrap());
        served.decide(BETWEEN);
        read_up_to(&mut witness, served.said).await;
    }
    // Until nothing more arrives while somebody who reads gets what happens.
    let mut had = (0, 0);
    while had.1 < 3 {
        served.decide(BETWEEN);
        read_up_to(&mut witness, served.said).await;
        let now = arrived(&clients);
        had = (now, if now == had.0 { had.1 + 1 } else { 0 });
    }
    let after = memory_mb();
    eprintln!("{before} MB before, {after} MB with {STREAMS} streams that nobody reads");
    assert!(after < before + MOST_MB, "{before} MB before and {after} MB after");
}
