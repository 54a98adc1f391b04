//! The one resource there is, the vehicle's motion: which skill has it, which one wants it, and
//! which one waits behind that.
//!
//! Everything is decided in the handling of the event that causes it; time only brings about what
//! is a matter of time. What happens to a skill is in [`crate::resource`], what is commanded next
//! in [`crate::next_command`].

use std::time::Duration;

use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1::{SkillEvent, SkillFeedback};

use crate::commands::CommandLine;
use crate::config::Config;
use crate::fsm::State;
use crate::idle::Idle;
use crate::instance::Instance;
use crate::ledger::Ledger;
use crate::stream::Stream;
use crate::vehicle::{Landed, Motion, Status, Vehicle, at_wall_rate};
use crate::wire;

/// Skills, vehicle data and the command line to the autopilot.
#[derive(Debug)]
pub struct Executor {
    pub(crate) config: Config,
    pub(crate) pace: Pace,
    pub(crate) vehicle: Vehicle,
    pub(crate) commands: CommandLine,
    pub(crate) stream: Stream,
    pub(crate) ledger: Ledger,
    pub(crate) last_skill: u64,
    /// The registered skill, in E or C.
    pub(crate) registered: Option<Instance>,
    /// The one in PR beside it.
    pub(crate) candidate: Option<Instance>,
    /// The one that waits until the candidate's command is answered.
    pub(crate) next: Option<Instance>,
    /// A takeoff armed and then did not take off.
    pub(crate) disarm_due: bool,
    /// Set while a vehicle in the air is flown by no skill and loiter has not been commanded.
    pub(crate) idle: Option<Idle>,
    feedback_due: Option<Time>,
    /// What is to be published, in order.
    pub(crate) outbox: Vec<Message>,
}

impl Executor {
    /// An executor that knows nothing about the vehicle yet.
    pub fn new(config: &Config, pace: Pace) -> Executor {
        Executor {
            config: config.clone(),
            pace,
            vehicle: Vehicle::new(config, pace),
            commands: CommandLine::new(pace.limit(config.ack_timeout_s.seconds())),
            stream: Stream::new(pace.wall(config.setpoint_rate_hz.period())),
            ledger: Ledger::new(at_wall_rate(pace, config.memory_s.seconds())),
            last_skill: 0,
            registered: None,
            candidate: None,
            next: None,
            disarm_due: false,
            idle: None,
            feedback_due: None,
            outbox: Vec::new(),
        }
    }

    /// A position has come.
    pub fn moved(&mut self, motion: Motion, now: Now) {
        self.vehicle.moved(motion, now.time);
        self.proceed(now);
    }

    /// A vehicle status has come.
    pub fn reported(&mut self, status: Status, now: Now) {
        self.vehicle.reported(status, self.commands.is_busy(), now.time);
        self.judge_mode(now);
        self.proceed(now);
    }

    /// The land detector has spoken.
    pub fn land_detected(&mut self, landed: Landed, now: Now) {
        self.vehicle.land_detected(landed, now.time);
        self.proceed(now);
    }

    /// Brings about what is a matter of time.
    pub fn time_passed(&mut self, now: Now) {
        self.give_up_command(now);
        self.proceed(now);
        self.refresh_setpoint(now.time);
        self.send_feedback(now.time);
    }

    /// When [`Executor::time_passed`] has something to do.
    pub fn deadline(&self) -> Option<Time> {
        let progress = self.registered.as_ref().and_then(|it| it.skill.deadline());
        let free = !self.commands.is_busy();
        let waiting = self.candidate.as_ref().filter(|_| free).and_then(|it| it.waits_since);
        let waiting = waiting.map(|it| it + self.data_wait());
        let feedback = self.feedback_due.filter(|_| self.executes());
        [progress, waiting, feedback, self.loiter_due(), self.commands.deadline(), self.stream.deadline()]
            .into_iter()
            .flatten()
            .min()
    }

    /// The newest event of each skill, oldest first.
    pub fn table(&mut self, now: Now) -> Vec<SkillEvent> {
        self.ledger.table(now.time)
    }

    /// What is to be published since the last time, in order.
    pub fn take_messages(&mut self) -> std::vec::Drain<'_, Message> {
        self.outbox.drain(..)
    }

    /// How long a request waits for vehicle data.
    pub(crate) fn data_wait(&self) -> Duration {
        at_wall_rate(self.pace, self.config.data_wait_s.seconds())
    }

    /// Looks at what runs, then at what is to be commanded.
    pub(crate) fn proceed(&mut self, now: Now) {
        self.look_at_progress(now);
        self.command_next(now);
    }

    /// Publishes the setpoint if one is due.
    pub(crate) fn refresh_setpoint(&mut self, now: Time) {
        if let Some(setpoint) = self.stream.due(now) {
            self.outbox.extend(wire::setpoint(setpoint));
        }
    }

    /// The first feedback of a skill is due at once.
    pub(crate) fn restart_feedback(&mut self, now: Time) {
        self.feedback_due = Some(now);
    }

    fn executes(&self) -> bool {
        self.registered.as_ref().is_some_and(|it| matches!(it.state, State::Execute { .. }))
    }

    fn send_feedback(&mut self, now: Time) {
        let Some(running) = self.registered.as_ref().filter(|_| self.executes()) else { return };
        if self.feedback_due.is_none_or(|due| now < due) {
            return;
        }
        self.feedback_due = Some(now + self.pace.wall(self.config.feedback_rate_hz.period()));
        // No feedback is better than that of a moment ago.
        if let Some(motion) = self.vehicle.view(now).motion {
            let feedback = SkillFeedback {
                skill_id: running.id.0,
                kind: running.skill.kind() as i32,
                position: Some(motion.position.into()),
                velocity: Some(motion.velocity.into()),
                distance_left_m: running.skill.distance_left_m(&motion),
            };
            self.outbox.push(feedback.into());
        }
    }
}
