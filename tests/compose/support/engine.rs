//! The container engine and its commands.

use std::process::{Command, Output, Stdio};

/// Names the image under test.
const IMAGE: &str = "KITTIWAKE_IMAGE";

/// Runs `docker` to its end.
pub fn docker(args: &[&str]) -> Output {
    Command::new("docker").args(args).stdin(Stdio::null()).output().expect("docker can be run")
}

/// The same, line by line.
pub fn docker_lines(args: &[&str]) -> Vec<String> {
    let output = docker(args);
    String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect()
}

/// The image under test.
#[track_caller]
pub fn image() -> String {
    let image = std::env::var(IMAGE).unwrap_or_else(|_| panic!("{IMAGE} has to name an image of this tree"));
    assert!(answers("docker", &["version"]), "no container engine answers here");
    assert!(answers("docker", &["image", "inspect", &image]), "{IMAGE} is {image}, and there is no such image");
    image
}

/// The compose command of this machine.
#[track_caller]
pub fn compose() -> &'static [&'static str] {
    const PLUGIN: &[&str] = &["docker", "compose"];
    const PROGRAM: &[&str] = &["docker-compose"];
    let found = [PLUGIN, PROGRAM].into_iter().find(|it| answers(it[0], &[&it[1..], &["version"]].concat()));
    found.expect("`docker compose` or `docker-compose` is installed")
}

fn answers(program: &str, args: &[&str]) -> bool {
    let run =
        Command::new(program).args(args).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status();
    run.is_ok_and(|it| it.success())
}
