//! One run: a real system is started, the troubles of its schedule befall it, and the oracle judges.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use bus::Tap;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::Message;

use crate::figures::{How, Loss};
use crate::flood;
use crate::oracle::{INTERRUPTION, Oracle, State, Violation};
use crate::perform::Scene;
use crate::schedule::Schedule;
use crate::system::{Launcher, Setup, tap};
use crate::trouble::{Kind, Order, Trouble, Victim};

/// A run that has not ended by itself after this is not expected to: mission time for its flight, wall time for its troubles.
const LONGEST: (Duration, Duration) = (Duration::from_secs(1500), Duration::from_secs(120));
/// How often it is looked at the clock.
const TICK: Duration = Duration::from_millis(20);
/// Messages that wait for the oracle: some seconds of telemetry.
const QUEUE: usize = 10_000;
/// A router that has died passes on nothing for this long, whatever is still on its way.
const ON_ITS_WAY: Duration = Duration::from_millis(100);

/// What a run hears, in order.
#[derive(Debug)]
pub(crate) enum Heard {
    /// From the bus.
    Message(Message),
    /// A line of the launcher with this process id.
    Line(u32, String),
    /// That launcher has ended.
    LauncherEnded(u32),
    /// A process is about to be killed or stopped.
    Lost { victim: Victim, id: u32, how: How },
    /// A stopped process goes on.
    Continued { id: u32 },
    /// An order was accepted, or was not in the end.
    Ordered { order: Order, accepted: bool, said: String },
    /// For the story.
    Note(String),
}

/// What came of a run.
#[derive(Debug)]
pub struct Run {
    /// What was planned.
    pub schedule: Schedule,
    /// How it ended, in words.
    pub outcome: String,
    /// What the oracle has against it.
    pub violations: Vec<Violation>,
    /// The processes that were lost.
    pub losses: Vec<Loss>,
    /// What happened when, in mission seconds.
    pub story: Vec<(f64, String)>,
    /// How long it took.
    pub wall: Duration,
}

/// Flies a run of `setup` through the troubles of `schedule`, as far as they are `possible` here.
///
/// # Errors
/// If the system cannot be started at all, or the run was interrupted.
pub(crate) fn fly(
    setup: &Setup,
    pace: Pace,
    schedule: Schedule,
    possible: impl Fn(Kind) -> bool,
    interrupted: &AtomicBool,
) -> Result<Run, String> {
    let begin = Instant::now();
    let (sender, heard) = sync_channel(QUEUE);
    let launcher = setup.start(&sender).map_err(|it| format!("{}: {it}", setup.program.display()))?;
    let troubles = schedule.troubles.iter().filter(|it| possible(it.1.kind())).cloned().collect();
    let mut flight = Flight {
        setup,
        pace,
        interrupted,
        heard,
        sender,
        launcher: Some(launcher),
        tap: None,
        scene: None,
        locator: None,
        start: None,
        last_begun: Time::ZERO,
        troubles,
        oracle: Oracle::new(pace),
        losses: Vec::new(),
        story: Vec::new(),
        last_order: None,
        is_flooded: false,
    };
    let outcome = flight.fly()?;
    let wall = begin.elapsed();
    let Flight { oracle, losses, story, .. } = flight;
    let losses = losses.into_iter().map(|it| it.loss).collect();
    Ok(Run { schedule, outcome, violations: oracle.violations().to_vec(), losses, story, wall })
}

struct Flight<'a> {
    setup: &'a Setup,
    pace: Pace,
    interrupted: &'a AtomicBool,
    heard: Receiver<Heard>,
    sender: SyncSender<Heard>,
    launcher: Option<Launcher>,
    tap: Option<Tap>,
    /// Absent until the system is up.
    scene: Option<Scene>,
    locator: Option<String>,
    /// When the system was up for the first time.
    start: Option<Instant>,
    last_begun: Time,
    troubles: VecDeque<(Duration, Trouble)>,
    oracle: Oracle,
    losses: Vec<Pending>,
    story: Vec<(f64, String)>,
    /// Why the vehicle held when it was ordered down at the end of the run.
    last_order: Option<String>,
    is_flooded: bool,
}

/// A loss whose figures may still be missing.
struct Pending {
    id: u32,
    at: Instant,
    path_m: f64,
    loss: Loss,
}

impl Flight<'_> {
    fn fly(&mut self) -> Result<String, String> {
        let begin = Instant::now();
        loop {
            match self.heard.recv_timeout(TICK) {
                Ok(Heard::LauncherEnded(id)) if self.launcher.as_ref().is_some_and(|it| it.id() == id) => {
                    return match self.start {
                        Some(_) => Ok(self.launcher_ended()),
                        None => Err(format!("the system did not come up: {}", self.last_words())),
                    };
                }
                Ok(heard) => self.on(heard)?,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Err("nothing is heard any more".into()),
            }
            if self.interrupted.load(Ordering::Relaxed) {
                return Err("interrupted".into());
            }
            self.begin_due()?;
            if let Some(outcome) = self.outcome() {
                return Ok(outcome);
            }
            let (mission, wall) = LONGEST;
            if self.pace.to_wall(mission) + wall < begin.elapsed() {
                self.oracle.never_ended();
                return Ok("no end".into());
            }
        }
    }

    fn now(&self) -> Now {
        let wall = self.start.map(|it| it.elapsed()).unwrap_or_default();
        let utc = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Now { time: Time::after(self.pace.wall(wall)), utc_ms: utc.as_millis() as i64 }
    }

    fn tell(&mut self, text: String) {
        self.story.push((self.now().time.as_secs_f64(), text));
    }

    fn on(&mut self, heard: Heard) -> Result<(), String> {
        match heard {
            Heard::Message(message) => {
                let now = self.now();
                self.oracle.hears(now, &message);
                self.resumed(&message);
            }
            Heard::Line(id, line) => {
                if self.launcher.as_ref().is_some_and(|it| it.id() == id) {
                    self.detected(&line);
                    self.came_up(id, &line)?;
                }
                // Only the first message of a flood is recorded in the story.
                let is_flood = line.contains(flood::FLAG);
                if !is_flood || !std::mem::replace(&mut self.is_flooded, true) {
                    self.tell(line);
                }
            }
            Heard::LauncherEnded(_) => {}
            Heard::Lost { victim, id, how } => {
                let loss = Loss { victim, how, detected_s: None, resumed_s: None, flown_m: 0.0 };
                self.losses.push(Pending { id, at: Instant::now(), path_m: self.oracle.path_m(), loss });
                let how = if how == How::Killed { "SIGKILL" } else { "SIGSTOP" };
                self.tell(format!("chaos: {how} to {victim}"));
            }
            Heard::Continued { id } => {
                // One that was not missed long enough is none that was lost.
                self.losses.retain(|it| it.id != id || it.loss.detected_s.is_some());
                self.tell(format!("chaos: SIGCONT to process {id}"));
            }
            Heard::Ordered { order, accepted, said } => {
                let now = self.now().time;
                match accepted {
                    true => self.oracle.ordered(now, order),
                    false => self.oracle.refused(order, &said),
                }
                self.tell(format!("chaos: {}: {said}", order.verb()));
            }
            Heard::Note(text) => self.tell(format!("chaos: {text}")),
        }
        Ok(())
    }

    /// The launcher's lines say where the router and the gateway are.
    fn came_up(&mut self, launcher: u32, line: &str) -> Result<(), String> {
        if line.contains(" is up: ") {
            self.locator = line.rsplit_once("router ").map(|it| it.1.trim().to_owned());
        }
        let http = line.strip_prefix("status: http://").and_then(|it| it.split('/').next());
        if let (Some(http), Some(locator), None) = (http, &self.locator, &self.scene) {
            self.tap = Some(tap(locator, &self.sender)?);
            self.scene = Some(Scene {
                program: self.setup.program.clone(),
                launcher,
                locator: locator.clone(),
                http: http.to_owned(),
                state: self.setup.state(),
                heard: self.sender.clone(),
            });
            self.start.get_or_insert_with(Instant::now);
        }
        Ok(())
    }

    fn begin_due(&mut self) -> Result<(), String> {
        let now = self.now().time;
        let Some(scene) = &self.scene else { return Ok(()) };
        let is_due = self.troubles.front().is_some_and(|(at, _)| Time::after(*at) <= now);
        let Some((_, trouble)) = self.troubles.pop_front_if(|_| is_due) else { return Ok(()) };
        self.last_begun = now;
        self.oracle.troubled(&trouble);
        let told = format!("chaos: {trouble}");
        match trouble {
            Trouble::PowerLoss(dark) => {
                self.tell(told);
                self.lose_power(dark)
            }
            other => {
                scene.begin(other);
                self.tell(told);
                Ok(())
            }
        }
    }

    fn lose_power(&mut self, dark: Duration) -> Result<(), String> {
        if let Some(launcher) = self.launcher.take() {
            launcher.cut_power();
        }
        (self.scene, self.locator) = (None, None);
        // Closing it may wait for a router that is gone.
        let tap = self.tap.take();
        std::thread::spawn(move || drop(tap));
        // Nothing of what was still under way tells of the system that comes.
        let until = Instant::now() + dark;
        while let Ok(heard) = self.heard.recv_timeout(until.saturating_duration_since(Instant::now())) {
            if let Heard::Line(_, line) | Heard::Note(line) = heard {
                self.tell(line);
            }
        }
        self.losses.retain(|it| it.loss.resumed_s.is_some());
        let now = self.now();
        self.oracle.power_lost(now);
        self.launcher = Some(self.setup.start(&self.sender).map_err(|it| it.to_string())?);
        Ok(())
    }

    /// The launcher noticed a loss.
    fn detected(&mut self, line: &str) {
        for it in &mut self.losses {
            let said = match it.loss.how {
                How::Killed => line.starts_with(&format!("{} ended ", it.loss.victim)),
                How::Hung => line.starts_with(&format!("{} does not answer ", it.loss.victim)),
            };
            if said && it.loss.detected_s.is_none() {
                it.loss.detected_s = Some(it.at.elapsed().as_secs_f64());
                return;
            }
        }
    }

    /// Somebody is heard: perhaps the successor of one that was lost.
    fn resumed(&mut self, message: &Message) {
        let path_m = self.oracle.path_m();
        for it in self.losses.iter_mut().filter(|it| it.loss.resumed_s.is_none()) {
            let Some(detected_s) = it.loss.detected_s else { continue };
            let since = it.at.elapsed();
            let is_back = match (it.loss.victim, message) {
                // Not before it is known where the vehicle is by now.
                (Victim::Router, Message::VehicleLocalPosition(_)) => {
                    detected_s + ON_ITS_WAY.as_secs_f64() < since.as_secs_f64()
                }
                (victim, Message::Heartbeat(beat)) => beat.service == victim.name() && beat.pid != it.id,
                _ => false,
            };
            if is_back {
                it.loss.resumed_s = Some(since.as_secs_f64());
                it.loss.flown_m = path_m - it.path_m;
            }
        }
    }

    /// How the run ends, if nothing more is to come.
    fn outcome(&mut self) -> Option<String> {
        let now = self.now().time;
        let scene = self.scene.as_ref().filter(|_| self.troubles.is_empty())?;
        if now < self.last_begun + self.pace.wall(INTERRUPTION) {
            return None;
        }
        match self.oracle.state(now) {
            State::Waits(reason) => Some(format!("on the ground, {reason}")),
            State::Holds(reason) if !reason.is_empty() && self.last_order.is_none() => {
                scene.begin(Trouble::Ordered(Order::Abort));
                self.tell(format!("chaos: it holds: {reason}; ordered down"));
                self.last_order = Some(reason);
                None
            }
            _ => None,
        }
    }

    fn launcher_ended(&mut self) -> String {
        let code = self.launcher.as_mut().and_then(Launcher::exit_code);
        let last_words = self.last_words();
        self.oracle.ended(code, &last_words);
        let end = match code {
            Some(0) => "achieved".to_owned(),
            Some(3) => "landed, objectives failed".to_owned(),
            Some(4) => "landed, emergency".to_owned(),
            code => format!("exit code {code:?}"),
        };
        match &self.last_order {
            Some(reason) => format!("held ({reason}), ordered down, {end}"),
            None => end,
        }
    }
    /// What the launcher said last.
    fn last_words(&self) -> String {
        let said = self.story.iter().rev().map(|it| it.1.as_str()).find(|it| !it.starts_with("chaos: "));
        said.unwrap_or("nothing was said").to_owned()
    }
}
