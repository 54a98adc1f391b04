//! What is commanded next, when the line to the autopilot is free, and what its answers mean.
//!
//! Nothing queues commands: each is chosen, from the state of things, when it can go out.

use domain::time::Now;
use kittiwake_proto::v1::SkillOutcome;

use crate::catalog::Ready;
use crate::commands::{Answer, Command, InFlight, Purpose};
use crate::executor::Executor;
use crate::fsm::{Ending, Event, Processing, State};
use crate::instance::Instance;

impl Executor {
    /// Sends what comes first, if anything can be sent.
    pub(crate) fn command_next(&mut self, now: Now) {
        while !self.commands.is_busy() {
            if std::mem::take(&mut self.disarm_due) {
                self.send(Command::Disarm, Purpose::UndoArming, now);
            } else if let Some(running) = self.registered.as_mut().filter(|it| it.wants_neutral) {
                running.wants_neutral = false;
                let (neutral, purpose) = (running.neutral(), Purpose::Cancel(running.id));
                self.send(neutral, purpose, now);
            } else if let Some(candidate) = self.candidate.take() {
                if !self.start(candidate, now) {
                    return;
                }
            } else if let Some(next) = self.next.take() {
                self.candidate = Some(next);
            } else {
                return self.look_after_idle(now);
            }
        }
    }

    /// The autopilot has answered command `id`.
    pub fn acknowledged(&mut self, id: u64, answer: Answer, now: Now) {
        if let Some(command) = self.commands.answered(id) {
            self.answered(command, answer, now);
        }
        self.proceed(now);
    }

    /// The command in flight is given up if its time is over.
    pub(crate) fn give_up_command(&mut self, now: Now) {
        if let Some(command) = self.commands.given_up(now.time) {
            self.answered(command, Answer::Unanswered, now);
        }
    }

    /// Sends a command; the line is free.
    pub(crate) fn send(&mut self, command: Command, purpose: Purpose, now: Now) {
        self.vehicle.commanded();
        let message = self.commands.send(command, purpose, now);
        self.outbox.push(message.into());
    }

    /// Takes the candidate one command further; false if it waits for data.
    fn start(&mut self, mut candidate: Instance, now: Now) -> bool {
        if candidate.state == State::ProcessRequest(Processing::Waiting) {
            let waited = candidate.waits_since.is_some_and(|since| since + self.data_wait() <= now.time);
            match candidate.skill.ready(&self.vehicle.view(now.time)) {
                Ready::AlreadyTrue => {
                    self.drive(candidate, Event::AlreadyTrue, now);
                    self.complete_registered(now);
                    return true;
                }
                Ready::Require(data) if waited => {
                    let reason = format!("no recent {data} from the vehicle");
                    let ending = Ending::because(SkillOutcome::Failed, reason);
                    self.drive(candidate, Event::Refused(ending), now);
                    return true;
                }
                Ready::Await(_) | Ready::Require(_) if !waited => {
                    candidate.waits_since.get_or_insert(now.time);
                    self.candidate = Some(candidate);
                    return false;
                }
                Ready::Command | Ready::Await(_) | Ready::Require(_) => {
                    candidate.waits_since = None;
                    candidate.take(Event::Commanded);
                }
            }
            // Before the mode command, but never in the way of an offboard that flies.
            if let (Some(setpoint), None) = (candidate.skill.setpoint(), self.stream.owner()) {
                self.stream.switch(candidate.id, setpoint, now.time);
                self.refresh_setpoint(now.time);
            }
        }
        if let Some(command) = candidate.skill.command(candidate.accepted) {
            self.send(command, Purpose::Start(candidate.id), now);
        }
        self.candidate = Some(candidate);
        true
    }

    fn answered(&mut self, InFlight { command, purpose, .. }: InFlight, answer: Answer, now: Now) {
        match purpose {
            Purpose::Start(id) => {
                if let Some(candidate) = self.candidate.take_if(|it| it.id == id) {
                    self.start_answered(candidate, command, answer, now);
                }
            }
            Purpose::Cancel(id) => {
                let cancelling = self.registered.take_if(|it| it.id == id && it.state == State::Cancel);
                match (cancelling, answer) {
                    (Some(it), Answer::Accepted) => self.drive(it, Event::Neutral, now),
                    (Some(it), refused) => {
                        self.drive(it, Event::NeutralRefused(describe("cancel", command, &refused)), now);
                    }
                    // It was through in the meantime; but the vehicle loiters now.
                    (None, Answer::Accepted) if self.registered.is_none() => self.end_idle(),
                    (None, _) => {}
                }
            }
            Purpose::UndoArming => {}
            Purpose::Idle => self.idle_answered(&answer, now.time),
        }
    }

    fn start_answered(&mut self, mut candidate: Instance, command: Command, answer: Answer, now: Now) {
        if answer != Answer::Accepted {
            candidate.unanswered = answer == Answer::Unanswered;
            let reason = describe("start", command, &answer);
            let ending = Ending::because(SkillOutcome::Rejected, reason);
            return self.drive(candidate, Event::Refused(ending), now);
        }
        candidate.accepted += 1;
        let goes_on = candidate.state == State::ProcessRequest(Processing::Commanding)
            && candidate.skill.command(candidate.accepted).is_some();
        if goes_on {
            self.candidate = Some(candidate);
        } else {
            self.drive(candidate, Event::Accepted, now);
        }
    }
}

fn describe(intent: &str, command: Command, answer: &Answer) -> String {
    match answer {
        Answer::Accepted => format!("{intent}: {command} accepted"),
        Answer::Rejected(why) if why.is_empty() => format!("{intent}: {command} rejected"),
        Answer::Rejected(why) => format!("{intent}: {command} rejected: {why}"),
        Answer::Unanswered => format!("{intent}: {command} not acknowledged"),
    }
}
