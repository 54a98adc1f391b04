//! The loop that the supervisor watches, beside inquiries that wait for others.

use std::io::Write;
use std::net::{SocketAddr, TcpListener};
use std::path::Path;
use std::sync::{Arc, Mutex, mpsc};
use std::time::Duration;

use domain::file::Source;
use rcgen::{BasicConstraints, CertificateParams, DnType, IsCa, Issuer, KeyPair};
use zenoh::Wait;

use super::News;
use super::link::{LinkEnd, Way};
use super::obstacle::{Inquiry, Resolver};
use super::watch::{Heard, Watch};
use crate::crossing::Crossing;
use crate::link_credentials::{AUTHORITY, CERTIFICATE, KEY};
use crate::session::{config, set};

/// What should happen happens sooner, on any machine; what lasts longer counts as stuck.
const LIMIT: Duration = Duration::from_secs(60);

/// Credentials of `uav1-router`.
fn credentials(folder: &Path) {
    use std::os::unix::fs::PermissionsExt;
    let key = KeyPair::generate().unwrap();
    let mut params = CertificateParams::new(Vec::new()).unwrap();
    params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
    std::fs::write(folder.join(AUTHORITY), params.self_signed(&key).unwrap().pem()).unwrap();
    let (issuer, key) = (Issuer::new(params, key), KeyPair::generate().unwrap());
    let mut params = CertificateParams::new(vec!["uav1-router".to_owned()]).unwrap();
    params.distinguished_name.push(DnType::CommonName, "uav1-router");
    std::fs::write(folder.join(CERTIFICATE), params.signed_by(&key, &issuer).unwrap().pem()).unwrap();
    std::fs::write(folder.join(KEY), key.serialize_pem()).unwrap();
    std::fs::set_permissions(folder.join(KEY), std::fs::Permissions::from_mode(0o600)).unwrap();
}

/// The end of `uav1` whose ground is at `address`.
fn link_to(address: &str, folder: &Path) -> LinkEnd {
    let table = include_str!("../../../../config/zenoh/link.toml").to_owned();
    let table = Crossing::read(&Source { path: "link.toml".into(), text: table }).unwrap();
    let way = Way::Dial { locator: format!("tls/{address}"), vehicle: "uav1".into() };
    LinkEnd { table, credentials: folder.to_owned(), way }
}

/// Runs the loop of an aircraft's router whose ground at `address` does not let it get anywhere. Once the inquiry has begun
/// to wait, of which `waits` tells, the loop must turn several times; then it must say `said`.
#[track_caller]
fn check(address: &str, resolver: Resolver, waits: &mpsc::Receiver<()>, said: &str) {
    let folder = tempfile::tempdir().unwrap();
    credentials(folder.path());
    let link = link_to(address, folder.path());
    let mut config = config("router").unwrap();
    set(&mut config, "listen/endpoints", "[\"tcp/127.0.0.1:0\"]").unwrap();
    set(&mut config, "scouting/delay", "0").unwrap();
    let session = zenoh::open(config).wait().unwrap();
    let ((sender, events), (news, told)) = (mpsc::channel(), mpsc::channel());
    let mut watch = Watch::new(Some(&link), sender.clone());
    watch.hurry(Duration::from_secs(1), resolver);
    let turning = std::thread::spawn(move || watch.run(&session, &events, &mut |it| news.send(it).unwrap()));
    waits.recv_timeout(LIMIT).expect("an inquiry begins");
    while told.try_recv().is_ok() {}
    for turn in 0..4 {
        loop {
            let news = told.recv_timeout(LIMIT);
            match news.unwrap_or_else(|_| panic!("turn {turn} does not come while the inquiry waits")) {
                News::Turned => break,
                News::Down { why, .. } => heard(why, said),
                other => panic!("{other:?}"),
            }
        }
    }
    let _ = sender.send(Heard::Stop);
    turning.join().unwrap().unwrap();
}

#[test]
fn a_key_that_others_may_read_hides_nothing_that_stands_in_the_way() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    credentials(folder.path());
    let key = folder.path().join(KEY);
    std::fs::set_permissions(&key, std::fs::Permissions::from_mode(0o644)).unwrap();
    // Where nobody listens.
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let inquiry = Inquiry::of(&link_to(&address, folder.path()));
    let found = || {
        let (sender, told) = mpsc::channel();
        inquiry.start(move |why| sender.send(why).unwrap()).unwrap();
        told.recv_timeout(LIMIT).unwrap()
    };
    heard(found(), "does not answer: ");
    heard(found(), "; besides, ");
    heard(found(), "may be read by others");
    std::fs::write(&key, KeyPair::generate().unwrap().serialize_pem()).unwrap();
    heard(found(), "is not the key to the certificate");
}

fn heard(why: Option<String>, said: &str) {
    assert!(why.as_ref().is_some_and(|it| it.contains(said)), "expected `{said}`, found {why:?}");
}

#[test]
fn the_loop_turns_while_the_name_server_does_not_answer() {
    let ((began, waits), (release, released)) = (mpsc::channel(), mpsc::channel::<()>());
    // As the resolver of a host without a network: it returns when its own limit is over, or never.
    let released = Mutex::new(released);
    let resolver: Resolver = Arc::new(move |_| {
        let _ = began.send(());
        let _ = released.lock().unwrap().recv();
        Ok(Vec::new())
    });
    check("ground.example:7448", resolver, &waits, "the name server does not answer");
    // Until here.
    drop(release);
}

#[test]
fn the_loop_turns_while_a_host_drips_bytes() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let (began, waits) = mpsc::channel();
    std::thread::spawn(move || {
        for mut caller in listener.incoming().map_while(Result::ok) {
            let _ = began.send(());
            // The head of a handshake record of 16 kB, of which a byte comes now and then: each read succeeds.
            let mut sent = caller.write_all(&[22, 3, 3, 0x40, 0]);
            while sent.is_ok() {
                drip();
                sent = caller.write_all(&[0]);
            }
        }
    });
    let resolver: Resolver = Arc::new(move |_| Ok::<Vec<SocketAddr>, _>(vec![address]));
    check(&format!("localhost:{}", address.port()), resolver, &waits, "no encrypted connection within 1s");
}

#[expect(clippy::disallowed_methods, reason = "the pace of what the host sends, not something to wait for")]
fn drip() {
    std::thread::sleep(Duration::from_millis(20));
}
