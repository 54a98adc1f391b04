//! Two routers: the aircraft's processes and the ground's, each with a router of its own, an encrypted link between them that
//! may have faults, and units that keep them up. As docs/deployment.md describes it, on one machine.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::Command;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, SyncSender};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use bus::Scope;
use kittiwake::backend::Backend;
use kittiwake::service::Service;

use super::kept::{Kept, Spec};
use super::{Reach, Setup, VEHICLE};
use crate::clock::Side;
use crate::link::FaultyLink;
use crate::run::heard::Heard;
use crate::trouble::Victim;

/// How often processes are looked after.
const PERIOD: Duration = Duration::from_millis(10);
/// A process listens within this.
const LISTENS_WITHIN: Duration = Duration::from_secs(20);
/// Tells systems apart.
static NEXT_ID: AtomicU32 = AtomicU32::new(1);

/// Keeps all processes up; they end with the value.
pub(crate) struct Keeper {
    id: u32,
    shared: Shared,
    thread: Option<JoinHandle<()>>,
}

/// What others may know of the processes.
#[derive(Debug, Clone, Default)]
pub(crate) struct Shared(Arc<(Mutex<BTreeMap<String, u32>>, AtomicBool)>);

impl Shared {
    pub(super) fn list(&self) -> Vec<(String, u32)> {
        let ids = self.0.0.lock().unwrap_or_else(|it| it.into_inner());
        ids.iter().map(|(name, id)| (name.clone(), *id)).collect()
    }

    pub(super) fn is_kept_up(&self) -> bool {
        !self.0.1.load(Ordering::SeqCst)
    }

    fn update(&self, kept: &[Kept]) {
        let ids = kept.iter().filter_map(|it| Some((it.spec.name.to_owned(), it.id()?)));
        *self.0.0.lock().unwrap_or_else(|it| it.into_inner()) = ids.collect();
    }
}

impl Keeper {
    /// Starts both sides. The first time certificates, a token and the link are made; they outlive a loss of power.
    pub(super) fn start(setup: &Arc<Setup>, heard: &SyncSender<Heard>) -> Result<Keeper, String> {
        make_credentials(setup)?;
        let accept = setup.link.get().map_or("tls/127.0.0.1:0".to_owned(), |it| format!("tls/{}", it.ground()));
        let id = NEXT_ID.fetch_add(1, Ordering::SeqCst);
        let start = |spec| Kept::start(spec, setup, heard, id);
        let (mut ground_router, lines) = start(router(setup, Side::Ground, ["--accept", &accept]))?;
        let address = find(&lines, |it| it.strip_prefix("tls/")?.parse().ok());
        let address: SocketAddr = address.ok_or("the ground's router does not listen for the link")?;
        // One that is started again is where the aircraft calls.
        ground_router.spec = router(setup, Side::Ground, ["--accept", &format!("tls/{address}")]);
        let link = setup.link.get_or_init(|| Arc::new(FaultyLink::to(address, setup.seed)));
        let dial = format!("tls/localhost:{}", link.address().port());
        let mut kept = vec![ground_router, start(router(setup, Side::Aircraft, ["--dial", &dial]))?.0];
        let mut http = String::new();
        for service in Backend::Sim.services() {
            let (mut process, lines) = start(unit_of(setup, service, "127.0.0.1:0"))?;
            if service == Service::Gateway {
                let said = find(&lines, |it| it.strip_prefix("http://").map(|it| it.trim_end_matches('/').to_owned()));
                http = said.ok_or("the gateway does not listen")?;
                // One that is started again keeps its address.
                process.spec = unit_of(setup, service, &http);
            }
            kept.push(process);
        }
        let shared = Shared::default();
        shared.update(&kept);
        // Fails only once the run is over.
        let _ = heard.send(Heard::Up(id, reach(setup, http)));
        let (setup, heard, theirs) = (setup.clone(), heard.clone(), shared.clone());
        let thread = std::thread::spawn(move || keep_up(kept, &setup, &heard, &theirs, id));
        Ok(Keeper { id, shared, thread: Some(thread) })
    }

    pub(super) fn id(&self) -> u32 {
        self.id
    }

    pub(super) fn processes(&self) -> Shared {
        self.shared.clone()
    }
}

impl Drop for Keeper {
    fn drop(&mut self) {
        self.shared.0.1.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            // One that panicked has printed why.
            let _ = thread.join();
        }
    }
}

/// Until the keeper ends. Then everything is killed at once, before any is waited for: none sees another one die.
fn keep_up(mut kept: Vec<Kept>, setup: &Setup, heard: &SyncSender<Heard>, shared: &Shared, id: u32) {
    while shared.is_kept_up() {
        for it in &mut kept {
            if let Some(text) = it.tend(setup, heard, id) {
                // Fails only once the run is over.
                let _ = heard.send(Heard::Line(id, text));
            }
        }
        shared.update(&kept);
        std::thread::sleep(PERIOD);
    }
    kept.iter_mut().for_each(Kept::kill);
}

fn make_credentials(setup: &Setup) -> Result<(), String> {
    let (folder, access, token) = (credentials(setup), setup.scratch.join("access"), setup.scratch.join("token"));
    if folder.exists() {
        return Ok(());
    }
    std::fs::create_dir(&access).map_err(|it| format!("{}: {it}", access.display()))?;
    let mut certs = Command::new(&setup.program);
    certs.arg("certs").arg(&folder).args(["--vehicle", VEHICLE]);
    if let Some(clocks) = &setup.clocks {
        clocks.give_yesterday(&mut certs);
    }
    let mut operator = Command::new(&setup.program);
    operator.arg("access").arg(&access).arg("--secret").arg(&token);
    for mut command in [certs, operator] {
        let output = command.output().map_err(|it| format!("{}: {it}", setup.program.display()))?;
        if !output.status.success() {
            return Err(String::from_utf8_lossy(&output.stderr).trim().to_owned());
        }
    }
    Ok(())
}

fn credentials(setup: &Setup) -> PathBuf {
    setup.scratch.join("credentials")
}

/// The locator of that side's router.
fn locator(setup: &Setup, side: Side) -> String {
    bus::sockets::locator_of(&setup.scratch.join(match side {
        Side::Aircraft => "aircraft.sock",
        Side::Ground => "ground.sock",
    }))
}

fn router(setup: &Setup, side: Side, way: [&str; 2]) -> Spec {
    let (name, certificate) = match side {
        Side::Aircraft => (Victim::Router.name(), format!("{VEHICLE}-router")),
        Side::Ground => (Victim::GroundRouter.name(), "ground-router".to_owned()),
    };
    let table = setup.config.with_file_name("zenoh").join("link.toml");
    let mut args: Vec<OsString> = ["--listen", &locator(setup, side), "--vehicle", VEHICLE].map(Into::into).into();
    args.extend(way.map(Into::into));
    args.extend(["--link".into(), table.into(), "--certificates".into(), credentials(setup).join(certificate).into()]);
    Spec { name, subcommand: "router", side, args }
}

fn unit_of(setup: &Setup, service: Service, http: &str) -> Spec {
    let side = if matches!(service.scope(VEHICLE), Scope::Fleet) { Side::Ground } else { Side::Aircraft };
    let (seed, permissions) = (setup.seed.to_string(), setup.permissions.name());
    let words = ["--connect", &locator(setup, side), "--vehicle", VEHICLE, "--speed", &setup.speed, "--http", http];
    let more = ["--seed", &seed, "--permissions", permissions];
    let mut args: Vec<OsString> = words.into_iter().chain(more).map(Into::into).collect();
    let paths: [(&str, PathBuf); 6] = [
        ("--config", setup.config.clone()),
        ("--state", setup.state()),
        ("--recordings", setup.scratch.join("recordings")),
        ("--access", setup.scratch.join("access")),
        ("--tower-secret", credentials(setup).join("control-tower").join("control-tower.key")),
        ("--tower-key", credentials(setup).join("for-vehicles").join("control-tower.pub")),
    ];
    args.extend(paths.into_iter().flat_map(|(flag, path)| [flag.into(), path.into()]));
    Spec { name: service.name(), subcommand: service.name(), side, args }
}

fn reach(setup: &Setup, http: String) -> Reach {
    let (url, token) = (format!("http://{http}"), setup.scratch.join("token"));
    let target = ["--url".into(), url.into(), "--token-file".into(), token.into(), "--vehicle".into(), VEHICLE.into()];
    let [on_board, ground] = [Side::Aircraft, Side::Ground].map(|it| locator(setup, it));
    Reach { on_board, ground, http, target: target.into() }
}

/// What is looked for in the lines of a process that was started just now.
fn find<T>(lines: &Receiver<String>, look: impl Fn(&str) -> Option<T>) -> Option<T> {
    let until = Instant::now() + LISTENS_WITHIN;
    let next = || lines.recv_timeout(until.saturating_duration_since(Instant::now())).ok();
    std::iter::from_fn(next).find_map(|it| look(&it))
}
