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

/// The image under test. If one is named it must exist; if none is, the reason for skipping.
pub fn image() -> Result<String, String> {
    let image = std::env::var(IMAGE).map_err(|_| format!("{IMAGE} names no image of this tree"))?;
    if !answers("docker", &["version"]) {
        return Err("no container engine answers here".into());
    }
    assert!(answers("docker", &["image", "inspect", &image]), "{IMAGE} is {image}, and there is no such image");
    Ok(image)
}

/// The compose command of this machine.
pub fn compose() -> Result<&'static [&'static str], String> {
    const PLUGIN: &[&str] = &["docker", "compose"];
    const PROGRAM: &[&str] = &["docker-compose"];
    let found = [PLUGIN, PROGRAM].into_iter().find(|it| answers(it[0], &[&it[1..], &["version"]].concat()));
    found.ok_or_else(|| "neither `docker compose` nor `docker-compose` is installed".into())
}

fn answers(program: &str, args: &[&str]) -> bool {
    let run =
        Command::new(program).args(args).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status();
    run.is_ok_and(|it| it.success())
}
