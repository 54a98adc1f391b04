//! Two ends in one process, over real sockets, as zenoh uses them.

#![expect(clippy::disallowed_methods, reason = "a test waits for what other threads do, up to a limit")]

use std::collections::{BTreeMap, VecDeque};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Duration;

use flume::Receiver;
use rcgen::{
    BasicConstraints, CertificateParams, CertificateRevocationListParams, DnType, IsCa, Issuer, KeyIdMethod, KeyPair,
    RevokedCertParams, SerialNumber, date_time_ymd,
};
use tokio::net::{TcpSocket, TcpStream};
use tokio::time::timeout;
use zenoh_link_commons::{ConfigurationInspector, LinkManagerUnicastTrait, LinkUnicast};
use zenoh_link_tls::{LinkManagerUnicastTls, TlsConfigurator};
use zenoh_protocol::core::EndPoint;

/// What should happen happens sooner; what lasts longer counts as stuck.
const LIMIT: Duration = Duration::from_secs(60);

/// An authority with its certificates in a folder.
struct Authority {
    folder: tempfile::TempDir,
    issuer: Issuer<'static, KeyPair>,
    /// The serial number of the newest certificate of each name.
    serials: Mutex<BTreeMap<String, u64>>,
}

impl Authority {
    fn new() -> Authority {
        let folder = tempfile::tempdir().unwrap();
        let key = KeyPair::generate().unwrap();
        let mut params = CertificateParams::new(Vec::new()).unwrap();
        params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        std::fs::write(folder.path().join("authority.pem"), params.self_signed(&key).unwrap().pem()).unwrap();
        Authority { folder, issuer: Issuer::new(params, key), serials: Mutex::default() }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Makes the certificate of `name` in its files, with this common name and valid up to then.
    fn issue(&self, name: &str, common_name: &str, until: Option<Duration>) {
        let mut params = CertificateParams::new(["localhost", "::1"].map(String::from)).unwrap();
        params.distinguished_name.push(DnType::CommonName, common_name);
        let serial = {
            let mut serials = self.serials.lock().unwrap();
            let serial = 1 + serials.values().max().copied().unwrap_or(0);
            serials.insert(name.to_owned(), serial);
            serial
        };
        params.serial_number = Some(SerialNumber::from(serial));
        if let Some(left) = until {
            params.not_after = (std::time::SystemTime::now() + left).into();
        }
        let key = KeyPair::generate().unwrap();
        let certificate = params.signed_by(&key, &self.issuer).unwrap();
        self.replace(&format!("{name}.key"), &key.serialize_pem());
        self.replace(&format!("{name}.pem"), &certificate.pem());
    }

    /// Atomically: nobody reads half a file.
    fn replace(&self, file: &str, text: &str) {
        let unfinished = self.path(&format!("{file}.part"));
        std::fs::write(&unfinished, text).unwrap();
        std::fs::rename(unfinished, self.path(file)).unwrap();
    }

    /// Revokes the newest certificates of these, and no others.
    fn revoke(&self, names: &[&str]) {
        let revoked = |name: &&str| RevokedCertParams {
            serial_number: SerialNumber::from(self.serials.lock().unwrap()[*name]),
            revocation_time: date_time_ymd(2026, 1, 1),
            reason_code: None,
            invalidity_date: None,
        };
        let list = CertificateRevocationListParams {
            this_update: date_time_ymd(2026, 1, 1),
            next_update: date_time_ymd(2036, 1, 1),
            crl_number: SerialNumber::from(1),
            issuing_distribution_point: None,
            revoked_certs: names.iter().map(revoked).collect(),
            key_identifier_method: KeyIdMethod::Sha256,
        };
        self.replace("revoked.pem", &list.signed_by(&self.issuer).unwrap().pem().unwrap());
    }

    /// The endpoint `locator` for somebody of this name, whose certificate is valid up to then.
    fn endpoint(&self, locator: &str, name: &str, until: Option<Duration>) -> EndPoint {
        self.issue(name, name, until);
        self.endpoint_of(locator, name)
    }

    /// The same with the certificate that is there.
    fn endpoint_of(&self, locator: &str, name: &str) -> EndPoint {
        let (certificate_path, key_path) = (self.path(&format!("{name}.pem")), self.path(&format!("{name}.key")));
        let mut config = zenoh_config::Config::default();
        let mut set = |key: &str, value: &PathBuf| {
            let key = format!("transport/link/tls/{key}");
            config.insert_json5(&key, &format!("{value:?}")).unwrap();
        };
        set("root_ca_certificate", &self.path("authority.pem"));
        for end in ["listen", "connect"] {
            set(&format!("{end}_certificate"), &certificate_path);
            set(&format!("{end}_private_key"), &key_path);
        }
        config.insert_json5("transport/link/tls/so_sndbuf", "2048").unwrap();
        let settings = TlsConfigurator.inspect_config(&config).unwrap();
        format!("{locator}#{settings}").parse().unwrap()
    }
}

/// Somebody who listens, and who has called.
struct Ground {
    manager: LinkManagerUnicastTls,
    callers: Receiver<LinkUnicast>,
    locator: String,
}

impl Ground {
    async fn listen(authority: &Authority, until: Option<Duration>) -> Ground {
        Ground::listen_at("tls/localhost:0", authority, until).await
    }

    async fn listen_at(locator: &str, authority: &Authority, until: Option<Duration>) -> Ground {
        let (sender, callers) = flume::unbounded();
        let manager = LinkManagerUnicastTls::new(sender);
        let locator = manager.new_listener(authority.endpoint(locator, "ground", until)).await.unwrap();
        Ground { manager, callers, locator: locator.to_string() }
    }

    async fn address(&self) -> SocketAddr {
        let host = self.locator.trim_start_matches("tls/");
        tokio::net::lookup_host(host).await.unwrap().find(SocketAddr::is_ipv4).unwrap()
    }

    /// Both ends of a link: that of the ground, and that of who calls.
    async fn called_by(&self, authority: &Authority, name: &str) -> (LinkUnicast, LinkUnicast) {
        let caller = call(authority.endpoint(&self.locator, name, None)).await.unwrap();
        (timeout(LIMIT, self.callers.recv_async()).await.unwrap().unwrap(), caller)
    }
}

async fn call(endpoint: EndPoint) -> Result<LinkUnicast, String> {
    let manager = LinkManagerUnicastTls::new(flume::unbounded().0);
    timeout(LIMIT, manager.new_link(endpoint)).await.unwrap().map_err(|cause| cause.to_string())
}

/// Message `number`, whose length varies.
fn message(number: u32) -> Vec<u8> {
    number.to_le_bytes().repeat(1 + number as usize % 97)
}

async fn say(link: LinkUnicast, count: u32) {
    for number in 0..count {
        link.write_all(&message(number), None).await.unwrap();
    }
}

async fn hear(link: LinkUnicast, count: u32) {
    for number in 0..count {
        let expected = message(number);
        let mut found = vec![0; expected.len()];
        link.read_exact(&mut found, None).await.unwrap();
        assert!(found == expected, "message {number}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn both_directions_are_used_at_once() {
    const COUNT: u32 = 100_000;
    let authority = Authority::new();
    let ground = Ground::listen(&authority, None).await;
    let (one, other) = ground.called_by(&authority, "uav1").await;
    let tasks = [
        tokio::spawn(say(one.clone(), COUNT)),
        tokio::spawn(hear(one, COUNT)),
        tokio::spawn(say(other.clone(), COUNT)),
        tokio::spawn(hear(other, COUNT)),
    ];
    for task in tasks {
        timeout(LIMIT, task).await.expect("no end is stuck").unwrap();
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn each_end_knows_the_others_name() {
    let authority = Authority::new();
    let ground = Ground::listen(&authority, None).await;
    let (one, other) = ground.called_by(&authority, "uav1").await;
    assert_eq!(one.get_auth_id().get_cert_common_name(), Some("uav1"));
    assert_eq!(other.get_auth_id().get_cert_common_name(), Some("ground"));
    assert_eq!((one.get_src(), one.get_dst()), (other.get_dst(), other.get_src()));
    assert_eq!(
        ground.manager.get_locators().await.iter().map(ToString::to_string).collect::<Vec<_>>(),
        [ground.locator]
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs a loopback of IPv6: .ci/long ipv6"]
async fn a_host_may_be_an_address_of_ipv6() {
    let authority = Authority::new();
    let ground = Ground::listen_at("tls/[::1]:0", &authority, None).await;
    let (one, other) = ground.called_by(&authority, "uav1").await;
    say(one, 3).await;
    hear(other, 3).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_stranger_is_not_let_in_and_lets_nobody_in() {
    let (authority, another) = (Authority::new(), Authority::new());
    let ground = Ground::listen(&authority, None).await;
    let refused = call(another.endpoint(&ground.locator, "uav1", None)).await.unwrap_err();
    assert!(refused.contains("invalid peer certificate"), "{refused}");
    // One who trusts the ground, and whom the ground does not: it hears of that when it reads.
    let stranger = another.endpoint(&ground.locator, "uav2", None);
    std::fs::copy(authority.path("authority.pem"), another.path("authority.pem")).unwrap();
    let link = call(stranger).await.unwrap();
    let refused = timeout(LIMIT, link.read_exact(&mut [0], None)).await.unwrap().unwrap_err().to_string();
    assert!(refused.contains("UnknownCA") || refused.contains("DecryptError"), "{refused}");
    assert!(ground.callers.is_empty());
}

/// A connection that takes nothing, filled until a write has to wait.
async fn stuck(writer: &LinkUnicast) -> (usize, tokio::task::JoinHandle<String>) {
    let (sender, taken) = flume::unbounded();
    let link = writer.clone();
    let write = tokio::spawn(async move {
        loop {
            match link.write_all(&[7; 800], None).await {
                Ok(()) => sender.send(()).unwrap(),
                Err(cause) => return cause.to_string(),
            }
        }
    });
    let mut count = 0;
    // After this time it counts as waiting: the loopback takes nothing later than at once.
    while timeout(Duration::from_millis(500), taken.recv_async()).await.is_ok() {
        count += 1;
    }
    (count * 800, write)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_writer_into_a_link_that_takes_nothing_is_let_go_when_it_is_closed() {
    let authority = Authority::new();
    let ground = Ground::listen(&authority, None).await;
    let (one, other) = ground.called_by(&authority, "uav1").await;
    let (_, write) = stuck(&one).await;
    let reader = one.clone();
    let read = tokio::spawn(async move { reader.read_exact(&mut [0], None).await.unwrap_err().to_string() });
    one.close().await.unwrap();
    for end in [write, read] {
        let cause = timeout(LIMIT, end).await.expect("it is let go").unwrap();
        assert!(cause.contains(&one.get_dst().to_string()), "{cause}");
    }
    assert!(
        timeout(LIMIT, async { while other.read(&mut [0; 4096], None).await.is_ok_and(|it| 0 < it) {} }).await.is_ok()
    );
    one.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_was_written_is_out_of_our_hands() {
    let authority = Authority::new();
    let ground = Ground::listen(&authority, None).await;
    let (one, other) = ground.called_by(&authority, "uav1").await;
    let (written, write) = stuck(&one).await;
    // Bytes that are on the socket and not read yet are all there is: whatever was written arrives without
    // another write. Were it in a buffer of the connection's, the last would not.
    let mut found = vec![0; written];
    write.abort();
    let _ = write.await;
    timeout(LIMIT, other.read_exact(&mut found, None)).await.expect("everything arrives").unwrap();
    assert!(found.iter().all(|it| *it == 7));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_link_ends_with_the_certificate_at_its_other_end() {
    let authority = Authority::new();
    // Long enough for a handshake on a machine with too much to do; certificates count in whole seconds.
    let left = Duration::from_secs(5);
    let ground = Ground::listen(&authority, Some(left)).await;
    let (one, other) = ground.called_by(&authority, "uav1").await;
    one.write_all(&[1], None).await.unwrap();
    other.read_exact(&mut [0], None).await.unwrap();
    let says = tokio::spawn(async move {
        while one.write_all(&[1], None).await.is_ok() {
            // The pace of the keepalives, not something to wait for.
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    });
    let heard = async {
        loop {
            if let Err(cause) = other.read_exact(&mut [0], None).await {
                return cause.to_string();
            }
        }
    };
    let cause = timeout(LIMIT, heard).await.expect("it ends");
    assert!(cause.contains("run out"), "{cause}");
    other.close().await.unwrap();
    timeout(LIMIT, says).await.expect("the other end is notified").unwrap();
}

/// What the end that stays says when the other is revoked while the link is up.
async fn cut_off(link: &LinkUnicast) {
    let cause = timeout(LIMIT, link.read_exact(&mut [0], None)).await.expect("the link ends").unwrap_err().to_string();
    assert!(cause.contains("Revoked"), "{cause}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_link_ends_when_its_other_end_is_revoked() {
    let authority = Authority::new();
    let ground = Ground::listen(&authority, None).await;
    let (one, other) = ground.called_by(&authority, "uav1").await;
    authority.revoke(&["uav1"]);
    cut_off(&one).await;
    assert!(timeout(LIMIT, other.read_exact(&mut [0], None)).await.expect("it is notified").is_err());
    // It cannot come back: the refusal is there when it reads.
    let again = call(authority.endpoint_of(&ground.locator, "uav1")).await.unwrap();
    let refusal = timeout(LIMIT, again.read_exact(&mut [0], None)).await.unwrap().unwrap_err().to_string();
    assert!(refusal.contains("CertificateRevoked"), "{refusal}");
    assert!(ground.callers.is_empty());
    // Others can, and one of the name that has a new certificate; an invalid list ends no link.
    for name in ["uav2", "uav1"] {
        let (one, other) = ground.called_by(&authority, name).await;
        authority.replace("revoked.pem", "half of a li");
        say(one, 3).await;
        hear(other, 3).await;
        authority.revoke(&[]);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_caller_leaves_one_who_is_revoked_and_does_not_call_again() {
    let authority = Authority::new();
    let ground = Ground::listen(&authority, None).await;
    let (_one, other) = ground.called_by(&authority, "uav1").await;
    authority.revoke(&["ground"]);
    cut_off(&other).await;
    let refusal = call(authority.endpoint_of(&ground.locator, "uav1")).await.unwrap_err();
    assert!(refusal.contains("Revoked"), "{refusal}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_link_is_made_again_while_a_file_cannot_be_used() {
    let authority = Authority::new();
    let ground = Ground::listen(&authority, None).await;
    let endpoint = authority.endpoint(&ground.locator, "uav1", None);
    let caller = LinkManagerUnicastTls::new(flume::unbounded().0);
    authority.revoke(&[]);
    let revoked = authority.path("revoked.pem");
    // The second one never ends, the third one waits for somebody who writes.
    let spoil: [&dyn Fn(); 4] = [
        &|| std::fs::write(&revoked, "half of a li").unwrap(),
        &|| std::os::unix::fs::symlink("/dev/zero", &revoked).unwrap(),
        &|| assert!(std::process::Command::new("mkfifo").arg(&revoked).status().unwrap().success()),
        &|| std::fs::File::create(&revoked).unwrap().set_len(1 << 40).unwrap(),
    ];
    for spoil in [None].into_iter().chain(spoil.map(Some)) {
        if let Some(spoil) = spoil {
            std::fs::remove_file(&revoked).unwrap();
            spoil();
        }
        let other = timeout(LIMIT, caller.new_link(endpoint.clone())).await.unwrap().unwrap();
        let one = timeout(LIMIT, ground.callers.recv_async()).await.unwrap().unwrap();
        say(one, 3).await;
        hear(other, 3).await;
    }
    // Who has never had a list that can be used does not begin without one.
    let refusal = call(endpoint).await.unwrap_err();
    assert!(refusal.contains("revoked.pem"), "{refusal}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_renewed_certificate_is_used_for_the_next_connection() {
    let authority = Authority::new();
    let ground = Ground::listen(&authority, None).await;
    let (before, _) = ground.called_by(&authority, "uav1").await;
    authority.issue("ground", "ground, renewed", None);
    authority.issue("uav1", "uav1, renewed", None);
    let other = call(authority.endpoint_of(&ground.locator, "uav1")).await.unwrap();
    let one = timeout(LIMIT, ground.callers.recv_async()).await.unwrap().unwrap();
    assert_eq!(one.get_auth_id().get_cert_common_name(), Some("uav1, renewed"));
    assert_eq!(other.get_auth_id().get_cert_common_name(), Some("ground, renewed"));
    assert_eq!(before.get_auth_id().get_cert_common_name(), Some("uav1"), "the previous link is as it was");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn who_has_the_certificate_of_another_one_does_not_call() {
    let authority = Authority::new();
    let ground = Ground::listen(&authority, None).await;
    let as_uav1 = |endpoint: EndPoint| format!("{endpoint};{}=uav1", credentials::CALLER).parse::<EndPoint>().unwrap();
    let endpoint = as_uav1(authority.endpoint(&ground.locator, "uav1", None));
    let copy = |name: &str, file: &str| {
        std::fs::copy(authority.path(&format!("uav2.{file}")), authority.path(&format!("{name}.{file}")))
    };
    authority.issue("uav2", "uav2", None);
    let whole = authority.path("authority.pem");
    let away = authority.path("away");
    // The set of another one, while it is copied and when it is there.
    std::fs::rename(&whole, &away).unwrap();
    for file in ["pem", "key"] {
        copy("uav1", file).unwrap();
    }
    let caller = LinkManagerUnicastTls::new(flume::unbounded().0);
    let calls =
        || async { timeout(LIMIT, caller.new_link(endpoint.clone())).await.unwrap().map_err(|it| it.to_string()) };
    assert!(calls().await.is_err());
    std::fs::rename(&away, &whole).unwrap();
    let refusal = calls().await.unwrap_err();
    assert!(refusal.contains("it is the certificate of `uav2`, expected that of `uav1`"), "{refusal}");
    assert!(ground.callers.is_empty());
    // Its own ones count without a new start, and go on to count when those of another one come.
    authority.issue("uav1", "uav1", None);
    for _ in 0..2 {
        let _held = calls().await.unwrap();
        let one = timeout(LIMIT, ground.callers.recv_async()).await.unwrap().unwrap();
        assert_eq!(one.get_auth_id().get_cert_common_name(), Some("uav1"));
        authority.issue("uav1", "uav2", None);
    }
}

#[test]
fn what_would_make_it_less_safe_is_refused() {
    #[track_caller]
    fn check(key: &str, value: &str, said: &str) {
        let mut config = zenoh_config::Config::default();
        config.insert_json5(&format!("transport/link/tls/{key}"), value).unwrap();
        let refused = TlsConfigurator.inspect_config(&config).unwrap_err().to_string();
        assert!(refused.contains(said), "{refused}");
    }
    check("enable_mtls", "false", "`enable_mtls` cannot be turned off");
    check("verify_name_on_connect", "false", "`verify_name_on_connect` cannot be turned off");
    check("close_link_on_expiration", "false", "`close_link_on_expiration` cannot be turned off");
    check("connect_private_key_base64", "\"AAAA\"", "from files only");
}

/// An update of zenoh would leave this crate aside, without a word.
#[test]
fn zenoh_uses_this_crate_and_not_its_own() {
    let lock = include_str!("../../../Cargo.lock");
    let named: Vec<_> = lock.split("[[package]]").filter(|it| it.contains("name = \"zenoh-link-tls\"")).collect();
    assert_eq!(named.len(), 1, "{named:?}");
    assert!(!named[0].contains("source = "), "it comes from a registry: {}", named[0]);
}

/// Somebody who calls and says nothing keeps nobody else waiting, however often.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn silent_callers_are_no_obstacle() {
    let authority = Authority::new();
    let ground = Ground::listen(&authority, None).await;
    let address = ground.address().await;
    let mut silent = Vec::new();
    for _ in 0..200 {
        silent.push(TcpStream::connect(address).await.unwrap());
    }
    let (one, other) = ground.called_by(&authority, "uav1").await;
    say(one, 3).await;
    hear(other, 3).await;
}

/// Not even one who goes on calling while others show their certificates.
#[cfg(target_os = "linux")] // where 127.0.0.2 is there without being set up
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn who_keeps_calling_hangs_up_on_nobody_but_himself() {
    let authority = Authority::new();
    let ground = Ground::listen(&authority, None).await;
    let address = ground.address().await;
    let stranger = tokio::spawn(async move {
        let mut silent = VecDeque::new();
        loop {
            let socket = TcpSocket::new_v4().unwrap();
            socket.bind("127.0.0.2:0".parse().unwrap()).unwrap();
            silent.push_back(socket.connect(address).await);
            if silent.len() == 200 {
                silent.pop_front();
            }
        }
    });
    for number in 0..20 {
        let (one, other) = ground.called_by(&authority, &format!("uav{number}")).await;
        say(one, 3).await;
        hear(other, 3).await;
    }
    stranger.abort();
}
