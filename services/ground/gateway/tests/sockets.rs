//! The gateway on real sockets, plain and encrypted: which connections it answers, and which it closes.

#![expect(clippy::disallowed_methods, reason = "a test waits for what other threads do, up to a limit")]

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use gateway::config::Config;
use gateway::server::serve;
use gateway::tls::{Demand, Encryption, ShownCertificate, encryption};
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, ServerName};
use rustls::{ClientConfig, RootCertStore};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::{TcpSocket, TcpStream};
use tokio_rustls::TlsConnector;
use tokio_rustls::client::TlsStream;
use x509_parser::prelude::{FromDer, X509Certificate};

mod limits;
use crate::stories::world::certificates::Certificates;
use crate::stories::world::{self, World};

/// Longer than any limit in the tests' configuration, on a machine that is busy.
const LIMIT: Duration = Duration::from_secs(100);

trait Stream: AsyncRead + AsyncWrite + Unpin + Send {}
impl<T: AsyncRead + AsyncWrite + Unpin + Send> Stream for T {}

/// A gateway that listens; it ends with the value.
struct Served {
    address: SocketAddr,
    certificates: Option<Certificates>,
    shown: Option<Arc<ShownCertificate>>,
    world: World,
    _stop: tokio::sync::oneshot::Sender<()>,
}

impl Served {
    async fn start(world: World, encrypted: bool) -> Served {
        // As the process has it: what a client does not read stays in the gateway.
        let socket = TcpSocket::new_v4().unwrap();
        socket.set_send_buffer_size(16 * 1024).unwrap();
        socket.bind("127.0.0.1:0".parse().unwrap()).unwrap();
        let listener = socket.listen(1024).unwrap();
        let address = listener.local_addr().unwrap();
        let certificates = encrypted.then(Certificates::new);
        let tls = certificates.as_ref().and_then(|it| {
            let (certificate, key) = it.sign("server", 2020, 2120);
            let config = config(Some(&certificate), Some(&key), false);
            encryption(&config, address, Demand::Valid, SystemTime::now()).unwrap()
        });
        assert_eq!(tls.is_some(), encrypted);
        let (stop, stopped) = tokio::sync::oneshot::channel::<()>();
        let (config, shown) = tls.map(|Encryption { config, shown }| (config, shown)).unzip();
        let api = world.api.clone();
        tokio::spawn(serve(
            listener,
            config,
            api,
            Box::pin(async {
                let _ = stopped.await;
            }),
        ));
        Served { address, certificates, shown, world, _stop: stop }
    }

    /// With limits of half a second.
    async fn impatient(encrypted: bool) -> Served {
        Served::start(World::configured("request_timeout_s = 5.0", "request_timeout_s = 0.5"), encrypted).await
    }

    async fn tcp(&self) -> TcpStream {
        TcpStream::connect(self.address).await.unwrap()
    }

    /// Encrypted where the gateway is.
    async fn connect(&self) -> Box<dyn Stream> {
        match &self.certificates {
            None => Box::new(self.tcp().await),
            Some(it) => Box::new(tls_over(self.tcp().await, Some(&it.ca)).await.unwrap()),
        }
    }

    /// Everything that the gateway answers to `bytes` until it closes the connection.
    async fn answer(&self, bytes: &[u8]) -> String {
        let mut stream = self.connect().await;
        // The server may close before everything is sent.
        let _ = stream.write_all(bytes).await;
        read_to_end(&mut stream).await
    }
}

/// Encrypts as a client that trusts `ca` and no other, or none at all.
async fn tls_over(stream: TcpStream, ca: Option<&str>) -> std::io::Result<TlsStream<TcpStream>> {
    let mut roots = RootCertStore::empty();
    if let Some(ca) = ca {
        roots.add(CertificateDer::from_pem_slice(ca.as_bytes()).unwrap()).unwrap();
    }
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let builder = ClientConfig::builder_with_provider(provider).with_safe_default_protocol_versions().unwrap();
    let config = builder.with_root_certificates(roots).with_no_client_auth();
    TlsConnector::from(Arc::new(config)).connect(ServerName::try_from("127.0.0.1").unwrap(), stream).await
}

/// What arrives until the other side closes; a reset closes too.
async fn read_to_end(stream: &mut (impl AsyncRead + Unpin)) -> String {
    let mut seen = Vec::new();
    let reading = async { while stream.read_buf(&mut seen).await.is_ok_and(|it| 0 < it) {} };
    tokio::time::timeout(LIMIT, reading).await.expect("the connection is left open");
    String::from_utf8_lossy(&seen).into_owned()
}

/// A request with the safety pilot's token.
fn request(line: &str, more: &str) -> String {
    format!(
        "{line} HTTP/1.1\r\nhost: x\r\nauthorization: Bearer safety-token\r\nidempotency-key: k\r\nconnection: close\r\n{more}\r\n"
    )
}

const PAUSE: &str = "POST /api/v1/vehicles/uav1/pause";

fn config(certificate: Option<&Path>, key: Option<&Path>, plain_beyond: bool) -> Config {
    let mut config: Config = toml::from_str(world::CONFIG).unwrap();
    config.tls_certificate = certificate.map(Path::to_owned);
    config.tls_key = key.map(Path::to_owned);
    config.plain_http_beyond_loopback = plain_beyond;
    config
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_trusts_the_ca_is_answered_and_others_refuse_the_gateway() {
    let served = Served::start(World::new(), true).await;
    let answer = served.answer(request("GET /healthz", "").as_bytes()).await;
    assert!(answer.starts_with("HTTP/1.1 200 OK") && answer.contains("\"status\":\"ok\""), "{answer}");
    let answer = served.answer(request(PAUSE, "").as_bytes()).await;
    assert!(answer.starts_with("HTTP/1.1 200 OK"), "{answer}");
    let refused = tls_over(served.tcp().await, None).await.map(|_| ()).unwrap_err().to_string();
    assert!(refused.contains("UnknownIssuer"), "{refused}");
}

#[tokio::test(flavor = "multi_thread")]
async fn plain_http_gets_no_answer_where_tls_is_configured() {
    let served = Served::impatient(true).await;
    let mut stream = served.tcp().await;
    stream.write_all(request("GET /healthz", "").as_bytes()).await.unwrap();
    let answer = read_to_end(&mut stream).await;
    assert!(!answer.contains("HTTP"), "{answer}");
}

/// Each client stops in the middle, and its connection is closed; other connections go on.
#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_takes_too_long_is_disconnected() {
    for encrypted in [false, true] {
        let served = Served::impatient(encrypted).await;
        let body = request("POST /api/v1/vehicles/uav1/land-at", "content-length: 100\r\n") + "{";
        for (sent, expected) in
            [("", ""), ("GET /heal", ""), ("GET /healthz HTTP/1.1\r\nhost: x\r\n", ""), (body.as_str(), "HTTP/1.1 408")]
        {
            let answer = served.answer(sent.as_bytes()).await;
            assert!(answer.starts_with(expected), "after `{sent}`: `{answer}`");
            assert!(!expected.is_empty() || !answer.contains(" 200 "), "after `{sent}`: `{answer}`");
        }
        assert!(served.answer(request("GET /healthz", "").as_bytes()).await.contains(" 200 OK"));
    }
    // A handshake that never begins.
    let served = Served::impatient(true).await;
    assert_eq!(read_to_end(&mut served.tcp().await).await, "");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_request_that_is_too_large_or_not_http_is_refused_and_the_next_one_is_answered() {
    let ten_megabytes = "x".repeat(10_000_000);
    let declared = request(PAUSE, &format!("content-length: {}\r\n", ten_megabytes.len())) + &ten_megabytes;
    let chunked = request(PAUSE, "transfer-encoding: chunked\r\n")
        + &format!("{:x}\r\n{ten_megabytes}\r\n0\r\n\r\n", ten_megabytes.len());
    let long_head = request("GET /healthz", &format!("x: {}\r\n", "y".repeat(1_000_000)));
    let no_colon = request("GET /healthz", "no colon\r\n");
    let twice = request(PAUSE, "content-length: 1\r\ncontent-length: 2\r\n");
    for encrypted in [false, true] {
        let served = Served::impatient(encrypted).await;
        for (sent, expected) in [
            (declared.as_str(), "413"),
            (chunked.as_str(), "413"),
            (long_head.as_str(), "431"),
            (twice.as_str(), "400"),
            ("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", ""),
            ("\u{0}\u{1}\u{2}\r\n\r\n", "400"),
            ("GET\r\n\r\n", "400"),
            (no_colon.as_str(), "400"),
        ] {
            let answer = served.answer(sent.as_bytes()).await;
            let status = answer.split(' ').nth(1).unwrap_or_default();
            let what = format!("after {:?}: {answer}", &sent[..sent.len().min(200)]);
            assert!(status == expected || (expected.is_empty() && status != "200"), "{what}");
        }
        assert!(served.answer(request("GET /healthz", "").as_bytes()).await.contains(" 200 OK"));
        assert!(served.world.heard().is_empty());
    }
}

#[test]
fn certificates_and_keys_that_cannot_be_used_are_refused_in_a_sentence() {
    let files = Certificates::new();
    let (good, key) = files.sign("good", 2020, 2120);
    let (_, other_key) = files.sign("other", 2020, 2120);
    let (expired, expired_key) = files.sign("expired", 2019, 2020);
    let (early, early_key) = files.sign("early", 2119, 2120);
    let open_key = files.write("open.key", &std::fs::read_to_string(&key).unwrap(), 0o644);
    let text = files.write("text.pem", "no certificate", 0o600);
    let torn = files.write("torn.pem", "-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n", 0o600);
    let absent = Path::new("/nowhere/absent.pem");
    let (loopback, anywhere) = ("127.0.0.1:0", "0.0.0.0:0");
    #[track_caller]
    fn check(files: (Option<&Path>, Option<&Path>), plain_beyond: bool, address: &str, expected: Result<bool, &str>) {
        let config = config(files.0, files.1, plain_beyond);
        let found = encryption(&config, address.parse().unwrap(), Demand::Valid, SystemTime::now());
        match (found, expected) {
            (Ok(found), Ok(encrypted)) => assert_eq!(found.is_some(), encrypted),
            (Err(refusal), Err(part)) => {
                assert!(refusal.to_string().contains(part), "{refusal}");
                assert_eq!(refusal.to_string().lines().count(), 1);
            }
            (found, expected) => panic!("{:?}, expected {expected:?}", found.map(|it| it.is_some())),
        }
    }
    fn with<'a>(certificate: &'a Path, key: &'a Path) -> (Option<&'a Path>, Option<&'a Path>) {
        (Some(certificate), Some(key))
    }
    check(with(&good, &key), false, anywhere, Ok(true));
    check((None, None), false, loopback, Ok(false));
    check((None, None), false, "[::1]:0", Ok(false));
    check((None, None), true, anywhere, Ok(false));
    check((None, None), false, anywhere, Err("the gateway would listen on 0.0.0.0:0 without TLS"));
    check((Some(&good), None), true, loopback, Err("`tls_certificate` is given without `tls_key`"));
    check((None, Some(&key)), true, loopback, Err("`tls_key` is given without `tls_certificate`"));
    check(with(absent, &key), false, loopback, Err("absent.pem: cannot be read"));
    check(with(&good, absent), false, loopback, Err("absent.pem: cannot be read"));
    check(with(&text, &key), false, loopback, Err("text.pem: holds no certificate in PEM"));
    check(with(&torn, &key), false, loopback, Err("torn.pem: holds no valid X.509 certificate"));
    check(with(&good, &text), false, loopback, Err("text.pem: holds no private key in PEM"));
    check(
        with(&expired, &expired_key),
        false,
        loopback,
        Err("expired.pem: the certificate expired at 2020-01-01T00:00:00Z"),
    );
    check(with(&early, &early_key), false, loopback, Err("early.pem: the certificate is valid only from 2119-01-01"));
    check(with(&good, &other_key), false, loopback, Err("other.key: is not the key of the certificate in"));
    check(with(&good, &open_key), false, loopback, Err("open.key: its mode is 0644"));
}

/// Both looks that a change takes to count.
fn look_twice(shown: &ShownCertificate) {
    shown.look(SystemTime::now());
    shown.look(SystemTime::now());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_replaced_certificate_is_shown_in_the_next_handshake_and_one_that_is_none_takes_nothing_away() {
    /// The last year of the certificate that a new client is shown.
    async fn shown_until(served: &Served, ca: &str) -> i32 {
        let stream = tls_over(served.tcp().await, Some(ca)).await.unwrap();
        let chain = stream.get_ref().1.peer_certificates().unwrap();
        let (_, leaf) = X509Certificate::from_der(&chain[0]).unwrap();
        leaf.validity().not_after.to_datetime().year()
    }
    let served = Served::start(World::new(), true).await;
    let (files, shown) = (served.certificates.as_ref().unwrap(), served.shown.as_ref().unwrap());
    look_twice(shown);
    assert_eq!((shown_until(&served, &files.ca).await, shown.problem()), (2120, None));
    files.sign("server", 2020, 2130);
    shown.look(SystemTime::now());
    assert_eq!(shown_until(&served, &files.ca).await, 2120, "what is seen once may be half written");
    shown.look(SystemTime::now());
    assert_eq!((shown_until(&served, &files.ca).await, shown.problem()), (2130, None));
    let text = std::fs::read_to_string(files.path("server.pem")).unwrap();
    let (_, other_key) = files.sign("other", 2020, 2120);
    let spoil: [(&dyn Fn(), &str); 4] = [
        (&|| std::fs::write(files.path("server.pem"), &text[..text.len() / 2]).unwrap(), "holds no certificate in PEM"),
        (&|| std::fs::remove_file(files.path("server.pem")).unwrap(), "server.pem: cannot be read: No such file"),
        (&|| std::fs::write(files.path("server.pem"), "").unwrap(), "server.pem: holds no certificate in PEM"),
        (
            &|| {
                std::fs::write(files.path("server.pem"), &text).unwrap();
                std::fs::copy(&other_key, files.path("server.key")).unwrap();
            },
            "server.key: is not the key of the certificate in",
        ),
    ];
    for (spoil, said) in spoil {
        spoil();
        look_twice(shown);
        let problem = shown.problem().unwrap();
        assert!(problem.contains(said) && problem.ends_with("still serving the previous certificate"), "{problem}");
        assert_eq!(shown_until(&served, &files.ca).await, 2130);
    }
    for ((from, until), said) in [((1990, 2000), "expired at 2000"), ((2119, 2125), "is valid only from 2119")] {
        files.sign("server", from, until);
        look_twice(shown);
        let problem = shown.problem().unwrap();
        assert!(problem.contains(said) && problem.ends_with("still serving the previous certificate"), "{problem}");
        assert_eq!(shown_until(&served, &files.ca).await, 2130);
    }
    files.sign("server", 2020, 2140);
    look_twice(shown);
    assert_eq!((shown_until(&served, &files.ca).await, shown.problem()), (2140, None));
}

#[test]
fn what_is_told_of_replaced_files_is_told_until_those_of_before_are_back() {
    const SHOWN: &str = "; still serving the previous certificate";
    let files = Certificates::new();
    for (name, from, until) in
        [("good", 2020, 2120), ("newer", 2021, 2121), ("early", 2119, 2120), ("late", 2019, 2020)]
    {
        files.sign(name, from, until);
    }
    files.write("garbled.pem", "no certificate", 0o644);
    files.write("garbled.key", "no key", 0o600);
    let replace = |name: &str| {
        for kind in ["pem", "key"] {
            std::fs::copy(files.path(&format!("{name}.{kind}")), files.path(&format!("server.{kind}"))).unwrap();
        }
    };
    // The files one after the other, each seen twice, and the message for each.
    let check = |steps: &[(&str, &str)]| {
        replace("good");
        let config = config(Some(&files.path("server.pem")), Some(&files.path("server.key")), false);
        let address = "127.0.0.1:0".parse().unwrap();
        let shown = encryption(&config, address, Demand::Valid, SystemTime::now()).unwrap().unwrap().shown;
        for (name, expected) in steps {
            replace(name);
            look_twice(&shown);
            let told = shown.problem().unwrap_or_default();
            assert!(told.contains(expected) && told.is_empty() == expected.is_empty(), "{steps:?}: {name}: {told}");
            assert!(told.is_empty() || told.ends_with(SHOWN), "{told}");
        }
    };
    let (early, late, garbled) = ("is valid only from 2119", "expired at 2020", "holds no certificate in PEM");
    check(&[("early", early), ("good", "")]);
    check(&[("late", late), ("good", "")]);
    check(&[("early", early), ("late", late), ("good", "")]);
    check(&[("early", early), ("newer", ""), ("early", early), ("newer", "")]);
    check(&[("garbled", garbled), ("good", "")]);
    check(&[("garbled", garbled), ("early", early), ("good", "")]);
    check(&[("early", early), ("garbled", garbled), ("good", "")]);
    // What was refused before is as wrong as it was.
    check(&[("garbled", garbled), ("early", early), ("garbled", garbled), ("good", "")]);
}

#[test]
fn a_gateway_that_is_started_again_is_kept_away_by_no_file() {
    let files = Certificates::new();
    let (expired, expired_key) = files.sign("expired", 2019, 2020);
    let text = files.write("text.pem", "no certificate", 0o600);
    let absent = Path::new("/nowhere/absent.pem");
    let address = "127.0.0.1:0".parse().unwrap();
    // The message for these files, or why the gateway does not start.
    let start = |certificate: &Path, key: &Path, demand| {
        let encryption = encryption(&config(Some(certificate), Some(key), false), address, demand, SystemTime::now());
        let encryption = encryption.map_err(|it| it.to_string())?.unwrap();
        encryption.shown.look(SystemTime::now());
        Ok::<_, String>(encryption.shown.problem().unwrap_or_default())
    };
    #[track_caller]
    fn check(found: Result<String, String>, expected: Result<&str, &str>) {
        match (&found, expected) {
            (Ok(found), Ok(part)) | (Err(found), Err(part)) => assert!(found.contains(part), "{found}"),
            _ => panic!("{found:?}, expected {expected:?}"),
        }
    }
    let date = "expired.pem: the certificate expired at 2020-01-01T00:00:00Z; renew it";
    check(start(&expired, &expired_key, Demand::Valid), Err(date));
    check(start(&expired, &expired_key, Demand::Usable), Ok(date));
    check(start(&expired, &expired_key, Demand::Nothing), Ok(date));
    for (certificate, said) in
        [(absent, "absent.pem: cannot be read"), (&text, "text.pem: holds no certificate in PEM")]
    {
        check(start(certificate, &expired_key, Demand::Usable), Err(said));
        check(start(certificate, &expired_key, Demand::Nothing), Ok(said));
        check(start(certificate, &expired_key, Demand::Nothing), Ok("until it is mended no client gets a connection"));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_gateway_without_a_certificate_lets_clients_in_once_it_has_one() {
    let files = Certificates::new();
    let (certificate, key) = (files.path("server.pem"), files.path("server.key"));
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let config = config(Some(&certificate), Some(&key), false);
    let tls = encryption(&config, address, Demand::Nothing, SystemTime::now()).unwrap().unwrap();
    let (_stop, stopped) = tokio::sync::oneshot::channel::<()>();
    let world = World::new();
    tokio::spawn(serve(
        listener,
        Some(tls.config),
        world.api.clone(),
        Box::pin(async {
            let _ = stopped.await;
        }),
    ));
    let call = async || tls_over(TcpStream::connect(address).await.unwrap(), Some(&files.ca)).await;
    assert!(call().await.is_err(), "there is nothing to show");
    files.sign("server", 2020, 2120);
    look_twice(&tls.shown);
    assert_eq!(tls.shown.problem(), None);
    assert!(call().await.is_ok());
}
