//! The commands of docs/deployment.md, so that the stories do what its readers do.

use std::path::Path;

/// The one block of commands about systemd that contains `part`, of this version.
#[track_caller]
pub fn commands(part: &str) -> String {
    commands_of(Path::new(env!("CARGO_MANIFEST_DIR")), part)
}

/// The same of the version that lies in `root`.
#[track_caller]
pub fn commands_of(root: &Path, part: &str) -> String {
    let text = std::fs::read_to_string(root.join("docs/deployment.md")).expect("the documentation is there");
    let (_, section) = text.split_once("\n## systemd\n").expect("it has a part about systemd");
    let section = section.split("\n## ").next().unwrap_or_default();
    let blocks = section.split("\n```sh\n").skip(1).filter_map(|it| it.split("\n```").next());
    let found: Vec<_> = blocks.filter(|it| it.contains(part)).collect();
    assert_eq!(found.len(), 1, "blocks of commands with `{part}`: {found:?}");
    found.concat()
}
