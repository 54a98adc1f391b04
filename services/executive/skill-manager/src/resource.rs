//! What happens to skills: taken, registered, overwritten, cancelled, judged, ended.

use domain::skill::{Goal, kind_name, outcome_name};
use domain::time::Now;
use kittiwake_proto::v1::{FlightMode, SkillOutcome, SkillReply};

use crate::catalog::skill_for;
use crate::commands::next_id;
use crate::executor::Executor;
use crate::fsm::{Action, Ending, Event, Processing, SkillId, State};
use crate::instance::Instance;
use crate::mode_watch::ModeWatch;
use crate::vehicle::at_wall_rate;

/// A request for a skill.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// The caller's name for it.
    pub id: String,
    /// What is to be flown, or what is wrong with the request.
    pub goal: Result<Goal, String>,
    /// Whether it takes the place of a skill that runs; otherwise it is refused then.
    pub replaces: bool,
    /// The running skill that the caller has given up in any case.
    pub gave_up: Option<SkillId>,
}

impl Executor {
    /// Answers a request: with the skill's id, or why there is none.
    pub fn request(&mut self, request: Request, now: Now) -> SkillReply {
        if let Some(first) = self.ledger.answer(&request.id) {
            return first;
        }
        let reply = match self.accept(&request, now) {
            Ok(id) => SkillReply { skill_id: id.0, refusal: String::new() },
            Err(refusal) => {
                self.cancel_given_up(request.gave_up.as_slice(), now);
                SkillReply { skill_id: 0, refusal }
            }
        };
        if !request.id.is_empty() {
            self.ledger.answered(&request.id, &reply, now.time);
        }
        self.proceed(now);
        reply
    }

    /// Cancels a skill that has not ended; otherwise says why not.
    pub fn cancel(&mut self, id: SkillId, now: Now) -> Result<(), String> {
        let slots = [&mut self.registered, &mut self.candidate, &mut self.next];
        let Some(it) = slots.into_iter().find_map(|slot| slot.take_if(|it| it.id == id)) else {
            return Err(match self.ledger.skill(id.0) {
                Some(it) => format!("skill {id} has ended: {}", outcome_name(it.outcome())),
                None => format!("there is no skill {id}"),
            });
        };
        // A request that waits behind another is put back nowhere: it ends here.
        self.drive(it, Event::Cancel, now);
        self.proceed(now);
        Ok(())
    }

    fn accept(&mut self, request: &Request, now: Now) -> Result<SkillId, String> {
        let goal = request.goal.clone()?;
        if request.id.is_empty() {
            return Err("`request_id` is missing".into());
        }
        let running = [&self.candidate, &self.registered].into_iter().flatten().next();
        if let Some(running) = running.filter(|_| !request.replaces) {
            return Err(format!("busy with {} (skill {})", kind_name(running.skill.kind()), running.id));
        }
        let id = SkillId(next_id(&mut self.last_skill, now));
        let mut it = Instance {
            id,
            request_id: request.id.clone(),
            gave_up: request.gave_up.into_iter().collect(),
            skill: skill_for(goal, &self.config, self.pace),
            state: State::ProcessRequest(Processing::Waiting),
            accepted: 0,
            unanswered: false,
            flown: false,
            wants_neutral: false,
            waits_since: None,
            watch: ModeWatch::new(now.time),
        };
        // What a goal is relative to is where the vehicle is now, however long the request waits.
        it.skill.ready(&self.vehicle.view(now.time));
        self.announce(&it, now);
        // What has commanded nothing yet need not be started when something newer is wanted.
        let waiting = State::ProcessRequest(Processing::Waiting);
        let displaced = [self.candidate.take_if(|it| it.state == waiting), self.next.take()];
        for displaced in displaced.into_iter().flatten() {
            it.gave_up.extend(&displaced.gave_up);
            self.drive(displaced, Event::Overwritten { by: id }, now);
        }
        self.next = Some(it);
        Ok(id)
    }

    /// Brings an event about, does what it demands, and puts the skill where it belongs then.
    pub(crate) fn drive(&mut self, mut it: Instance, event: Event, now: Now) {
        for action in it.take(event) {
            match action {
                Action::Register => self.register(&mut it, now),
                Action::RequestNeutral => it.wants_neutral = true,
                Action::Announce => self.announce(&it, now),
            }
        }
        match it.state.clone() {
            State::ProcessRequest(_) => self.candidate = Some(it),
            State::Execute { .. } | State::Cancel => self.registered = Some(it),
            State::Report(_) | State::Abort { .. } => self.drive(it, Event::Sent, now),
            State::Ended(ending) => self.ended(it, &ending, now),
        }
    }

    /// Ends the registered skill if its postcondition is seen, or cannot be reached any more.
    pub(crate) fn look_at_progress(&mut self, now: Now) {
        let Some(it) = &mut self.registered else { return };
        let ending = if !it.has_only_armed() {
            it.skill.progress(&self.vehicle.view(now.time), now.time)
        } else if it.state != State::Cancel {
            Some(Ending::because(SkillOutcome::Failed, "armed, and neither took off nor disarmed"))
        } else {
            None
        };
        if let Some((it, ending)) = self.registered.take_if(|_| ending.is_some()).zip(ending) {
            self.drive(it, Event::Done(ending), now);
        }
    }

    /// The registered skill's postcondition held before anything was commanded.
    pub(crate) fn complete_registered(&mut self, now: Now) {
        if let Some(it) = self.registered.take() {
            self.drive(it, Event::Done(Ending::success()), now);
        }
    }

    /// Ends the registered skill if a status says that the vehicle flies something else.
    pub(crate) fn judge_mode(&mut self, now: Now) {
        let limit = at_wall_rate(self.pace, self.config.mode_timeout_s.seconds());
        let Some(status) = self.vehicle.view(now.time).status else { return };
        // In C the mode is expected to change.
        let executes = |it: &&mut Instance| matches!(it.state, State::Execute { .. });
        let Some(it) = self.registered.as_mut().filter(executes) else { return };
        let ending = it.watch.judge(it.skill.as_ref(), status, now.time, limit);
        if let Some((it, ending)) = self.registered.take_if(|_| ending.is_some()).zip(ending) {
            self.drive(it, Event::Done(ending), now);
        }
    }

    fn register(&mut self, it: &mut Instance, now: Now) {
        if let Some(old) = self.registered.take() {
            self.drive(old, Event::Overwritten { by: it.id }, now);
        }
        it.flown = true;
        it.watch = ModeWatch::new(now.time);
        it.skill.execute(now.time);
        self.idle = None;
        match it.skill.setpoint() {
            // One that commanded nothing only takes over what flows already.
            Some(setpoint) if 0 < it.accepted || self.stream.owner().is_some() => {
                self.stream.switch(it.id, setpoint, now.time);
                self.refresh_setpoint(now.time);
            }
            _ => self.stream.stop(),
        }
        self.restart_feedback(now.time);
    }

    fn ended(&mut self, it: Instance, ending: &Ending, now: Now) {
        match ending.outcome {
            SkillOutcome::Aborted => {}
            // Setpoints would give it back silently what it has taken over.
            SkillOutcome::Preempted => self.end_idle(),
            SkillOutcome::Cancelled if it.flown => self.end_idle(),
            // It has left the vehicle in loiter.
            SkillOutcome::Succeeded if it.skill.mode() == FlightMode::Loiter => self.end_idle(),
            _ if it.flown => self.begin_idle(now.time),
            _ => self.never_flew(it, ending, now),
        }
    }

    fn never_flew(&mut self, it: Instance, ending: &Ending, now: Now) {
        self.disarm_due |= it.has_only_armed();
        if it.unanswered && self.registered.is_none() {
            // The vehicle may fly it all the same.
            self.begin_idle(now.time);
        } else if self.stream.owner() == Some(it.id) {
            self.stream.stop();
        }
        match &mut self.next {
            _ if ending.outcome == SkillOutcome::Cancelled => {}
            // What comes next may replace it, without a loiter in between.
            Some(next) => next.gave_up.extend(&it.gave_up),
            None => self.cancel_given_up(&it.gave_up, now),
        }
    }

    fn cancel_given_up(&mut self, ids: &[SkillId], now: Now) {
        for &id in ids {
            // That it has ended already is all the better.
            let _ = self.cancel(id, now);
        }
    }

    fn announce(&mut self, it: &Instance, now: Now) {
        let event = it.event(&self.vehicle.view(now.time));
        self.ledger.happened(&event, now.time);
        self.outbox.push(event.into());
    }
}
