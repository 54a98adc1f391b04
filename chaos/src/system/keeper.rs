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

use super::kept::{START_LIMIT, Spec, SupervisedProcess};
use super::{Reach, Setup, VEHICLE};
use crate::clock::Side;
use crate::link::FaultyLink;
use crate::run::heard::Heard;
use crate::trouble::Victim;

/// How often processes are looked after.
const PERIOD: Duration = Duration::from_millis(10);
/// A process listens within this, also where its first start hangs until it is killed for that. What ends is started again
/// meanwhile, as systemd does without end; what does not listen after all this does not come back.
const LISTENS_WITHIN: Duration = START_LIMIT.saturating_add(Duration::from_secs(20));
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
pub(crate) struct Shared(Arc<Known>);

/// What the keeper's thread and the others tell each other.
#[derive(Debug, Default)]
struct Known {
    /// By the names of the processes that run, with whether they are ready.
    running: Mutex<BTreeMap<String, (u32, bool)>>,
    is_over: AtomicBool,
    /// Until when the aircraft's computer is without power.
    companion_off_until: Mutex<Option<Instant>>,
}

impl Shared {
    pub(super) fn list(&self) -> Vec<(String, u32)> {
        let running = self.0.running.lock().unwrap_or_else(|it| it.into_inner());
        running.iter().map(|(name, (id, _))| (name.clone(), *id)).collect()
    }

    pub(super) fn is_ready(&self, id: u32) -> bool {
        let running = self.0.running.lock().unwrap_or_else(|it| it.into_inner());
        running.values().any(|it| *it == (id, true))
    }

    pub(super) fn is_kept_up(&self) -> bool {
        !self.0.is_over.load(Ordering::SeqCst)
    }

    pub(super) fn take_down_companion(&self, until: Instant) {
        *self.0.companion_off_until.lock().unwrap_or_else(|it| it.into_inner()) = Some(until);
    }

    pub(super) fn companion_off_until(&self) -> Option<Instant> {
        let mut until = self.0.companion_off_until.lock().unwrap_or_else(|it| it.into_inner());
        until.take_if(|it| *it <= Instant::now());
        *until
    }

    fn update(&self, kept: &[SupervisedProcess]) {
        let running = kept.iter().filter_map(|it| Some((it.spec.name.to_owned(), (it.id()?, it.is_ready()))));
        *self.0.running.lock().unwrap_or_else(|it| it.into_inner()) = running.collect();
    }
}

impl Keeper {
    /// Starts both sides. The first time certificates, a token and the link are made; they outlive a loss of power. It says once
    /// where the system can be reached, or why it ended.
    pub(super) fn start(setup: &Arc<Setup>, heard: &SyncSender<Heard>) -> Keeper {
        let (id, shared) = (NEXT_ID.fetch_add(1, Ordering::SeqCst), Shared::default());
        let all = All { setup: setup.clone(), heard: heard.clone(), shared: shared.clone(), id, kept: Vec::new() };
        Keeper { id, shared, thread: Some(std::thread::spawn(move || all.keep_up())) }
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
        self.shared.0.is_over.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            // One that panicked has printed why.
            let _ = thread.join();
        }
    }
}

/// All processes of both sides, in the keeper's thread.
struct All {
    setup: Arc<Setup>,
    heard: SyncSender<Heard>,
    shared: Shared,
    id: u32,
    kept: Vec<SupervisedProcess>,
}

impl All {
    /// Until the keeper ends. Then everything is killed at once, before any is waited for: none sees another one die.
    fn keep_up(mut self) {
        // Sending fails only once the run is over. The same below.
        match self.start() {
            Ok(reach) => {
                let _ = self.heard.send(Heard::Up(self.id, reach));
                while self.shared.is_kept_up() {
                    self.tend();
                    std::thread::sleep(PERIOD);
                }
            }
            Err(why) if self.shared.is_kept_up() => {
                self.say(why);
                let _ = self.heard.send(Heard::Ended(self.id));
            }
            // It was not to be up any more.
            Err(_) => {}
        }
        self.kept.iter_mut().for_each(SupervisedProcess::kill);
    }

    fn say(&self, text: String) {
        let _ = self.heard.send(Heard::Line(self.id, text));
    }

    /// Starts again what has ended, and takes down what is without power, all at once: none sees another one die.
    fn tend(&mut self) {
        let Self { setup, heard, id, kept, shared } = self;
        if let Some(until) = shared.companion_off_until() {
            let is_on_companion =
                |it: &&mut SupervisedProcess| Victim::ON_COMPANION.iter().any(|victim| victim.name() == it.spec.name);
            kept.iter_mut().filter(is_on_companion).for_each(|it| it.stay_off_until(until));
        }
        let said: Vec<String> = kept.iter_mut().filter_map(|it| it.tend(setup, heard, *id)).collect();
        said.into_iter().for_each(|it| self.say(it));
        self.shared.update(&self.kept);
    }

    fn start(&mut self) -> Result<Reach, String> {
        let setup = self.setup.clone();
        make_credentials(&setup)?;
        let accept = setup.link.get().map_or("tls/127.0.0.1:0".to_owned(), |it| format!("tls/{}", it.ground()));
        let address: SocketAddr = self.start_one(router(&setup, Side::Ground, ["--accept", &accept]), |it| {
            it.strip_prefix("tls/")?.parse().ok()
        })?;
        // One that is started again is where the aircraft calls.
        self.again_with(router(&setup, Side::Ground, ["--accept", &format!("tls/{address}")]));
        let link = setup.link.get_or_init(|| Arc::new(FaultyLink::to(address, setup.seed)));
        let dial = format!("tls/localhost:{}", link.address().port());
        self.keep(router(&setup, Side::Aircraft, ["--dial", &dial]))?;
        let mut http = String::new();
        for service in Backend::Sim.services() {
            let spec = unit_of(&setup, service, "127.0.0.1:0");
            if service == Service::Gateway {
                http = self
                    .start_one(spec, |it| it.strip_prefix("http://").map(|it| it.trim_end_matches('/').to_owned()))?;
                // One that is started again keeps its address.
                self.again_with(unit_of(&setup, service, &http));
            } else {
                self.keep(spec)?;
            }
        }
        Ok(reach(&setup, http))
    }

    /// Keeps up a process that was not there before; what it says.
    fn keep(&mut self, spec: Spec) -> Result<Receiver<String>, String> {
        let (kept, lines) = SupervisedProcess::new(spec, &self.setup)?;
        self.kept.push(kept);
        self.tend();
        Ok(lines)
    }

    /// How the newest process is started if it ends.
    fn again_with(&mut self, spec: Spec) {
        if let Some(newest) = self.kept.last_mut() {
            newest.spec = spec;
        }
    }

    /// Keeps up a process, and all the others meanwhile, until it has said what is looked for.
    fn start_one<T>(&mut self, spec: Spec, look: impl Fn(&str) -> Option<T>) -> Result<T, String> {
        let name = spec.name;
        let lines = self.keep(spec)?;
        let until = Instant::now() + LISTENS_WITHIN;
        while self.shared.is_kept_up() && Instant::now() < until {
            if let Some(found) = lines.try_iter().find_map(|it| look(&it)) {
                return Ok(found);
            }
            self.tend();
            std::thread::sleep(PERIOD);
        }
        Err(format!("{name} does not listen within {LISTENS_WITHIN:?}, though it is started again whenever it ends"))
    }
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
    Spec { name, command: vec!["run", "router"], side, args }
}

fn unit_of(setup: &Setup, service: Service, http: &str) -> Spec {
    let side = if matches!(service.scope(VEHICLE), Scope::Fleet) { Side::Ground } else { Side::Aircraft };
    let (seed, permissions) = (setup.seed.to_string(), setup.permissions.name());
    let given: [(&str, OsString); 11] = [
        ("--vehicle", VEHICLE.into()),
        ("--speed", setup.speed.clone().into()),
        ("--http", http.into()),
        ("--seed", seed.into()),
        ("--permissions", permissions.into()),
        ("--config", setup.config.clone().into()),
        ("--recordings", setup.scratch.join("recordings").into()),
        ("--access", setup.scratch.join("access").into()),
        ("--tower-secret", credentials(setup).join("control-tower").join("control-tower.key").into()),
        ("--tower-key", credentials(setup).join("for-vehicles").join("control-tower.pub").into()),
        ("--state", setup.state().into()),
    ];
    let read = given.into_iter().filter(|(option, _)| service.reads(option));
    let connect = ("--connect", locator(setup, side).into());
    let args = read.chain([connect]).flat_map(|(option, value)| [option.into(), value]).collect();
    Spec { name: service.name(), command: vec!["run", service.name()], side, args }
}

fn reach(setup: &Setup, http: String) -> Reach {
    let (url, token) = (format!("http://{http}"), setup.scratch.join("token"));
    let target = ["--url".into(), url.into(), "--token-file".into(), token.into(), "--vehicle".into(), VEHICLE.into()];
    let [on_board, ground] = [Side::Aircraft, Side::Ground].map(|it| locator(setup, it));
    Reach { on_board, ground, http, target: target.into() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kittiwake::run::run_file::RunFolder;
    use std::sync::mpsc::sync_channel;

    impl All {
        /// Looks after the processes until those that run are so.
        #[track_caller]
        fn tend_until(&mut self, is: impl Fn(&[(String, u32)]) -> bool) {
            let until = Instant::now() + LISTENS_WITHIN;
            while !is(&self.shared.list()) {
                assert!(Instant::now() < until, "{:?}", self.shared.list());
                std::thread::sleep(PERIOD);
                self.tend();
            }
        }
    }

    #[test]
    fn what_ends_before_it_listens_is_started_again_until_it_does() {
        let folder = RunFolder::create("keeper-test").unwrap();
        let (setup, (sender, heard)) = (Arc::new(Setup::made_up("/bin/sh", &folder.0)), sync_channel(100));
        let mut all = All { setup, heard: sender, shared: Shared::default(), id: 1, kept: Vec::new() };
        let second = folder.0.join("second").display().to_string();
        let script = format!("test -e {second} && echo listens at 7 && exec sleep 60; touch {second}; exit 3");
        let spec = Spec { name: "gateway", command: vec!["-c"], side: Side::Ground, args: vec![script.into()] };
        let found = all.start_one(spec, |it| it.strip_prefix("listens at ").map(str::to_owned));
        assert_eq!(found.as_deref(), Ok("7"));
        let ended = |it: Heard| matches!(it, Heard::Line(1, line) if line.contains("gateway ended with exit code 3"));
        assert_eq!(heard.try_iter().map(ended).filter(|it| *it).count(), 1);
    }

    #[test]
    fn those_of_a_computer_without_power_die_and_none_is_started_before_it_has_power_again() {
        let folder = RunFolder::create("keeper-test").unwrap();
        let (setup, (sender, _heard)) = (Arc::new(Setup::made_up("/bin/sh", &folder.0)), sync_channel(100));
        let mut all = All { setup, heard: sender, shared: Shared::default(), id: 1, kept: Vec::new() };
        for name in ["gateway", "mcm", "router"] {
            let args = vec!["exec sleep 60".into()];
            drop(all.keep(Spec { name, command: vec!["-c"], side: Side::Aircraft, args }).unwrap());
        }
        let before = all.shared.list();
        let until = Instant::now() + Duration::from_millis(500);
        all.shared.take_down_companion(until);
        all.tend_until(|running| *running == before[..1]);
        all.tend_until(|running| running.len() == 3);
        assert!(until <= Instant::now(), "started without power");
        let after = all.shared.list();
        assert!(after[0] == before[0] && after[1] != before[1] && after[2] != before[2], "{before:?} {after:?}");
    }

    #[test]
    fn a_system_that_cannot_start_says_so_and_ends() {
        let folder = RunFolder::create("keeper-test").unwrap();
        let setup = Arc::new(Setup::made_up("/nowhere/kittiwake", &folder.0));
        let (sender, heard) = sync_channel(100);
        let keeper = Keeper::start(&setup, &sender);
        drop(sender);
        let said: Vec<Heard> = heard.iter().take(2).collect();
        assert!(matches!(&said[0], Heard::Line(id, why) if *id == keeper.id() && why.contains("/nowhere/kittiwake")));
        assert!(matches!(said[1], Heard::Ended(id) if id == keeper.id()));
    }
}
