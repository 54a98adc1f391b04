//! The launcher's only loop: passes events to the supervisor, the progress and the screen.

mod ending;
mod keeping_up;
mod listening;
mod telling;

use std::collections::BTreeSet;
use std::io;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

use bus::Stop;
use kittiwake_proto::topics::Message;
use node::Event;
use signal_hook::consts::SIGHUP;

use crate::backend::Backend;
use crate::cli::UpArgs;
use crate::config::Config;
use crate::outcome::Outcome;
use crate::run::run_file::{RunFile, RunFolder};
use crate::run::{end, state_folder, tower_key};
use crate::setup::access::DemoAccess;
use crate::up::Happening;
use crate::up::aircraft::{Aircraft, State};
use crate::up::children::Children;
use crate::up::flown_files::FlownFiles;
use crate::up::liveness::Liveness;
use crate::up::own_time::OwnTime;
use crate::up::progress::Progress;
use crate::up::screen::Screen;
use crate::up::supervise::{Child, Supervisor};
use crate::up::watch::Hearing;

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

    /// Waits for something to happen, and takes in what else has happened, in its order. So the checks after
    /// a turn run once for all: a launcher that waited for the processor catches up, instead of hearing a death behind
    /// thousands of positions.
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
            // Each report is printed, also one that the next mission follows at once.
            if self.progress.report().is_some() != is_reported {
                break;
            }
            next = self.happenings.try_recv().ok();
        }
        None
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

    /// On the wall clock: how old is what the aircraft has said.
    fn now(&self) -> Duration {
        self.start.elapsed()
    }

    /// Without the pauses in which the launcher itself was held up: how long children are silent, and wait.
    fn own_now(&self) -> Duration {
        self.own_time.at(self.start.elapsed())
    }
}
