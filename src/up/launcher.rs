//! The launcher's only loop: passes events to the supervisor, the progress and the screen.

use std::collections::BTreeSet;
use std::io;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

use bus::{Link, Scope, Stop};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1::MissionReport;
use node::Event;
use signal_hook::consts::SIGHUP;

use crate::backend::Backend;
use crate::cli::UpArgs;
use crate::config::Config;
use crate::outcome::Outcome;
use crate::output;
use crate::run::run_file::{RunFile, RunFolder, Running};
use crate::run::{end, state_folder, tower_key};
use crate::setup::access::DemoAccess;
use crate::up::aircraft::{Aircraft, State};
use crate::up::children::Children;
use crate::up::flown_files::FlownFiles;
use crate::up::liveness::Liveness;
use crate::up::own_time::OwnTime;
use crate::up::progress::Progress;
use crate::up::screen::Screen;
use crate::up::supervise::{Child, Ending, Supervisor, Verdict};
use crate::up::watch::{Hearing, Watch};
use crate::up::{Happening, report};

/// Services that were asked to end and run after this time are killed; then the router is ended.
const SERVICES_END: Duration = Duration::from_millis(2500);
const ROUTER_END: Duration = Duration::from_secs(1);
/// Period of updates of the screen.
const REFRESH: Duration = Duration::from_millis(200);
/// What is taken in before anything else is looked at: more than comes within a second at twenty times real time.
const MOST_A_TURN: usize = 4096;

/// A system being brought up and kept up.
pub struct Launcher<'a> {
    args: &'a UpArgs,
    backend: Backend,
    config: Config,
    /// What every process is started with.
    files: FlownFiles,
    start: Instant,
    own_time: OwnTime,
    happenings: Receiver<Happening>,
    sender: Sender<Happening>,
    /// Made for this run, unless the arguments name tokens.
    demo: Option<DemoAccess>,
    /// The folder of the recordings, if missions are recorded.
    recordings: Option<PathBuf>,
    /// Made for this run, unless the arguments name a folder; kept until the end.
    state: Option<RunFolder>,
    supervisor: Supervisor,
    children: Children,
    liveness: Liveness,
    aircraft: Aircraft,
    progress: Progress,
    screen: Screen,
    bus: Stop,
    hearing: Hearing,
    /// The router's locator, once it listens.
    locator: Option<String>,
    /// The gateway's address, once it listens.
    http: Option<String>,
    /// Made when all processes were seen for the first time.
    run_file: Option<RunFile>,
    reported: Option<Outcome>,
    /// What lasts and was logged, each once: reasons to give up in the air, and a run file that cannot be written.
    logged: BTreeSet<String>,
}

/// Why the loop ends.
enum End {
    /// The mission is over, the aircraft is on the ground, and the launcher is to end with the mission.
    Reported(Outcome),
    Interrupted,
    /// A process refused its input before all ran: nothing was flown.
    Refused(String),
    GaveUp(String),
}

impl<'a> Launcher<'a> {
    /// Nothing is started yet.
    pub fn new(
        args: &'a UpArgs,
        backend: Backend,
        config: Config,
        mut files: FlownFiles,
        sender: Sender<Happening>,
        happenings: Receiver<Happening>,
    ) -> io::Result<Launcher<'a>> {
        let mut settings = files.settings.clone();
        let demo = match settings.access {
            Some(_) => None,
            None => Some(DemoAccess::create()?),
        };
        settings.access = settings.access.or_else(|| demo.as_ref().map(|it| it.folder.0.clone()));
        let wanted = 0 < config.gateway.recording.most_files;
        settings.recordings = settings.recordings.or_else(state_folder::recordings);
        let recordings = settings.recordings.clone().filter(|_| wanted);
        let state = match settings.state {
            Some(_) => None,
            // `nohup` says that the system flies on when its user has logged out.
            None => Some(RunFolder::create_in_memory("state", end::is_ignored(SIGHUP))?),
        };
        settings.state = settings.state.or_else(|| state.as_ref().map(|it| it.0.clone()));
        // The launcher makes the key, so that no vehicle has to trust the first one that it hears.
        if let (None, None, Some(folder)) = (&settings.tower_key, &settings.tower_secret, &settings.state) {
            tower_key::in_folder(folder).map_err(io::Error::other)?;
            settings.tower_key = Some(folder.join(tower_key::PUBLIC));
        }
        // One that cannot be used is for the mission manager to refuse, in its words.
        if let Some(key) = settings.tower_key.clone().filter(|it| tower_key::read_public(it).is_ok()) {
            settings.tower_key = Some(files.keep_tower_key(&key).map_err(io::Error::other)?);
        }
        settings.simulated = backend == Backend::Sim;
        let mut children = Children::new(&settings, sender.clone())?;
        args.listen.iter().try_for_each(|it| children.listen_at(it))?;
        Ok(Launcher {
            args,
            backend,
            recordings,
            demo,
            state,
            start: Instant::now(),
            own_time: OwnTime::default(),
            supervisor: Supervisor::new(
                &config.launcher.restart,
                &Child::of_services(&backend.services(), args.onboard),
            ),
            children,
            liveness: Liveness::new(config.launcher.hung_after_s.seconds()),
            aircraft: Aircraft::default(),
            progress: Progress::default(),
            screen: Screen::new(args.json),
            bus: Stop::new(),
            hearing: Hearing::default(),
            locator: None,
            http: None,
            run_file: None,
            reported: None,
            logged: BTreeSet::new(),
            config,
            files,
            happenings,
            sender,
        })
    }

    /// Runs the system to its end; no process is left running.
    pub fn run(mut self) -> Outcome {
        let end = self.keep_up();
        self.screen.end_progress();
        if self.aircraft.state(self.now()) == State::InTheAir {
            self.screen.log("the aircraft is in the air, and from here on its autopilot alone answers for it");
        }
        let outcome = match end {
            End::Reported(outcome) => outcome,
            // A mission that has ended counts more than how the launcher ends.
            End::Interrupted => self.reported.unwrap_or_else(|| self.unfinished("interrupted", Outcome::Interrupted)),
            End::Refused(reason) => {
                self.screen.log(&reason);
                Outcome::BadInput
            }
            End::GaveUp(reason) => self.unfinished(&reason, Outcome::NotKeptUp),
        };
        self.end_children();
        outcome
    }

    fn keep_up(&mut self) -> End {
        loop {
            if self.own_time.begin_turn(self.start.elapsed()) {
                self.liveness.held_up(self.own_now());
            }
            if let Some(end) = self.start_due() {
                return end;
            }
            if let Some(end) = self.hear() {
                return end;
            }
            self.keep_hearing();
            self.end_what_hangs();
            self.keep_places();
            self.show_progress();
            if let Some(end) = self.check_start().or_else(|| self.check_report()) {
                return end;
            }
        }
    }

    /// Waits for something to happen, and takes in what else has happened, in its order. What is asked after each turn is so asked once for all
    /// of it: a launcher that waited for the processor catches up, instead of hearing of a death behind thousands of positions.
    fn hear(&mut self) -> Option<End> {
        let mut next = match self.happenings.recv_timeout(REFRESH.min(self.until_due())) {
            Ok(happening) => Some(happening),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => {
                return Some(End::GaveUp("the launcher receives no messages any more".into()));
            }
        };
        let is_reported = self.progress.report().is_some();
        for _ in 0..MOST_A_TURN {
            if let Some(end) = self.on(next?) {
                return Some(end);
            }
            // Each report is told, also one that the next mission follows at once.
            if self.progress.report().is_some() != is_reported {
                break;
            }
            next = self.happenings.try_recv().ok();
        }
        None
    }

    fn show_progress(&mut self) {
        if self.run_file.is_some() && self.reported.is_none() {
            self.screen.progress(&self.progress, self.now());
        }
    }

    fn start_due(&mut self) -> Option<End> {
        let due = self.supervisor.due(self.own_now());
        if !due.is_empty() {
            self.restore_files();
        }
        for child in due {
            if let Err(cause) = self.children.start(child, self.locator.as_deref()) {
                // Like a death: what the operating system lacks now it may have again later.
                self.screen.log(&format!("{child} cannot be started: {cause}"));
                if let Some(end) = self.judge(child, Ending::NotStarted) {
                    return Some(end);
                }
            }
        }
        None
    }

    /// Without its files nothing could be started.
    fn restore_files(&self) {
        let access = self.demo.as_ref().map_or(Ok(false), DemoAccess::restore);
        match self.files.restore().and_then(|files| Ok(files || access?)) {
            Ok(false) => {}
            Ok(true) => self.screen.log("files of this run were removed or changed: they are written again"),
            Err(cause) => {
                self.screen.log(&format!("files of this run were removed or changed and cannot be written: {cause}"))
            }
        }
    }

    fn until_due(&self) -> Duration {
        self.supervisor.deadline().map_or(REFRESH, |it| it.saturating_sub(self.own_now()))
    }

    fn on(&mut self, happening: Happening) -> Option<End> {
        match happening {
            Happening::Line { child, text } => self.on_line(child, text),
            Happening::Log { child, text } => self.screen.log(&format!("{child}: {text}")),
            Happening::Ended(child) => return self.on_ended(child),
            Happening::Event(event) => {
                if self.hearing.heard() {
                    self.screen.log("the launcher hears the bus again");
                }
                self.on_event(*event);
            }
            Happening::BusEnded(Ok(())) => {}
            Happening::BusEnded(Err(cause)) => {
                self.hearing.ended(self.own_now());
                return self.give_up_on_ground(format!("the launcher does not hear the bus any more: {cause}"));
            }
            Happening::Interrupted => return Some(End::Interrupted),
        }
        None
    }

    fn on_event(&mut self, event: Event) {
        match event {
            // Ground processes are there for no vehicle; those of another one are not the launcher's.
            Event::Peer { vehicle, service, alive: true, .. }
                if vehicle.is_empty() || *vehicle == *self.config.vehicle.as_str() =>
            {
                if let Some(child) = self.supervisor.child(&service) {
                    self.supervisor.seen(child);
                    self.children.seen(child);
                    self.liveness.heard(child, self.own_now());
                }
            }
            Event::Message { message: Message::Heartbeat(heartbeat), .. } => {
                let child = self.supervisor.child(&heartbeat.service);
                // Not that of a child that has been started again since, nor of another system's, nor of another vehicle's.
                if let Some(child) = child.filter(|it| self.children.is_process(*it, heartbeat.pid)) {
                    self.liveness.heard(child, self.own_now());
                }
            }
            Event::Message { vehicle, message } if *vehicle == *self.config.vehicle.as_str() => {
                self.aircraft.on(&message, self.now());
                if let Some(line) = self.progress.on(message) {
                    self.screen.line(&line);
                }
            }
            Event::Message { .. } | Event::Request { .. } | Event::Reply { .. } | Event::Peer { .. } => {}
        }
    }

    /// The router's first line is its locator, and the gateway's first line its address.
    fn on_line(&mut self, child: Child, text: String) {
        match child {
            Child::Router => {
                if self.locator.is_none() {
                    self.join(&text);
                    self.locator = Some(text);
                }
                if !self.supervisor.router_is_seen() {
                    self.liveness.router_listens(self.own_now());
                }
                self.supervisor.router_listens(self.own_now());
            }
            Child::Service(_) | Child::Onboard(_) => {
                let address = text.strip_prefix("https://").or_else(|| text.strip_prefix("http://"));
                if let Some(address) = address.and_then(|it| it.parse().ok()) {
                    self.children.keep_http(address);
                    self.http = Some(text);
                }
            }
        }
    }

    /// Connects to the bus of the router at `locator`.
    fn join(&mut self, locator: &str) {
        let link = Link {
            connect: vec![locator.to_owned()],
            scope: Scope::Fleet,
            open_timeout: self.config.connect_limit_s.seconds(),
        };
        // One that has ended needs no stop any more.
        self.bus = Stop::new();
        let (sender, stop) = (self.sender.clone(), self.bus.clone());
        let watching = std::thread::Builder::new().name("watch".into()).spawn(move || {
            let result = bus::Process::of(&mut Watch(sender.clone()), &link).run(&stop);
            // Fails only while the launcher ends.
            let _ = sender.send(Happening::BusEnded(result));
        });
        if let Err(cause) = watching {
            self.hearing.ended(self.own_now());
            let said = format!("the launcher cannot listen to the bus: {cause}; it tries again");
            if self.logged.insert(said.clone()) {
                self.screen.log(&said);
            }
        }
    }

    /// Connects to the bus again, if that has ended. Meanwhile nobody is said to hang: it is the launcher that hears nothing.
    fn keep_hearing(&mut self) {
        let now = self.own_now();
        if self.hearing.is_due(now)
            && let Some(locator) = self.locator.clone()
        {
            self.join(&locator);
        }
        if self.hearing.is_deaf() {
            self.liveness.held_up(now);
            self.supervisor.nobody_can_be_seen(now);
        }
    }

    /// Kills the children that hang; they are started again as soon as they have ended. So is a router whose socket was removed: whoever is
    /// started from here on would find it nowhere, and a new one makes a new one.
    fn end_what_hangs(&mut self) {
        if self.children.router_is_nowhere() && self.supervisor.router_is_seen() {
            self.screen.log("the router's socket was removed: the router is killed, to be started again");
            self.supervisor.hangs(Child::Router, self.own_now());
            self.children.kill(Child::Router);
        }
        let limit = self.config.launcher.hung_after_s.seconds();
        for child in self.liveness.hung(self.own_now(), self.supervisor.router_is_seen()) {
            if self.supervisor.hangs(child, self.own_now()) {
                self.screen.log(&format!("{child} does not answer for {limit:?}: killed, to be started again"));
                self.children.kill(child);
            }
        }
        // At first all start at once, and who is missing then ends the system: see `check_start`. One alone needs less time.
        let start_limit = self.config.launcher.start_limit_s.seconds();
        if self.run_file.is_some() || start_limit <= self.own_now() {
            let overdue = self.supervisor.overdue(self.own_now(), start_limit / 2);
            for (child, limit) in &overdue {
                self.screen
                    .log(&format!("{child} is not seen {limit:?} after it was started: killed, to be started again"));
                self.children.kill(*child);
            }
            if !overdue.is_empty() && self.supervisor.nobody_is_seen() {
                self.screen.log("the router listens, and nobody is seen: it is killed as well, to be started again");
                self.supervisor.hangs(Child::Router, self.own_now());
                self.children.kill(Child::Router);
            }
        }
    }

    /// Who cleans up temporary files does not know that a system runs: commands are to find it, and the next run is to leave its folders alone.
    fn keep_places(&mut self) {
        self.children.hold_sockets();
        if let Some(state) = &self.state {
            state.hold();
        }
        let said = match self.run_file.as_mut().map_or(Ok(false), RunFile::restore) {
            Ok(false) => return,
            Ok(true) => "the run file was removed: it is written again".to_owned(),
            Err(cause) => {
                format!("the run file was removed, so no command finds this system, and it cannot be written: {cause}")
            }
        };
        if self.logged.insert(said.clone()) {
            self.screen.log(&said);
        }
    }

    fn on_ended(&mut self, child: Child) -> Option<End> {
        let ending = self.children.reap(child)?;
        self.liveness.ended(child);
        self.judge(child, ending)
    }

    /// What follows when a child has ended so.
    fn judge(&mut self, child: Child, ending: Ending) -> Option<End> {
        match self.supervisor.ended(child, ending, self.own_now(), self.aircraft.may_be_in_the_air(self.now())) {
            Verdict::Restart(delay) => {
                self.screen.log(&format!("{child} ended {ending}; it is started again in {delay:?}"));
                None
            }
            Verdict::KeepTrying(delay, reason) => {
                self.screen.log(&format!(
                    "{reason}; the aircraft may be in the air, so it is started again every {delay:?} until it is seen on the ground"
                ));
                None
            }
            Verdict::GiveUp(reason) if ending.is_refusal() && self.run_file.is_none() => Some(End::Refused(reason)),
            Verdict::GiveUp(reason) => Some(End::GaveUp(reason)),
        }
    }

    /// Once all processes are seen: prints the addresses, and lets `inject` and `status` find the system.
    fn check_start(&mut self) -> Option<End> {
        if self.run_file.is_some() {
            return None;
        }
        let missing = self.supervisor.missing();
        if let (true, Some(connect), Some(http)) = (missing.is_empty(), &self.locator, &self.http) {
            let (vehicle, config) = (self.config.vehicle.to_string(), self.files.settings.config.clone());
            let token = self.demo.as_ref().map(|it| it.token.clone()).unwrap_or_default();
            let (pid, connect, http) = (std::process::id(), connect.clone(), http.clone());
            let ca = self.config.gateway.tls_certificate.clone();
            let running = Running { pid, connect, http, token, vehicle, config, ca };
            // First the file, then the lines: who has read them may look for the system.
            return match RunFile::write(&running) {
                Ok(file) => {
                    self.run_file = Some(file);
                    self.tell_addresses(&running);
                    None
                }
                Err(cause) => self.give_up_on_ground(format!("cannot write the run file: {cause}")),
            };
        }
        let limit = self.config.launcher.start_limit_s.seconds();
        if self.own_now() < limit {
            return None;
        }
        let names: Vec<_> = missing.iter().map(|it| it.name()).collect();
        self.give_up_on_ground(format!("not seen within {limit:?}: {}", names.join(", ")))
    }

    /// Ends the launcher, unless the aircraft may be in the air: then its processes are kept up, and the reason is logged once.
    fn give_up_on_ground(&mut self, why: String) -> Option<End> {
        if !self.aircraft.may_be_in_the_air(self.now()) {
            return Some(End::GaveUp(why));
        }
        if self.logged.insert(why.clone()) {
            self.screen.log(&format!(
                "{why}; the aircraft may be in the air, so its processes are kept up until it is seen on the ground"
            ));
        }
        None
    }

    fn tell_addresses(&self, running: &Running) {
        let Running { connect, http, vehicle, .. } = running;
        self.screen.line(&format!(
            "{} is up: speed {}, permissions {}, seed {}, router {connect}\nstatus: {http}/api/v1/vehicles/{}",
            vehicle, self.config.speed, self.config.permissions, self.config.seed, vehicle
        ));
        match self.backend {
            Backend::Sim => {}
            Backend::Px4 => {
                self.screen.line(&format!("vehicle: px4, awaited at {}", self.config.px4_bridge.endpoint));
            }
            Backend::Mavlink => {
                self.screen.line(&format!("vehicle: over MAVLink, {}", self.config.mavlink_bridge.connect));
            }
        }
        if self.demo.is_some() {
            self.screen.line(&format!("operate: {http}/#token={}", running.token));
        }
        if let Some(folder) = &self.recordings {
            self.screen.line(&format!("recordings: {}", folder.display()));
        }
    }

    fn check_report(&mut self) -> Option<End> {
        if self.reported.is_some() && self.progress.report().is_none() && !self.args.exit_when_done {
            // An operator has begun the next mission: it gets a report of its own.
            self.reported = None;
        }
        if self.reported.is_none() {
            let report = self.progress.report()?.clone();
            self.screen.end_progress();
            self.tell(&report);
            self.reported = Some(report.outcome().into());
        }
        let outcome = self.reported.filter(|_| self.args.exit_when_done)?;
        if self.aircraft.state(self.now()) == State::AtRest {
            return Some(End::Reported(outcome));
        }
        // Without the system nobody would answer for the aircraft.
        if let Some(text) = self.aircraft.await_rest(self.now()) {
            self.screen.line(text);
        }
        None
    }

    fn tell(&self, report: &MissionReport) {
        self.screen.line(&report::text(report));
        if self.args.json {
            output::line(report::json(report));
        }
    }

    /// Reports the progress of a mission that did not come to its end.
    fn unfinished(&self, reason: &str, outcome: Outcome) -> Outcome {
        if self.reported.is_none() {
            self.tell(&self.progress.unfinished(self.config.vehicle.as_str(), reason));
        } else {
            self.screen.log(reason);
        }
        outcome
    }

    /// Ends the services, then the router that they use until then.
    fn end_children(&mut self) {
        self.bus.stop();
        let (routers, services): (Vec<_>, Vec<_>) =
            self.children.running().into_iter().partition(|it| *it == Child::Router);
        self.end_all(&services, SERVICES_END);
        self.end_all(&routers, ROUTER_END);
    }

    fn end_all(&mut self, children: &[Child], limit: Duration) {
        children.iter().for_each(|it| self.children.ask_to_end(*it));
        let (until, mut why) = (Instant::now() + limit, format!("did not end within {limit:?}"));
        while children.iter().any(|it| self.children.running().contains(it)) {
            let left = until.saturating_duration_since(Instant::now());
            match self.happenings.recv_timeout(left) {
                Ok(Happening::Ended(child)) => {
                    self.children.reap(child);
                }
                Ok(Happening::Log { child, text }) => self.screen.log(&format!("{child}: {text}")),
                Ok(Happening::Interrupted) => {
                    why = "was asked a second time".to_owned();
                    break;
                }
                Err(_) => break,
                Ok(_) => {}
            }
        }
        for child in children {
            if self.children.running().contains(child) {
                self.screen.log(&format!("{child} {why}: killed"));
            }
            self.children.kill(*child);
            self.children.reap(*child);
        }
    }

    /// On the wall clock: how old is what the aircraft has said.
    fn now(&self) -> Duration {
        self.start.elapsed()
    }

    /// Without the pauses in which the launcher itself was held up: how long children are silent, and wait.
    fn own_now(&self) -> Duration {
        self.own_time.at(self.start.elapsed())
    }
}
