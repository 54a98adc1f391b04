//! The container engine and its commands.

use std::process::{Command, Output, Stdio};

/// Runs `docker` to its end.
pub fn docker(args: &[&str]) -> Output {
    Command::new("docker").args(args).stdin(Stdio::null()).output().expect("docker can be run")
}

/// The image that the environment names by `variable`.
#[track_caller]
pub fn image(variable: &str) -> String {
    let image = std::env::var(variable).unwrap_or_else(|_| panic!("{variable} has to name an image of this tree"));
    assert!(answers("docker", &["version"]), "no container engine answers here");
    assert!(answers("docker", &["image", "inspect", &image]), "{variable} is {image}, and there is no such image");
    image
}

/// Whether a command ends with success.
pub fn answers(program: &str, args: &[&str]) -> bool {
    let run =
        Command::new(program).args(args).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status();
    run.is_ok_and(|it| it.success())
}
