//! One run: a real system is started, the troubles of its schedule befall it, and the oracle judges.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use bus::Tap;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::Message;

use crate::clock::Side;
use crate::figures::Loss;
use crate::flood;
use crate::oracle::{Oracle, Violation};
use crate::perform::Scene;
use crate::schedule::Schedule;
use crate::system::{Reach, Setup, System, taps};
use crate::trouble::{Kind, Layout, Trouble};

mod ending;
pub(crate) mod heard;
mod losses;

use ending::NOT_BACK;
use heard::Heard;
use losses::Losses;
use witness::true_time::{Ahead, TrueTime};

/// A run that has not ended by itself after this is not expected to: mission time for its flight, wall time for its troubles.
const LONGEST: (Duration, Duration) = (Duration::from_secs(1500), Duration::from_secs(120));
/// How often it is looked at the clock.
const TICK: Duration = Duration::from_millis(20);
/// Messages that wait for the oracle: some seconds of telemetry.
const QUEUE: usize = 10_000;
/// How often it is tried to get onto the buses of a system that is up: a router may be on its way back.
const TAP_ATTEMPTS: u32 = 3;

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
    /// It was interrupted: what was found until then counts, and nothing is held against it for not being over.
    pub is_interrupted: bool,
}

/// Flies a run of `setup` through the troubles of `schedule`, as far as they are `possible` here, judged by the `oracle`.
///
/// # Errors
/// If the system does not come up at all. One that has been up and does not come back is a violation.
pub(crate) fn fly(
    setup: &Arc<Setup>,
    oracle: Oracle,
    schedule: Schedule,
    possible: impl Fn(Kind) -> bool,
    interrupted: &AtomicBool,
) -> Result<Run, String> {
    let begin = Instant::now();
    let (sender, heard) = sync_channel(QUEUE);
    let system = setup.start(&sender)?;
    let troubles = schedule.troubles.iter().filter(|it| possible(it.1.kind())).cloned().collect();
    let mut flight = Flight {
        setup,
        pace: oracle.pace(),
        interrupted,
        heard,
        sender,
        system: Some(system),
        taps: None,
        scene: None,
        start: None,
        settled_from: Time::ZERO,
        troubles,
        true_time: TrueTime::default(),
        oracle,
        losses: Losses::default(),
        story: Vec::new(),
        last_order: None,
        is_flooded: false,
    };
    let outcome = flight.fly();
    flight.conclude(outcome, schedule, begin.elapsed())
}

struct Flight<'a> {
    setup: &'a Arc<Setup>,
    pace: Pace,
    interrupted: &'a AtomicBool,
    heard: Receiver<Heard>,
    sender: SyncSender<Heard>,
    system: Option<System>,
    taps: Option<[Tap; 2]>,
    /// Absent until the system is up.
    scene: Option<Scene>,
    /// When the system was up for the first time.
    start: Option<Instant>,
    /// When the last trouble was over, by itself; what it has caused may take longer.
    settled_from: Time,
    troubles: VecDeque<(Duration, Trouble)>,
    true_time: TrueTime,
    oracle: Oracle,
    losses: Losses,
    story: Vec<(f64, String)>,
    /// Why the vehicle held when it was ordered down at the end of the run.
    last_order: Option<String>,
    is_flooded: bool,
}

impl Flight<'_> {
    /// How it ended, in words.
    ///
    /// # Errors
    /// Why it could not go on.
    fn fly(&mut self) -> Result<String, String> {
        let begin = Instant::now();
        loop {
            match self.heard.recv_timeout(TICK) {
                Ok(Heard::Ended(id)) if self.is_current(id) => {
                    return match self.start.filter(|_| !self.is_interrupted()) {
                        Some(_) => Ok(self.launcher_ended()),
                        None => Err(format!("the system did not come up: {}", self.last_words())),
                    };
                }
                Ok(heard) => self.on(heard)?,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Err("nothing is heard any more".into()),
            }
            if self.is_interrupted() {
                return Err("interrupted".into());
            }
            self.begin_due()?;
            if let Some(outcome) = self.outcome() {
                return Ok(outcome);
            }
            let (mission, wall) = LONGEST;
            if self.pace.to_wall(mission) + wall < begin.elapsed() {
                self.oracle.never_ended(self.now().time);
                return Ok("no end".into());
            }
        }
    }

    /// The result. A system that was up and could not go on counts against the run, with all earlier findings.
    fn conclude(mut self, end: Result<String, String>, schedule: Schedule, wall: Duration) -> Result<Run, String> {
        let is_interrupted = self.is_interrupted();
        let outcome = match end {
            _ if is_interrupted => "interrupted".to_owned(),
            Ok(outcome) => outcome,
            Err(why) if self.start.is_none() => return Err(why),
            Err(why) => {
                self.oracle.not_kept_up(&why);
                self.tell(format!("chaos: {why}"));
                NOT_BACK.to_owned()
            }
        };
        let Flight { oracle, losses, story, .. } = self;
        let (violations, losses) = (oracle.violations().to_vec(), losses.figures());
        Ok(Run { schedule, outcome, violations, losses, story, wall, is_interrupted })
    }

    fn is_interrupted(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }

    fn now(&self) -> Now {
        let wall = self.start.map(|it| it.elapsed()).unwrap_or_default();
        let utc = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Now { time: Time::after(self.pace.wall(wall)), utc_ms: utc.as_millis() as i64 }
    }

    fn ahead(&self) -> Ahead {
        let ahead_ms = |side| self.setup.clocks.as_ref().map_or(0, |it| it.ahead_ms(side));
        Ahead { aircraft_ms: ahead_ms(Side::Aircraft), ground_ms: ahead_ms(Side::Ground) }
    }

    /// Whether it is the current system, not one from before a loss of power.
    fn is_current(&self, id: u32) -> bool {
        self.system.as_ref().is_some_and(|it| it.id() == id)
    }

    fn tell(&mut self, text: String) {
        self.story.push((self.now().time.as_secs_f64(), text));
    }

    /// Only the first message of a flood is recorded in the story.
    fn tell_once_of_a_flood(&mut self, text: String) {
        let is_flood = text.contains(flood::FLAG) || text.contains(flood::STORM);
        if !is_flood || !std::mem::replace(&mut self.is_flooded, true) {
            self.tell(text);
        }
    }

    fn on(&mut self, heard: Heard) -> Result<(), String> {
        match heard {
            Heard::Message(message) => {
                let message = self.true_time.of(self.ahead(), message);
                let now = self.now();
                self.oracle.hears(now, &message);
                // A launcher prints them.
                if let (Message::DecisionRecord(it), Layout::TwoRouters) = (&message, self.setup.layout) {
                    self.tell_once_of_a_flood(format!("{}: {}", it.topic, it.text));
                }
                self.losses.heard(&message, self.oracle.path_m());
            }
            Heard::Line(id, line) => {
                if self.is_current(id) {
                    self.losses.said(&line);
                }
                self.tell_once_of_a_flood(line);
            }
            Heard::Up(id, reach) if self.is_current(id) => self.came_up(reach)?,
            Heard::Up(..) | Heard::Ended(_) => {}
            Heard::Lost { victim, id, how } => {
                self.losses.lost(victim, id, how, self.oracle.path_m());
                self.oracle.lost(self.now().time, victim, id);
                self.tell(format!("chaos: {} to {victim}", how.signal()));
            }
            Heard::Continued { id } => {
                self.losses.continued(id);
                self.oracle.continued(self.now().time, id);
                self.tell(format!("chaos: SIGCONT to process {id}"));
            }
            Heard::Given(order) => {
                let now = self.now().time;
                self.oracle.given(now, order);
            }
            Heard::Answered { order, accepted } => self.oracle.answered(order, accepted),
            Heard::Ordered { order, accepted, said } => {
                let now = self.now().time;
                match accepted {
                    true => self.oracle.ordered(now, order),
                    false => self.oracle.refused(order, &said),
                }
                self.tell(format!("chaos: {}: {said}", order.verb()));
            }
            Heard::NotAccepted { order, said } => self.tell(format!("chaos: {}: not accepted: {said}", order.verb())),
            Heard::Note(text) => self.tell(format!("chaos: {text}")),
        }
        Ok(())
    }

    fn came_up(&mut self, reach: Reach) -> Result<(), String> {
        self.taps = Some(self.tap(&reach)?);
        let processes = self.system.as_ref().map(System::processes);
        self.scene = processes.map(|processes| Scene {
            setup: self.setup.clone(),
            processes,
            reach,
            heard: self.sender.clone(),
        });
        self.start.get_or_insert_with(Instant::now);
        Ok(())
    }

    fn tap(&self, reach: &Reach) -> Result<[Tap; 2], String> {
        let mut attempt = taps(reach, &self.sender);
        for _ in 1..TAP_ATTEMPTS {
            if attempt.is_ok() || self.is_interrupted() {
                break;
            }
            attempt = taps(reach, &self.sender);
        }
        attempt.map_err(|why| format!("nobody gets onto the bus of a system that is up: {why}"))
    }

    fn begin_due(&mut self) -> Result<(), String> {
        let now = self.now().time;
        let Some(scene) = &self.scene else { return Ok(()) };
        let is_due = self.troubles.front().is_some_and(|(at, _)| Time::after(*at) <= now);
        let Some((_, trouble)) = self.troubles.pop_front_if(|_| is_due) else { return Ok(()) };
        self.settled_from = self.settled_from.max(now + self.pace.wall(trouble.link_is_faulty_for()));
        self.oracle.troubled(self.now(), &trouble);
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
        if let Some(system) = self.system.take() {
            system.cut_power();
        }
        self.scene = None;
        // Closing them may wait for a router that is gone.
        let taps = self.taps.take();
        std::thread::spawn(move || drop(taps));
        // Nothing of what was still under way tells of the system that comes.
        let until = Instant::now() + dark;
        while let Ok(heard) = self.heard.recv_timeout(until.saturating_duration_since(Instant::now())) {
            match heard {
                Heard::Line(_, line) | Heard::Note(line) => self.tell(line),
                // An order accepted before counts afterwards. An answered order, even with "none", is settled.
                order @ (Heard::Given(_) | Heard::Answered { .. } | Heard::Ordered { accepted: true, .. }) => {
                    self.on(order)?;
                }
                _ => {}
            }
        }
        self.losses.power_lost();
        let now = self.now();
        self.oracle.power_lost(now);
        self.system = Some(self.setup.start(&self.sender)?);
        Ok(())
    }
}

#[cfg(test)]
mod tests;
