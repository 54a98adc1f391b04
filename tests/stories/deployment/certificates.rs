//! Certificates that are revoked and renewed while the link is up, and one that two machines use.

use super::world::{Credentials, Router};
use crate::support::kittiwake;

/// Runs `kittiwake certs` with these arguments to its end.
#[track_caller]
fn certs(command: &str, credentials: &Credentials, name: &str) {
    let output = kittiwake(&["certs", command, &credentials.root(), name]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_revoked_router_is_cut_off_until_it_is_renewed_and_nobody_is_started_again() {
    let credentials = Credentials::make(&["uav1"], &[]);
    let mut ground = Router::ground(&credentials, &["uav1"]);
    let mut aircraft = Router::aircraft(&credentials, "uav1", ground.link_address());
    let mut up = 0;
    for revoked in ["uav1-router", "ground-router"] {
        up += 1;
        ground.process().wait_for_nth("the link to uav1-router is up", up);
        aircraft.process().wait_for_nth("the link to ground-router is up", up);
        // Each router reads its own folder, as if the new list had been copied there.
        certs("revoke", &credentials, revoked);
        let (own, other) = match revoked {
            "uav1-router" => (&mut aircraft, &mut ground),
            _ => (&mut ground, &mut aircraft),
        };
        let said = other.process().wait_for(&format!("who=\"{revoked}\""));
        assert!(said.contains("accepted no more: the link is closed") && said.contains("Revoked"), "{said}");
        other.process().wait_for_nth(&format!("the link to {revoked} is down"), up);
        // It calls, or is called, several times a second, and half a minute later the link is still down.
        let said = own.process().wait_for("is revoked, as revoked.pem beside it says");
        assert!(said.contains("has been down for") && said.contains("kittiwake certs renew"), "{said}");
        for (router, peer) in [(&mut ground, "uav1-router"), (&mut aircraft, "ground-router")] {
            let lines = router.process().lines();
            let ups = lines.iter().filter(|it| it.contains(&format!("the link to {peer} is up"))).count();
            assert_eq!(ups, up, "it did not come back");
            assert!(router.process().runs(), "and its own side is still served");
        }
        certs("renew", &credentials, revoked);
    }
    ground.process().wait_for_nth("the link to uav1-router is up", up + 1);
    aircraft.process().wait_for_nth("the link to ground-router is up", up + 1);
}

#[test]
fn a_second_machine_under_one_name_is_reported() {
    let credentials = Credentials::make(&["uav1"], &[]);
    let mut ground = Router::ground(&credentials, &["uav1"]);
    let _aircraft = Router::aircraft(&credentials, "uav1", ground.link_address());
    ground.process().wait_for("the link to uav1-router is up");
    let health = |ground: &Router| {
        let output = kittiwake(&["health", "--process", "router", "--connect", &ground.inside]);
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let said = health(&ground);
    assert!(said.contains("link up: uav1-router") && !said.contains("more connections"), "{said}");
    let impostor = Router::aircraft(&credentials, "uav1", ground.link_address());
    let said = ground.process().wait_for("connections under the name of uav1-router");
    assert!(said.contains("which makes 2 at most: another machine uses its certificate"), "{said}");
    let said = health(&ground);
    assert!(said.contains("more connections than one machine makes: uav1-router"), "{said}");
    drop(impostor);
    crate::support::wait_for("one machine alone", || (!health(&ground).contains("more connections")).then_some(()));
}

#[test]
fn a_router_whose_certificate_has_run_out_serves_its_own_side() {
    let credentials = Credentials::make(&["uav1"], &["--days=-1"]);
    let mut aircraft = Router::aircraft(&credentials, "uav1", "127.0.0.1:9".parse().unwrap());
    let said = aircraft.process().wait_for("no link for now");
    assert!(said.contains("certificate.pem is valid from") && said.contains("get another"), "{said}");
    let output = kittiwake(&["health", "--process", "router", "--connect", &aircraft.inside]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
}
