//! Mistakes in a router's credentials, table or address are reported at its start, in one sentence.

use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::Output;

use super::world::{Credentials, Router, table_with};
use crate::support::{kittiwake, shipped};

fn router(more: &[&str]) -> Output {
    let table = shipped().join("zenoh/link.toml").to_string_lossy().into_owned();
    let table: &[&str] = if more.contains(&"--link") { &[] } else { &["--link", &table] };
    kittiwake(&[&["run", "router", "--listen", "tcp/127.0.0.1:0"], table, more].concat())
}

/// Fails unless the router was refused with one sentence that contains `said`.
#[track_caller]
fn refused(output: &Output, code: i32, said: &str) {
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{told}");
    assert!(told.contains(said), "`{said}` is not said:\n{told}");
    assert!(output.stdout.is_empty(), "it listened");
}

#[test]
fn credentials_that_would_fail_at_the_link_are_refused_on_the_ground() {
    let (credentials, foreign) = (Credentials::make(&["uav1"], &[]), Credentials::make(&["uav1"], &[]));
    let accept = |folder: &str| router(&["--accept", "tls/127.0.0.1:0", "--vehicle", "uav1", "--certificates", folder]);
    refused(&accept(&credentials.text_of("nowhere")), 2, "cannot read");
    refused(
        &accept(&credentials.text_of("uav1-router")),
        2,
        "is the certificate of `uav1-router`, expected that of `ground",
    );
    let own = credentials.of("ground-router");
    std::fs::copy(foreign.of("ground-router").join("authority.pem"), own.join("authority.pem")).unwrap();
    refused(&accept(&own.to_string_lossy()), 2, "has not signed it");
    std::fs::copy(credentials.of("uav1-router").join("key.pem"), own.join("key.pem")).unwrap();
    refused(&accept(&own.to_string_lossy()), 2, "is not the key");
}

/// The files of a router's folder, to put them back.
struct Whole(Vec<(PathBuf, Vec<u8>)>);

impl Whole {
    fn of(folder: &Path) -> Whole {
        let files = ["authority.pem", "certificate.pem", "key.pem"].map(|it| folder.join(it));
        Whole(files.into_iter().map(|it| (it.clone(), std::fs::read(it).unwrap())).collect())
    }

    fn put_into(&self, folder: &Path) {
        for (path, bytes) in &self.0 {
            std::fs::write(folder.join(path.file_name().unwrap()), bytes).unwrap();
        }
        let _ = std::fs::remove_file(folder.join("revoked.pem"));
    }
}

#[test]
fn an_aircraft_has_its_router_whatever_its_files_are_like_and_the_link_once_they_are_good() {
    let (credentials, foreign) = (Credentials::make(&["uav1"], &[]), Credentials::make(&["uav1"], &[]));
    let ground = Router::ground(&credentials, &["uav1"]);
    let own = credentials.of("uav1-router");
    let whole = Whole::of(&own);
    let half = |name: &str| {
        let bytes = std::fs::read(own.join(name)).unwrap();
        std::fs::write(own.join(name), &bytes[..bytes.len() / 2]).unwrap();
    };
    let of_another = |name: &str| {
        std::fs::copy(foreign.of("uav1-router").join(name), own.join(name)).unwrap();
    };
    let spoil: [(&dyn Fn(), &str); 6] = [
        (&|| std::fs::remove_file(own.join("certificate.pem")).unwrap(), "certificate.pem: No such file"),
        (&|| half("certificate.pem"), "certificate.pem holds no certificate"),
        (&|| half("key.pem"), "key.pem holds no private key"),
        (&|| std::fs::write(own.join("revoked.pem"), "half of a li").unwrap(), "revoked.pem holds no revocation list"),
        (&|| of_another("key.pem"), "is not the key to the certificate"),
        (&|| of_another("authority.pem"), "has not signed it"),
    ];
    for (spoil, expected) in spoil {
        spoil();
        let mut aircraft = Router::aircraft(&credentials, "uav1", ground.link_address());
        for said in ["no link for now", "the link to ground-router has been down for"] {
            let said = aircraft.process().wait_for(said);
            assert!(said.contains(expected), "expected `{expected}`, found `{said}`");
        }
        let output = kittiwake(&["health", "--process", "router", "--connect", &aircraft.inside]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
        whole.put_into(&own);
        aircraft.process().wait_for("the link to ground-router is up");
    }
}

#[test]
fn an_aircraft_with_the_files_of_another_has_its_router_and_does_not_pass_for_the_other() {
    let credentials = Credentials::make(&["uav1", "uav2"], &[]);
    let mut ground = Router::ground(&credentials, &["uav1", "uav2"]);
    let (own, other) = (credentials.of("uav1-router"), credentials.of("uav2-router"));
    let whole = Whole::of(&own);
    Whole::of(&other).put_into(&own);
    // While they are copied, and once they are there.
    std::fs::remove_file(own.join("authority.pem")).unwrap();
    let mut aircraft = Router::aircraft(&credentials, "uav1", ground.link_address());
    aircraft.process().wait_for("authority.pem: No such file");
    Whole::of(&other).put_into(&own);
    let said = aircraft.process().wait_for("is the certificate of `uav2-router`, expected that of `uav1-router`");
    assert!(said.contains("the link to ground-router has been down for"), "{said}");
    // Its own ones are used without a new start.
    whole.put_into(&own);
    aircraft.process().wait_for("the link to ground-router is up");
    ground.process().wait_for("the link to uav1-router is up");
    assert!(ground.process().lines().iter().all(|it| !it.contains("the link to uav2-router is up")));
}

#[test]
fn arguments_and_tables_that_make_no_sense() {
    let credentials = Credentials::make(&["uav1"], &[]);
    let folder = credentials.text_of("uav1-router");
    refused(&router(&["--dial", "tls/localhost:9"]), 2, "--certificates");
    refused(
        &router(&["--dial", "tcp/localhost:9", "--vehicle", "uav1", "--certificates", &folder]),
        2,
        "always encrypted",
    );
    let two = ["--dial", "tls/localhost:9", "--vehicle", "uav1", "--vehicle", "uav2", "--certificates", &folder];
    refused(&router(&two), 2, "give one --vehicle");
    let place = tempfile::tempdir().unwrap();
    let table = table_with(place.path(), "\"mcm/status\"", "\"mcm/statu\"");
    let dial = ["--dial", "tls/localhost:9", "--vehicle", "uav1", "--certificates", &folder, "--link", &table];
    let output = router(&dial);
    refused(&output, 2, "there is no topic `mcm/statu`");
    refused(&output, 2, "link.toml:");
}

#[test]
fn an_address_in_use() {
    let credentials = Credentials::make(&["uav1"], &[]);
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port();
    let folder = credentials.text_of("ground-router");
    let accept = format!("tls/127.0.0.1:{port}");
    let output = router(&["--accept", &accept, "--vehicle", "uav1", "--certificates", &folder]);
    refused(&output, 5, &format!("cannot listen on {accept}: Address already in use"));
    let output = kittiwake(&["run", "router", "--listen", &format!("tcp/127.0.0.1:{port}")]);
    refused(&output, 5, "Address already in use");
}

#[test]
fn a_ground_that_is_unreachable_is_reported_and_called_again() {
    let credentials = Credentials::make(&["uav1"], &[]);
    let mut ground = Router::ground(&credentials, &["uav1"]);
    let address = ground.link_address();
    ground.kill();
    let mut aircraft = Router::aircraft(&credentials, "uav1", address);
    let said = aircraft.process().wait_for("the link to ground-router has been down for");
    assert!(said.contains("does not answer: Connection refused"), "{said}");
    ground.start_again();
    aircraft.process().wait_for("the link to ground-router is up");
    ground.process().wait_for("the link to uav1-router is up");
    aircraft.kill();
    ground.process().wait_for("the link to uav1-router is down");
}

#[test]
fn credentials_that_the_ground_does_not_accept_are_reported_on_board() {
    let (credentials, foreign) = (Credentials::make(&["uav1"], &[]), Credentials::make(&["uav1"], &[]));
    let ground = Router::ground(&credentials, &["uav1"]);
    // The aircraft trusts the ground's authority, but that has not signed the certificate that the ground shows.
    let folder = foreign.of("uav1-router");
    let both =
        [credentials.of("uav1-router"), folder.clone()].map(|it| std::fs::read_to_string(it.join("authority.pem")));
    std::fs::write(folder.join("authority.pem"), both.map(Result::unwrap).concat()).unwrap();
    let mut aircraft = Router::aircraft(&foreign, "uav1", ground.link_address());
    let said = aircraft.process().wait_for("the link to ground-router has been down for");
    assert!(said.contains("it does not accept our certificate"), "{said}");
}

#[test]
fn credentials_that_expire_in_use_take_the_link_down_and_are_reported_on_both_sides() {
    // Making the certificate and the link takes much less than these twenty seconds.
    let credentials = Credentials::make(&["uav1"], &["--days", &format!("{}", 20.0 / 86_400.0)]);
    let mut ground = Router::ground(&credentials, &["uav1"]);
    let mut aircraft = Router::aircraft(&credentials, "uav1", ground.link_address());
    aircraft.process().wait_for("the link to ground-router is up");
    for (side, peer) in [(&mut aircraft, "ground-router"), (&mut ground, "uav1-router")] {
        side.process().wait_for(&format!("the link to {peer} is down"));
        let said = side.process().wait_for(&format!("the link to {peer} has been down for"));
        assert!(said.contains("certificate.pem is valid from") && said.contains("get another"), "{said}");
        assert!(side.process().runs(), "and its own side is still served");
    }
}
