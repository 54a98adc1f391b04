//! `kittiwake doctor`: what this machine lacks to fly, before anything is started.

use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::Command;

use mavlink_bridge::socket::Endpoint;
use nix::sys::resource::{Resource, getrlimit};
use rustix::fs::{Access, access, statvfs};

use crate::check_inputs::{self, Inputs};
use crate::cli::DoctorArgs;
use crate::outcome::Outcome;
use crate::output;
use crate::run::run_file::{self, RunFolder};
use crate::run::state_folder;
use crate::settings::Settings;

/// A gateway has a file for each of its 256 clients, their event streams and the bus. (ENG: the usual soft limit of Linux.)
const LEAST_FILES: u64 = 1024;
/// A day of recordings takes 240 MB; a gateway stops recording below this. (ENG)
const LEAST_DISK_MB: u64 = 500;
/// What the processes of one vehicle and its ground were seen to take together, twice. (docs/kpi.md)
const LEAST_MEMORY_MB: u64 = 400;
/// Where an installed system keeps what others may not read.
const PRIVATE: [&str; 3] =
    ["/etc/kittiwake/certificates", "/etc/kittiwake/control-tower", "/var/lib/kittiwake/gateway"];
const UNITS: [&str; 2] = ["/etc/systemd/system/kittiwake@.service", "/usr/lib/systemd/system/kittiwake@.service"];

/// How something was found.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Verdict {
    Fine,
    /// It flies without it; what is lost.
    Note,
    /// It does not fly; what to do.
    Missing(String),
}

/// One line of the report.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Finding {
    subject: &'static str,
    verdict: Verdict,
    text: String,
}

fn fine(subject: &'static str, text: impl Into<String>) -> Finding {
    Finding { subject, verdict: Verdict::Fine, text: text.into() }
}

fn note(subject: &'static str, text: impl Into<String>) -> Finding {
    Finding { subject, verdict: Verdict::Note, text: text.into() }
}

fn missing(subject: &'static str, text: impl Into<String>, help: impl Into<String>) -> Finding {
    Finding { subject, verdict: Verdict::Missing(help.into()), text: text.into() }
}

/// Prints a line for each thing that is needed, and exits with 1 if one is missing.
pub fn doctor(args: &DoctorArgs) -> Outcome {
    let settings = Settings::of_file(&args.config);
    let inputs = check_inputs::read(&settings);
    let mut findings = vec![match &inputs {
        Ok(inputs) => fine("configuration", format!("{}: no mistake", inputs.config_file.display())),
        Err(mistakes) => missing("configuration", mistakes.to_string(), "mend the file, or name another with --config"),
    }];
    findings.extend(inputs.iter().flat_map(of_configuration));
    findings.extend([
        of_runs(),
        of_files(getrlimit(Resource::RLIMIT_NOFILE).map_or(0, |it| it.0)),
        of_memory(),
        of_clock(),
    ]);
    let recordings = inputs.as_ref().ok().and_then(|it| it.config.gateway.recording.folder.clone());
    findings.extend(recordings.or_else(state_folder::recordings).map(|it| of_disk(&it)));
    findings.extend(of_installation());
    findings.push(of_companions());
    for it in &findings {
        output::line(line(it));
    }
    let count = findings.iter().filter(|it| matches!(it.verdict, Verdict::Missing(_))).count();
    output::line(if count == 0 { "nothing is missing".to_owned() } else { format!("{count} missing") });
    if count == 0 { Outcome::Success } else { Outcome::Unavailable }
}

fn line(Finding { subject, verdict, text }: &Finding) -> String {
    match verdict {
        Verdict::Fine => format!("ok       {subject}: {text}"),
        Verdict::Note => format!("note     {subject}: {text}"),
        Verdict::Missing(help) => format!("missing  {subject}: {text}\n         help: {help}"),
    }
}

/// What the configuration asks this machine for.
fn of_configuration(inputs: &Inputs) -> Vec<Finding> {
    let http = inputs.config.http;
    let port = match TcpListener::bind(http) {
        Ok(_) if http.port() == 0 => fine("gateway", format!("takes a free port of {}", http.ip())),
        Ok(_) => fine("gateway", format!("{http} is free")),
        Err(cause) => {
            missing("gateway", format!("cannot listen on {http}: {cause}"), "name another address with `--http`")
        }
    };
    let serial = match &inputs.config.mavlink_bridge.connect {
        Endpoint::Serial { path, .. } => Some(of_device(Path::new(path))),
        _ => None,
    };
    std::iter::once(port).chain(serial).collect()
}

fn of_device(device: &Path) -> Finding {
    let path = device.display();
    match access(device, Access::READ_OK | Access::WRITE_OK) {
        Ok(()) => fine("autopilot", format!("{path} can be opened")),
        Err(rustix::io::Errno::NOENT) => {
            missing("autopilot", format!("there is no {path}"), "connect it, or name another with --connect-autopilot")
        }
        Err(cause) => {
            missing("autopilot", format!("{path}: {cause}"), "put the user into the device's group, often `dialout`")
        }
    }
}

/// The folder of running systems, and the length of the sockets in it.
fn of_runs() -> Finding {
    let locator = run_file::router_locator();
    let checked = RunFolder::create("doctor").and_then(|_| match bus::sockets::path_in(&locator) {
        Some(path) => bus::sockets::check_to_listen(path).map_err(std::io::Error::other),
        None => Ok(()),
    });
    match checked {
        Ok(()) => fine("sockets", format!("{} is this user's own", run_file::folder().display())),
        Err(cause) => missing("sockets", cause.to_string(), "mend the folder, or set TMPDIR to another one"),
    }
}

fn of_files(limit: u64) -> Finding {
    if LEAST_FILES <= limit {
        return fine("open files", format!("at most {limit}"));
    }
    missing(
        "open files",
        format!("at most {limit}, expected {LEAST_FILES}"),
        format!("`ulimit -n {LEAST_FILES}`, or LimitNOFILE in the unit"),
    )
}

fn of_memory() -> Finding {
    let text = std::fs::read_to_string("/proc/meminfo").unwrap_or_default();
    match available_mb(&text) {
        None => note("memory", "how much is free cannot be read"),
        Some(mb) if mb < LEAST_MEMORY_MB => missing(
            "memory",
            format!("{mb} MB free, expected {LEAST_MEMORY_MB}"),
            "end something else, or fly with `--onboard`, which takes less",
        ),
        Some(mb) => fine("memory", format!("{mb} MB free")),
    }
}

/// From `/proc/meminfo`.
fn available_mb(text: &str) -> Option<u64> {
    let value = text.lines().find_map(|it| it.strip_prefix("MemAvailable:"))?;
    value.split_whitespace().next()?.parse::<u64>().ok().map(|kb| kb / 1024)
}

/// Certificates, permissions and zones have times in UTC.
fn of_clock() -> Finding {
    let asked = Command::new("timedatectl").args(["show", "--property", "NTPSynchronized", "--value"]).output();
    match asked.map(|it| String::from_utf8_lossy(&it.stdout).trim().to_owned()).as_deref() {
        Ok("yes") => fine("clock", "synchronised"),
        Ok("no") => note("clock", "not synchronised: certificates, permissions and zones are judged by UTC"),
        _ => note("clock", "whether it is synchronised is not known here: `timedatectl` does not say"),
    }
}

/// The disk on which `folder` is or will be.
fn of_disk(folder: &Path) -> Finding {
    let there = folder.ancestors().find(|it| it.exists()).unwrap_or(Path::new("."));
    match statvfs(there) {
        Err(cause) => note("recordings", format!("{}: {cause}", there.display())),
        Ok(disk) => {
            let mb = disk.f_bavail.saturating_mul(disk.f_frsize) >> 20;
            if LEAST_DISK_MB <= mb {
                return fine("recordings", format!("{} has {mb} MB free", folder.display()));
            }
            note(
                "recordings",
                format!(
                    "{} has {mb} MB free: below {LEAST_DISK_MB} MB a flight may not be recorded to its end",
                    folder.display()
                ),
            )
        }
    }
}

/// What an installed system needs besides; nothing where none is installed.
fn of_installation() -> Vec<Finding> {
    let Some(unit) = UNITS.iter().find(|it| Path::new(it).exists()) else { return Vec::new() };
    let user = match nix::unistd::User::from_name("kittiwake") {
        Ok(Some(_)) => fine("systemd", format!("{unit}, which runs as the user `kittiwake`")),
        _ => missing("systemd", "there is no user `kittiwake`", "`useradd --system kittiwake`"),
    };
    let folders =
        PRIVATE.into_iter().filter(|it| Path::new(it).exists()).filter_map(|it| of_private_folder(Path::new(it)));
    std::iter::once(user).chain(folders).collect()
}

/// Whether others can read what is in the folder; `None` if not.
fn of_private_folder(folder: &Path) -> Option<Finding> {
    use std::os::unix::fs::MetadataExt as _;
    let mode = std::fs::metadata(folder).ok()?.mode() & 0o777;
    let text = format!("{} may be read by others (mode {mode:o})", folder.display());
    (mode & 0o007 != 0).then(|| missing("systemd", text, format!("`chmod 700 {}`", folder.display())))
}

/// The programs that measure, which lie beside this one.
fn of_companions() -> Finding {
    let beside = |name: &str| std::env::current_exe().ok().and_then(|it| it.parent().map(|it| it.join(name)));
    let absent: Vec<_> = ["kittiwake-kpi", "kittiwake-chaos"]
        .into_iter()
        .filter(|it| !beside(it).is_some_and(|it: PathBuf| it.exists()))
        .collect();
    if absent.is_empty() {
        return fine("measuring", "`kittiwake kpi` and `kittiwake chaos` are there");
    }
    note("measuring", format!("{} not built: only the commands that measure need them", absent.join(" and ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_too_little_is_missing_and_says_what_to_do() {
        #[track_caller]
        fn check(found: &Finding, expected: &str) {
            assert_eq!(line(found), expected);
        }
        check(&of_files(1024), "ok       open files: at most 1024");
        check(
            &of_files(256),
            "missing  open files: at most 256, expected 1024\n         help: `ulimit -n 1024`, or LimitNOFILE in the unit",
        );
        check(
            &of_device(Path::new("/dev/no-such-line")),
            "missing  autopilot: there is no /dev/no-such-line\n         help: connect it, or name another with --connect-autopilot",
        );
    }

    #[test]
    fn the_memory_that_is_free_is_what_linux_says_can_be_had() {
        assert_eq!(available_mb("MemTotal: 24000 kB\nMemFree: 1 kB\nMemAvailable:   409600 kB\n"), Some(400));
        assert_eq!(available_mb("MemTotal: 24000 kB\n"), None);
    }

    #[test]
    fn a_folder_that_others_can_read_is_named() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().unwrap();
        let with = |mode| {
            std::fs::set_permissions(folder.path(), std::fs::Permissions::from_mode(mode)).unwrap();
            of_private_folder(folder.path()).is_some()
        };
        assert!(!with(0o700) && !with(0o750) && with(0o755));
    }
}
