//! Requests and their answers: decides which requests are accepted, and remembers what became of
//! them.

use std::sync::Arc;

use domain::skill::{Goal, kind_name, outcome_name};
use domain::task::TaskGoal;
use domain::time::{Now, Pace, Time};
use domain::wire::InvalidMessage;
use node::Answers;

use crate::catalog::skill_for;
use crate::config::Config;
use crate::fsm::{SkillId, SkillState};
use crate::history::History;
use crate::ids::IdSequence;
use crate::messages::{Input, Output, SkillReport};
use crate::resource::Resource;
use crate::skill_run::SkillRun;
use crate::tracks::Track;
use crate::vehicle::at_wall_rate;

/// A request for a skill.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Request {
    /// The caller's name for it.
    pub(crate) id: String,
    /// What is to be flown and the tasks along it, or why the request is invalid.
    pub(crate) goal: Result<(Goal, Vec<Arc<TaskGoal>>), InvalidMessage>,
    /// Whether it replaces a skill that runs; otherwise it is refused then.
    pub(crate) replaces: bool,
    /// The running skill that the caller has given up in any case.
    pub(crate) gave_up: Option<SkillId>,
    /// An operator has ordered to take the vehicle back from somebody else, or from the autopilot's own failsafe.
    pub(crate) takes_control: bool,
}

/// The answer to a request: the skill, or why there is none.
pub(crate) type Answer = Result<SkillId, String>;

/// Answers callers, and hands accepted requests to the resource.
#[derive(Debug)]
pub(crate) struct Executor {
    config: Config,
    pace: Pace,
    resource: Resource,
    answers: Answers<Answer>,
    history: History,
    ids: IdSequence,
}

impl Executor {
    /// An executor that was never asked for a skill.
    pub(crate) fn new(config: &Config, pace: Pace) -> Executor {
        Executor {
            config: config.clone(),
            pace,
            resource: Resource::new(config, pace),
            answers: Answers::default(),
            history: History::new(at_wall_rate(pace, config.memory_s.seconds())),
            ids: IdSequence::default(),
        }
    }

    /// Answers a request. A repeated one gets the first answer and starts nothing.
    pub(crate) fn request(&mut self, request: Request, now: Now) -> Answer {
        if let Some(first) = self.answers.get(&request.id) {
            return first.clone();
        }
        let answer = self.accept(&request, now);
        if let (Err(_), Some(id)) = (&answer, request.gave_up) {
            // It may have ended already.
            self.resource.cancel(id, now);
        }
        if !request.id.is_empty() {
            self.answers.remember(request.id, answer.clone());
        }
        self.resource.proceed(now);
        answer
    }

    /// How it is known that a pilot or another ground station flies the vehicle; `None`: nobody else does.
    pub(crate) fn flown_by_other(&self) -> Option<&str> {
        self.resource.flown_by_other()
    }

    /// Cancels a skill that has not ended.
    ///
    /// # Errors
    /// If there is nothing to cancel; the text says why.
    pub(crate) fn cancel(&mut self, id: SkillId, now: Now) -> Result<(), String> {
        if self.resource.cancel(id, now) {
            return Ok(());
        }
        Err(match self.history.skill(id).map(|it| &it.state) {
            Some(SkillState::Ended(ending)) => format!("skill {id} has ended: {}", outcome_name(ending.outcome)),
            _ => format!("there is no skill {id}"),
        })
    }

    /// The newest report of each skill, oldest first.
    pub(crate) fn table(&mut self, now: Now) -> impl Iterator<Item = &SkillReport> {
        self.history.table(now.time)
    }

    /// What is to be published since the last call, in order.
    pub(crate) fn take_outputs(&mut self, now: Now) -> Vec<Output> {
        let outputs = self.resource.take_outputs();
        for output in &outputs {
            if let Output::Report(report) = output {
                self.history.reported(report.clone(), now.time);
            }
        }
        outputs
    }

    /// The autopilot has said something.
    pub(crate) fn receive(&mut self, input: Input, now: Now) {
        self.resource.receive(input, now);
    }

    /// Does what is due.
    pub(crate) fn time_passed(&mut self, now: Now) {
        self.resource.time_passed(now);
    }

    /// When [`Executor::time_passed`] has something to do.
    pub(crate) fn deadline(&self) -> Option<Time> {
        self.resource.deadline()
    }

    fn accept(&mut self, request: &Request, now: Now) -> Answer {
        let (goal, along) = request.goal.clone().map_err(|it| it.to_string())?;
        if request.takes_control {
            self.resource.take_control_back();
        }
        if let Some(how) = self.resource.flown_by_other() {
            return Err(format!(
                "somebody else flies the vehicle ({how}), until an operator orders to take control back"
            ));
        }
        if let Some(running) = self.resource.running().filter(|_| !request.replaces) {
            return Err(format!("busy with {} (skill {})", kind_name(running.kind()), running.id()));
        }
        let id = SkillId(self.ids.next(now));
        let skill = skill_for(goal, &request.id, &self.config, self.pace);
        let view = self.resource.view(now);
        let mut run = SkillRun::new(id, request.id.clone(), request.gave_up, skill, &view, now.time);
        let track = |it| Track::new(SkillId(self.ids.next(now)), &request.id, it, &self.config, self.pace);
        run.along(along.into_iter().map(track).collect());
        if request.takes_control {
            run.take_control();
        }
        self.resource.enqueue(run, now);
        Ok(id)
    }
}
