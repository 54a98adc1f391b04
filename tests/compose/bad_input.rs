//! What the host does not allow is reported in one sentence.

use std::net::TcpListener;

use crate::compose::support::docker_lines;
use crate::compose::support::{Project, wait_for};
use crate::support::engine::docker;

#[test]
#[ignore = "needs an image: KITTIWAKE_IMAGE=NAME cargo test --test stories -- --ignored compose::"]
fn a_port_that_is_in_use() {
    let mut project = Project::new("port");
    let taken = TcpListener::bind("127.0.0.1:0").expect("the loopback is there");
    let port = taken.local_addr().expect("it is bound").port();
    project.set("KITTIWAKE_PORT", &port.to_string());
    let output = project.run(&["up", "--detach", "--no-build"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success());
    assert!(said.contains(&port.to_string()) && said.contains("in use"), "{said}");
    assert_eq!(project.down(), Vec::<String>::new(), "left behind");
}

#[test]
#[ignore = "needs an image: KITTIWAKE_IMAGE=NAME cargo test --test stories -- --ignored compose::"]
fn a_volume_that_cannot_be_written() {
    let project = Project::new("volume");
    project.up();
    let (image, access, authority) =
        (crate::compose::support::image(), project.volume("access"), project.volume("authority"));
    let state = "/var/lib/kittiwake";

    /// Runs one process of the image with a read-only volume.
    #[track_caller]
    fn check(image: &str, volume: &str, at: &str, args: &[&str], code: i32, said: &str) {
        let mount = format!("{volume}:{at}:ro");
        let usual = ["run", "--rm", "--read-only", "--network", "none", "--volume", &mount, image];
        let output = docker(&[&usual, args].concat());
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{args:?}: {told}");
        assert!(told.contains(said), "expected `{said}`, got `{told}`");
        assert_eq!(told.trim().lines().count(), 1, "one sentence: {told}");
    }
    let folder = format!("{state}/access");
    // An aircraft that may be in the air is not left without its operators: the gateway runs, and says that it writes no audit records.
    let mount = format!("{access}:{folder}:ro");
    let usual = ["run", "--detach", "--read-only", "--network", "none", "--volume", &mount, &image];
    let gateway = docker_lines(&[&usual[..], &["gateway", "--access", &folder, "--http", "127.0.0.1:0"]].concat());
    let [gateway] = gateway.as_slice() else { panic!("one container was started: {gateway:?}") };
    wait_for("the gateway to say it", || {
        let said = docker(&["logs", gateway]);
        let said = String::from_utf8_lossy(&said.stderr).into_owned();
        said.contains(&format!("orders are carried out without a record: {folder}/audit-")).then_some(())
    });
    assert_eq!(docker_lines(&["inspect", "--format", "{{.State.Running}}", gateway]), ["true"]);
    docker(&["rm", "--force", gateway]);
    let secret = format!("{folder}/token");
    let said = format!("access: {secret}: cannot be written: Read-only file system");
    check(&image, &access, &folder, &["access", &folder, "--secret", &secret], 2, &said);
    let at = format!("{state}/certificates/authority");
    check(
        &image,
        &authority,
        &at,
        &["certs", &format!("{state}/certificates/authority"), "--vehicle=uav9"],
        2,
        "certs: ",
    );
}

#[test]
#[ignore = "needs an image: KITTIWAKE_IMAGE=NAME cargo test --test stories -- --ignored compose::"]
fn a_certificate_of_another_router_is_refused_on_the_ground_and_the_right_one_let_in_again() {
    let project = Project::new("credentials");
    project.up();
    let (router, volume) = (project.container("uav1-router"), project.volume("uav1-certificate"));
    docker(&["stop", "--time", "5", &router]);
    let image = crate::compose::support::image();
    let mount = format!("{volume}:/var/lib/kittiwake/certificate");
    // As the ground it has no certificate: the volume holds that of uav1.
    let args =
        ["router", "--accept=tls/127.0.0.1:7448", "--vehicle=uav1", "--certificates=/var/lib/kittiwake/certificate"];
    let output = docker(&[&["run", "--rm", "--network", "none", "--volume", &mount, &image][..], &args].concat());
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("is the certificate of `uav1-router`, expected that of `ground-router`"), "{said}");
    docker(&["start", &router]);
    wait_for("the right one to be let in again", || {
        let said = docker_lines(&["exec", &project.container("ground-router"), "kittiwake", "health"]).concat();
        said.contains("link up: uav1-router").then_some(())
    });
}
