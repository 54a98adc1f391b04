//! Both sides as real processes: a router each, a link with faults, and their services.

use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Condvar, Mutex};
use std::time::Instant;

use faulty_link::Proxy;
use kittiwake::service::Service;
use reqwest::blocking::{Client, Response};
use serde_json::Value;

use crate::support::{KITTIWAKE, LIMIT, kittiwake, shipped, wait_for};

/// The operator's token at the gateway.
const TOKEN: &str = "a-token-for-this-test";

/// The operator's name, which is part of every order.
const OPERATOR: &str = "olga";

/// Number of lines of each process that are printed when a test fails.
const LAST_LINES: usize = 30;

/// A process of the program; ends with the value.
pub struct Process {
    child: Child,
    said: Arc<(Mutex<Vec<String>>, Condvar)>,
}

impl Process {
    pub fn start(args: &[&str]) -> Process {
        let mut child = Command::new(KITTIWAKE)
            .args(args)
            .arg("--exit-with-parent")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let said: Arc<(Mutex<Vec<String>>, Condvar)> = Arc::default();
        let streams: [Box<dyn std::io::Read + Send>; 2] =
            [Box::new(child.stdout.take().unwrap()), Box::new(child.stderr.take().unwrap())];
        for stream in streams {
            let said = said.clone();
            std::thread::spawn(move || {
                for line in BufReader::new(stream).lines().map_while(Result::ok) {
                    said.0.lock().unwrap().push(line);
                    said.1.notify_all();
                }
            });
        }
        Process { child, said }
    }

    /// Waits for a line that contains `part` and returns the last such line.
    #[track_caller]
    pub fn wait_for(&self, part: &str) -> String {
        self.wait_for_nth(part, 1)
    }

    /// Waits until this many lines contain `part`.
    #[track_caller]
    pub fn wait_for_nth(&self, part: &str, nth: usize) -> String {
        let until = Instant::now() + LIMIT;
        let mut lines = self.said.0.lock().unwrap();
        loop {
            if let Some(line) = lines.iter().filter(|it| it.contains(part)).nth(nth - 1) {
                return line.clone();
            }
            let left = until.saturating_duration_since(Instant::now());
            assert!(!left.is_zero(), "waited for `{part}` ({nth}) in vain; it said:\n{}", lines.join("\n"));
            lines = self.said.1.wait_timeout(lines, left).unwrap().0;
        }
    }

    pub fn lines(&self) -> Vec<String> {
        self.said.0.lock().unwrap().clone()
    }

    pub fn runs(&mut self) -> bool {
        self.child.try_wait().expect("it is our child").is_none()
    }

    /// As a power cut would: without any message.
    pub fn kill(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.kill();
    }
}

/// A folder of certificates for the ground and these vehicles.
pub struct Credentials(tempfile::TempDir);

impl Credentials {
    pub fn make(vehicles: &[&str], more: &[&str]) -> Credentials {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let path = folder.path().join("credentials");
        let vehicles: Vec<&str> = vehicles.iter().flat_map(|it| ["--vehicle", *it]).collect();
        let output = kittiwake(&[&["certs", &path.to_string_lossy()], &vehicles[..], more].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        Credentials(folder)
    }

    /// The folder of a router.
    pub fn of(&self, name: &str) -> PathBuf {
        self.0.path().join("credentials").join(name)
    }

    /// The folder of all.
    pub fn root(&self) -> String {
        self.0.path().join("credentials").to_string_lossy().into_owned()
    }

    pub fn text_of(&self, name: &str) -> String {
        self.of(name).to_string_lossy().into_owned()
    }
}

/// A router and its addresses, which it keeps when it is started again.
pub struct Router {
    process: Process,
    args: Vec<String>,
    /// For its own side.
    pub inside: String,
    /// For the link; empty for one that dials.
    pub link: String,
}

impl Router {
    /// On the ground, letting these vehicles in.
    pub fn ground(credentials: &Credentials, vehicles: &[&str]) -> Router {
        Router::ground_on(credentials, vehicles, "tls/127.0.0.1:0")
    }

    pub fn ground_on(credentials: &Credentials, vehicles: &[&str], link: &str) -> Router {
        Router::start(&["--accept", link, "--certificates", &credentials.text_of("ground-router")], vehicles)
    }

    /// On board, calling the ground at `address`.
    pub fn aircraft(credentials: &Credentials, vehicle: &str, address: SocketAddr) -> Router {
        let locator = format!("tls/localhost:{}", address.port());
        let name = format!("{vehicle}-router");
        Router::start(&["--dial", &locator, "--certificates", &credentials.text_of(&name)], &[vehicle])
    }

    /// Alone, without a link.
    pub fn plain() -> Router {
        Router::start(&[], &[])
    }

    fn start(args: &[&str], vehicles: &[&str]) -> Router {
        let table = shipped().join("zenoh/link.toml");
        let mut args: Vec<String> = args.iter().map(ToString::to_string).collect();
        args.extend(["--link".to_owned(), table.to_string_lossy().into_owned()]);
        args.extend(vehicles.iter().flat_map(|it| ["--vehicle".to_owned(), it.to_string()]));
        let (process, inside, link) = Router::launch(&args, "tcp/127.0.0.1:0");
        Router { process, args, inside, link }
    }

    fn launch(args: &[String], listen: &str) -> (Process, String, String) {
        let mut all = vec!["run", "router", "--listen", listen];
        all.extend(args.iter().map(String::as_str));
        let process = Process::start(&all);
        let inside = process.wait_for("tcp/127.0.0.1:");
        let accepts = args.iter().any(|it| it == "--accept");
        let link = if accepts { process.wait_for("tls/127.0.0.1:") } else { String::new() };
        (process, inside, link)
    }

    /// Where the link is accepted.
    pub fn link_address(&self) -> SocketAddr {
        self.link.trim_start_matches("tls/").parse().expect("a socket address")
    }

    pub fn process(&mut self) -> &mut Process {
        &mut self.process
    }

    pub fn kill(&mut self) {
        self.process.kill();
    }

    /// After [`Router::kill`]: again at the same addresses.
    pub fn start_again(&mut self) {
        let mut args = self.args.clone();
        if let Some(at) = args.iter().position(|it| it == "--accept") {
            args[at + 1] = self.link.clone();
        }
        (self.process, ..) = Router::launch(&args, &self.inside);
    }
}

/// The services of a system, and what an operator sees of them.
pub struct Services {
    processes: Vec<(&'static str, Process)>,
    http: String,
    client: Client,
    access: tempfile::TempDir,
}

pub const ON_BOARD: [&str; 5] = ["vehicle-sim", "skill-manager", "monitor", "planner", "mcm"];
pub const ON_GROUND: [&str; 2] = ["control-tower", "gateway"];

impl Services {
    /// Started with these settings, those of the ground and those on board each at their router.
    pub fn start(ground: &str, on_board: &str, settings: &[&str]) -> Services {
        Services::start_for(OPERATOR, ground, on_board, settings)
    }

    fn start_for(operator: &str, ground: &str, on_board: &str, settings: &[&str]) -> Services {
        // Another test may have made it already: it is the same one.
        let _ = rustls::crypto::ring::default_provider().install_default();
        // A connection for each request: the gateway closes one that was idle for `head_timeout_s`, perhaps while a request is on its way.
        let client = Client::builder().timeout(LIMIT).pool_max_idle_per_host(0).build().unwrap();
        let mut services = Services { processes: Vec::new(), http: String::new(), client, access: tokens(operator) };
        let config = shipped().join("kittiwake.toml").to_string_lossy().into_owned();
        let access = services.access.path().to_string_lossy().into_owned();
        for (names, router) in [(&ON_GROUND[..], ground), (&ON_BOARD[..], on_board)] {
            for &name in names {
                let service = Service::ALL.into_iter().find(|it| it.name() == name).expect("it is a service");
                let settings = [&["--access", &access], settings].concat();
                let read = settings.chunks(2).filter(|it| service.reads(it[0])).flatten().copied().collect();
                let basics = vec!["run", name, "--config", &config, "--connect", router];
                services.processes.push((name, Process::start(&[basics, read].concat())));
            }
        }
        services.http = services.process("gateway").wait_for("http://");
        wait_for("the ground to see the vehicle", || services.get("/readyz").filter(|(it, _)| *it == 200).map(drop));
        services
    }

    /// The operator's document about the vehicle.
    pub fn document(&self) -> Value {
        self.get("/api/v1/vehicles/uav1").map(|(_, body)| body).unwrap_or_default()
    }

    /// Wall seconds since the source was last heard on the ground.
    pub fn age(&self, source: &str) -> f64 {
        self.document()["sources"][source]["wallAgeS"].as_f64().unwrap_or(f64::INFINITY)
    }

    /// Waits until the vehicle flies its mission, as seen from the ground.
    #[track_caller]
    pub fn wait_in_flight(&self) {
        wait_for("the vehicle to fly its mission", || {
            (self.document()["aircraft"]["status"]["actualMode"] == "FLIGHT_MODE_OFFBOARD").then_some(())
        });
    }

    pub fn get(&self, path: &str) -> Option<(u16, Value)> {
        let response = self.client.get(format!("{}{path}", self.http)).bearer_auth(TOKEN).send().ok()?;
        Some((response.status().as_u16(), json_of(response)))
    }

    /// Orders something and waits for the answer.
    pub fn post(&self, path: &str) -> (u16, Value) {
        post(&self.client, &self.http, path)
    }

    /// The same from another thread.
    pub fn post_later(&self, path: &str) -> std::thread::JoinHandle<(u16, Value)> {
        let (client, http, path) = (self.client.clone(), self.http.clone(), path.to_owned());
        std::thread::spawn(move || post(&client, &http, &path))
    }

    pub fn process(&mut self, service: &str) -> &mut Process {
        &mut self.processes.iter_mut().find(|(name, _)| *name == service).expect("it was started").1
    }

    /// Fails if one has ended: none is started again here.
    #[track_caller]
    pub fn expect_all_run(&mut self) {
        for (name, process) in &mut self.processes {
            assert!(process.runs(), "{name} has ended; it said:\n{}", process.lines().join("\n"));
        }
    }
}

/// A whole vehicle, the ground, and the link between them.
pub struct Deployment {
    pub services: Services,
    pub ground: Router,
    pub aircraft: Router,
    pub proxy: Proxy,
    _credentials: Credentials,
}

impl Deployment {
    /// Everything started, with these settings for the services.
    pub fn start(settings: &[&str]) -> Deployment {
        Deployment::start_for(OPERATOR, settings)
    }

    /// The same for an operator of this name.
    pub fn start_for(operator: &str, settings: &[&str]) -> Deployment {
        let credentials = Credentials::make(&["uav1"], &[]);
        let ground = Router::ground(&credentials, &["uav1"]);
        let proxy = Proxy::to(ground.link_address(), 1);
        let aircraft = Router::aircraft(&credentials, "uav1", proxy.address);
        let services = Services::start_for(operator, &ground.inside, &aircraft.inside, settings);
        Deployment { services, ground, aircraft, proxy, _credentials: credentials }
    }
}

/// When a test fails: the log of each process, which mostly shows the cause.
impl Drop for Deployment {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            return;
        }
        let routers = [("ground-router", &self.ground.process), ("aircraft-router", &self.aircraft.process)];
        let services = self.services.processes.iter().map(|(name, process)| (*name, process));
        for (name, process) in routers.into_iter().chain(services) {
            let lines = process.lines();
            eprintln!("{name} said at last:");
            lines.iter().skip(lines.len().saturating_sub(LAST_LINES)).for_each(|it| eprintln!("    {it}"));
        }
        eprintln!("the ground saw: {:#}", self.services.document()["sources"]);
    }
}

fn post(client: &Client, http: &str, path: &str) -> (u16, Value) {
    let key = format!("{:?}", Instant::now());
    match client.post(format!("{http}{path}")).bearer_auth(TOKEN).header("Idempotency-Key", key).send() {
        Ok(response) => (response.status().as_u16(), json_of(response)),
        Err(cause) => (0, Value::String(cause.to_string())),
    }
}

fn json_of(response: Response) -> Value {
    response.text().ok().and_then(|it| serde_json::from_str(&it).ok()).unwrap_or_default()
}

/// A folder with one token that has every role.
fn tokens(operator: &str) -> tempfile::TempDir {
    use gateway::access::{Role, entry};
    use std::os::unix::fs::OpenOptionsExt;
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let path = folder.path().join("tokens.toml");
    let mut file = std::fs::OpenOptions::new().write(true).create_new(true).mode(0o600).open(path).unwrap();
    std::io::Write::write_all(&mut file, entry(operator, &Role::ALL, TOKEN).as_bytes()).unwrap();
    folder
}

/// Replaces `from` by `to` in a copy of the shipped table.
#[track_caller]
pub fn table_with(folder: &Path, from: &str, to: &str) -> String {
    let text = std::fs::read_to_string(shipped().join("zenoh/link.toml")).unwrap();
    assert!(text.contains(from), "`{from}` is not in the table");
    let path = folder.join("link.toml");
    std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
    path.to_string_lossy().into_owned()
}
