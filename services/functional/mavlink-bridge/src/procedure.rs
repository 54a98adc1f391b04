//! One command of the layers above, carried out step by step until its effect is seen.
//!
//! An acknowledgement of the autopilot says that it has taken a command, no more. A command that is not acknowledged is sent again: all
//! of them may be, but for a takeoff, whose repetition is refused where the first was taken.

use std::collections::VecDeque;
use std::time::Duration;

use autopilot::command::{ACCEPTED, IN_PROGRESS, in_words};
use domain::fmu::{Command, CommandId, CommandResult};
use domain::time::Time;

use crate::config::Config;
use crate::heard::Ack;
use crate::personality::{Personality, Submode};
use crate::said::{CommandLong, Said, command};
use crate::vehicle::{Vehicle, landed};

/// What is to be done and seen.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Step {
    /// Set a mode, and see it.
    Mode(u32),
    /// Send a command.
    Long {
        /// Which one.
        command: CommandLong,
        /// When it is done.
        until: Until,
    },
    /// Climb to this height above the origin.
    Takeoff {
        /// The height.
        height_m: f64,
        /// When it is done.
        until: Until,
    },
    /// From here on it climbs.
    Climb,
    /// From here on the setpoints of the layers above are passed on; there must be a fresh one.
    Follow,
    /// Send setpoints for a moment: one alone may be lost, or be overtaken by the command that needs it.
    Stream,
    /// Stop by a setpoint.
    Stop,
}

/// What ends a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Until {
    /// It was taken.
    Acknowledged,
    /// The vehicle says that it is armed, or disarmed.
    Armed(bool),
    /// It flies this mode.
    Mode(u32),
}

/// What a step makes the bridge do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Act {
    /// Send something.
    Say(Said),
    /// What the mode serves from here on.
    Become(Submode),
    /// This mode is about to be seen, and is ours.
    Expect(u32),
    /// Stop by a setpoint.
    Stop,
}

/// A command that is carried out.
#[derive(Debug)]
pub(crate) struct Procedure {
    /// Echoed in the answer.
    pub(crate) id: CommandId,
    /// What was commanded.
    pub(crate) command: Command,
    steps: VecDeque<Step>,
    begun: Time,
    /// When setpoints began to be passed on.
    followed: Time,
    current: Option<Current>,
}

#[derive(Debug)]
struct Current {
    since: Time,
    sent: Time,
    tries: u32,
    sends: CommandLong,
    acknowledged: bool,
    refused: Option<(Time, u8)>,
}

/// What the procedure judges by.
pub(crate) struct Around<'a> {
    /// What is known.
    pub(crate) vehicle: &'a Vehicle,
    /// Which autopilot it is.
    pub(crate) personality: &'a dyn Personality,
    /// Limits.
    pub(crate) config: &'a Config,
    /// Whether a setpoint of the layers above is fresh.
    pub(crate) has_setpoint: bool,
    /// The time.
    pub(crate) now: Time,
}

/// Four setpoints of 20 Hz.
const STREAM: Duration = Duration::from_millis(200);
/// A heartbeat that is asked for is asked for again after this time: longer than any acknowledgement took.
const HEARTBEAT_AGAIN: Duration = Duration::from_millis(200);
/// Texts that say why something is refused come at about the same time.
const TEXTS: Duration = Duration::from_millis(150);

impl Procedure {
    /// A command that begins now.
    pub(crate) fn new(id: CommandId, command: Command, steps: Vec<Step>, now: Time) -> Procedure {
        Procedure { id, command, steps: steps.into(), begun: now, followed: now, current: None }
    }

    /// An acknowledgement for us has arrived.
    pub(crate) fn acknowledged(&mut self, ack: Ack, now: Time) {
        let Some(current) = self.current.as_mut().filter(|it| it.sends.command == ack.command) else { return };
        match ack.result {
            ACCEPTED | IN_PROGRESS => current.acknowledged = true,
            result => current.refused = current.refused.or(Some((now, result))),
        }
    }

    /// Goes on; the result once it is over.
    pub(crate) fn advance(&mut self, around: &Around<'_>, acts: &mut Vec<Act>) -> Option<CommandResult> {
        loop {
            let Some(step) = self.steps.front().cloned() else { return Some(CommandResult::Accepted) };
            match self.step(step, around, acts) {
                Progress::Pending => return None,
                Progress::Failed(reason) => return Some(CommandResult::Rejected { reason }),
                Progress::Done => {
                    self.steps.pop_front();
                    self.current = None;
                }
            }
        }
    }

    fn step(&mut self, step: Step, around: &Around<'_>, acts: &mut Vec<Act>) -> Progress {
        let Around { vehicle, personality, config, now, .. } = *around;
        match step {
            Step::Mode(mode) => {
                let is_set = vehicle.custom_mode() == Some(mode) && vehicle.intended(now).is_none_or(|it| it == mode);
                acts.push(Act::Expect(mode));
                if is_set {
                    return Progress::Done;
                }
                // Bit 0: the mode is the autopilot's own.
                let [main, sub] = personality.mode_params(mode);
                let sends = CommandLong::new(command::SET_MODE, [1.0, main, sub]);
                self.send(sends, Until::Mode(mode), around, acts)
            }
            Step::Long { command, until } => self.send(command, until, around, acts),
            Step::Takeoff { height_m, until } => {
                let sends =
                    self.current.as_ref().map(|it| it.sends).or_else(|| personality.takeoff(height_m, vehicle, now));
                match sends {
                    Some(sends) => {
                        if let Until::Mode(mode) = until {
                            acts.push(Act::Expect(mode));
                        }
                        self.send(sends, until, around, acts)
                    }
                    None if now - self.begun < config.effect_limit_s.seconds() => Progress::Pending,
                    None => Progress::Failed("the autopilot gives no height since it was armed".into()),
                }
            }
            Step::Climb => {
                acts.push(Act::Become(Submode::Climbing));
                Progress::Done
            }
            Step::Follow if around.has_setpoint => {
                self.followed = now;
                acts.push(Act::Become(Submode::Following));
                Progress::Done
            }
            Step::Follow if now - self.begun < config.effect_limit_s.seconds() / 2 => Progress::Pending,
            Step::Follow => Progress::Failed("there are no fresh offboard setpoints".into()),
            Step::Stream if now - self.followed < STREAM => Progress::Pending,
            Step::Stream => Progress::Done,
            Step::Stop => {
                acts.extend([Act::Stop, Act::Become(Submode::Holding)]);
                Progress::Done
            }
        }
    }

    fn send(&mut self, sends: CommandLong, until: Until, around: &Around<'_>, acts: &mut Vec<Act>) -> Progress {
        let Around { vehicle, config, now, .. } = *around;
        let say = |tries: u32| Act::Say(Said::Command { command: sends, confirmation: tries.min(255) as u8 });
        let is_takeoff = sends.command == command::TAKEOFF;
        let Some(current) = &mut self.current else {
            self.current = Some(Current { since: now, sent: now, tries: 1, sends, acknowledged: false, refused: None });
            acts.push(say(0));
            return Progress::Pending;
        };
        let is_done = match until {
            Until::Acknowledged => current.acknowledged,
            Until::Armed(armed) => vehicle.heartbeat.is_some_and(|(at, it)| current.since <= at && it.armed == armed),
            Until::Mode(mode) => vehicle.custom_mode() == Some(mode),
        };
        let climbs = vehicle.landed.is_some_and(|(_, it)| it == landed::TAKEOFF || it == landed::IN_AIR);
        if is_done || (is_takeoff && 1 < current.tries && climbs) {
            return Progress::Done;
        }
        // A takeoff that was sent again is refused where the first one was taken and only its acknowledgement was lost.
        let may_have_been_taken = is_takeoff && 1 < current.tries;
        if let Some((at, result)) = current.refused.filter(|_| !may_have_been_taken)
            && TEXTS <= now - at
        {
            return Progress::Failed(refusal(result, vehicle, self.begun, now));
        }
        if config.effect_limit_s.seconds() <= now - current.since {
            return Progress::Failed(match current.acknowledged {
                true => "acknowledged, and its effect is not seen".into(),
                false => match current.refused {
                    Some((_, result)) => refusal(result, vehicle, self.begun, now),
                    None => "the autopilot does not answer".into(),
                },
            });
        }
        let age = now - current.sent;
        if current.acknowledged && matches!(until, Until::Armed(_)) && HEARTBEAT_AGAIN <= age {
            // It says that it is armed with its next heartbeat only: that is asked for.
            current.sent = now;
            let command = CommandLong::new(command::REQUEST_MESSAGE, [0.0]);
            acts.push(Act::Say(Said::Command { command, confirmation: 0 }));
        }
        let is_unanswered = !current.acknowledged && current.refused.is_none();
        if is_unanswered && config.retry_s.seconds() <= age && current.tries < config.tries {
            (current.sent, current.tries) = (now, current.tries + 1);
            acts.push(say(current.tries - 1));
        }
        Progress::Pending
    }
}

enum Progress {
    Pending,
    Done,
    Failed(String),
}

/// Why a command was refused, in the autopilot's words where it has any.
fn refusal(result: u8, vehicle: &Vehicle, since: Time, now: Time) -> String {
    let result = in_words(result);
    let texts = vehicle.texts.warnings_since(since);
    let unhealthy = vehicle.unhealthy(now);
    match (texts.is_empty(), unhealthy.is_empty()) {
        (false, _) => format!("{result}: {texts}"),
        (true, false) => format!("{result}; not healthy: {}", unhealthy.join(", ")),
        (true, true) => format!("{result}; the autopilot does not say why"),
    }
}
