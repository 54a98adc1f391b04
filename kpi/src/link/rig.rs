//! A vehicle and the ground, each with a router of its own, and between them a link with faults.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use faulty_link::Proxy;
use kittiwake::backend::Backend;
use kittiwake::run::run_file::RunFolder;

/// Ends with the value.
pub(crate) struct Rig {
    /// Before the folder: processes end first.
    _processes: Vec<Process>,
    /// The link, to be narrowed and cut.
    pub(crate) proxy: Proxy,
    /// The routers' locators.
    pub(crate) ground: String,
    pub(crate) on_board: String,
    _folder: RunFolder,
}

impl Rig {
    /// Starts everything with the executable `program`.
    pub(crate) fn start(program: &Path, config: &Path, vehicle: &str, seed: u64) -> Result<Rig, String> {
        let folder = RunFolder::create("kpi-link").map_err(|it| it.to_string())?;
        let root = folder.0.clone();
        let credentials = root.join("credentials");
        let made = Command::new(program).arg("certs").arg(&credentials).args(["--vehicle", vehicle]).output();
        let made = made.map_err(|cause| format!("{}: {cause}", program.display()))?;
        if !made.status.success() {
            return Err(String::from_utf8_lossy(&made.stderr).into_owned());
        }
        let table = config.with_file_name("zenoh").join("link.toml");
        let router = |side: &str, name: &str, way: [&str; 2]| {
            let inside = bus::sockets::locator_of(&root.join(format!("{side}.sock")));
            let mut command = Command::new(program);
            command.args(["run", "router", "--listen", &inside, "--vehicle", vehicle]).args(way);
            command.arg("--link").arg(&table).arg("--certificates").arg(credentials.join(name));
            Process::start(command).map(|(process, lines)| (process, inside, lines))
        };
        let (ground_router, ground, mut lines) = router("ground", "ground-router", ["--accept", "tls/127.0.0.1:0"])?;
        let link = lines.find_map(|it| it.strip_prefix("tls/")?.parse().ok()).ok_or("the ground's router has ended")?;
        let proxy = Proxy::to(link, seed);
        let dial = format!("tls/localhost:{}", proxy.address.port());
        let (own_router, on_board, mut lines) = router("aircraft", &format!("{vehicle}-router"), ["--dial", &dial])?;
        lines.next().ok_or("the aircraft's router has ended")?;
        let mut processes = vec![ground_router, own_router];
        for service in Backend::Sim.services() {
            let connect = if matches!(service.scope(vehicle), bus::Scope::Fleet) { &ground } else { &on_board };
            let mut command = Command::new(program);
            command
                .args(["run", service.name(), "--connect", connect, "--vehicle", vehicle])
                .arg("--config")
                .arg(config);
            if service.reads("--http") {
                command.args(["--http", "127.0.0.1:0"]);
            }
            processes.push(Process::start(command)?.0);
        }
        Ok(Rig { _processes: processes, proxy, ground, on_board, _folder: folder })
    }
}

struct Process(Child);

impl Process {
    /// With the lines it prints.
    fn start(mut command: Command) -> Result<(Process, impl Iterator<Item = String>), String> {
        command.arg("--exit-with-parent").stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().map_err(|cause| format!("{command:?}: {cause}"))?;
        let stdout = child.stdout.take().ok_or("it has no standard output")?;
        Ok((Process(child), BufReader::new(stdout).lines().map_while(Result::ok)))
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // Fails only if it has ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
