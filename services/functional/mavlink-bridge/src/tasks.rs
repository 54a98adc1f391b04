//! Declared skills that the autopilot carries out: a task is one command of MAVLink. The exchange is that of any other process
//! (docs/skills.md).
//!
//! An acknowledgement says that the command was taken. The task has succeeded once as much time has passed since then as its declaration
//! says; without an acknowledgement nothing has.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::declared_skill::{CANCELLED, DeclaredSkills};
use domain::geometry::Ned;
use domain::payload_command::{Param, PayloadCommand, numbers};
use domain::task::{Stance, Task};
use domain::time::Time;
use domain::wire::task::task_of_order;
use kittiwake_proto::v1::{self, TaskState};
use node::Effect;

use crate::heard::Ack;
use crate::said::{CommandLong, Said};

/// How often a process reports at least.
const PERIOD: Duration = Duration::from_millis(500);
/// A command that is not acknowledged is sent again after this time, and so often. (MAVLink's command protocol.)
const AGAIN: Duration = Duration::from_secs(1);
const TRIES: u8 = 4;

/// The skills, and the task of each that was ordered last.
#[derive(Debug, Default)]
pub(crate) struct Tasks {
    skills: DeclaredSkills,
    present: BTreeMap<String, Present>,
    next_report: Time,
}

#[derive(Debug)]
struct Present {
    request_id: String,
    task: Task,
    command: CommandLong,
    /// What ends it.
    cancel: Option<CommandLong>,
    takes: Duration,
    success: String,
    state: State,
}

#[derive(Debug, Clone, PartialEq)]
enum State {
    /// Sent so often, and again then.
    Sent {
        tries: u8,
        again: Time,
    },
    /// It was taken.
    Acts {
        until: Time,
    },
    Ended {
        outcome: String,
        reason: String,
    },
}

impl Tasks {
    /// Of these, those with a command.
    pub(crate) fn of(skills: &DeclaredSkills) -> Tasks {
        let with_command = skills.all().iter().filter(|it| it.payload_command.is_some()).cloned().collect();
        Tasks { skills: DeclaredSkills::of(with_command), ..Tasks::default() }
    }

    /// An order has arrived, which may be for another process; what is to be sent at once.
    pub(crate) fn order(&mut self, order: v1::TaskOrder, now: Time) -> Option<Said> {
        let command = self.skills.get(&order.skill)?.payload_command.clone()?;
        let present = self.present.get_mut(&order.skill).filter(|it| it.request_id == order.request_id);
        self.next_report = now;
        match (order.cancel, present) {
            (true, Some(present)) => present.cancel(),
            (false, None) => {
                let (request_id, task) = (order.request_id.clone(), task_of_order(order).ok()?);
                let begun = self.begun(request_id, task, &command, now);
                self.present.insert(begun.task.skill.clone(), begun);
                None
            }
            (true, None) | (false, Some(_)) => None,
        }
    }

    fn begun(&self, request_id: String, task: Task, command: &PayloadCommand, now: Time) -> Present {
        let goal = self.skills.goal(&task, Ned::default());
        let long = |params: &[Param]| CommandLong { command: command.command, params: numbers(params, &goal.task) };
        Present {
            request_id,
            command: long(&command.params),
            cancel: command.cancel.as_deref().map(long),
            // Along a leg it is ended by an order.
            takes: Duration::from_secs_f64(if goal.stance == Stance::Flies { goal.limit_s } else { goal.estimate_s }),
            success: goal.succeeds_as.first().cloned().unwrap_or_default(),
            task,
            state: State::Sent { tries: 0, again: now },
        }
    }

    /// The autopilot has acknowledged a command of ours.
    pub(crate) fn acknowledged(&mut self, ack: Ack, now: Time) {
        /// MAV_RESULT.
        const ACCEPTED: u8 = 0;
        const IN_PROGRESS: u8 = 5;
        let is_awaited =
            |it: &&mut Present| it.command.command == ack.command && matches!(it.state, State::Sent { tries: 1.., .. });
        if let Some(present) = self.present.values_mut().find(is_awaited) {
            present.state = match ack.result {
                ACCEPTED => State::Acts { until: now + present.takes },
                IN_PROGRESS => State::Sent { tries: 1, again: now + AGAIN },
                result => ended("refused", format!("the autopilot answers MAV_RESULT {result}")),
            };
            self.next_report = now;
        }
    }

    /// Does what is due; `is_heard`: there is an autopilot that could do it.
    pub(crate) fn act(&mut self, is_heard: bool, now: Time, says: &mut Vec<Said>, effects: &mut Vec<Effect>) {
        for present in self.present.values_mut() {
            let before = present.state.clone();
            says.extend(present.act(now));
            if present.state != before && !matches!(present.state, State::Sent { .. }) {
                self.next_report = now;
            }
        }
        if is_heard && self.next_report <= now {
            self.next_report = now + PERIOD;
            effects.extend(self.skills.all().iter().map(|it| Effect::publish(self.report(&it.name, it.version))));
        }
    }

    fn report(&self, skill: &str, version: u32) -> v1::TaskReport {
        let mut report = v1::TaskReport { skill: skill.to_owned(), version, ..v1::TaskReport::default() };
        let present = self.present.get(skill);
        let state = match present.map(|it| &it.state) {
            None => TaskState::Ready,
            Some(State::Sent { .. } | State::Acts { .. }) => TaskState::Running,
            Some(State::Ended { outcome, reason }) => {
                (report.outcome, report.reason) = (outcome.clone(), reason.clone());
                TaskState::Ended
            }
        };
        report.set_state(state);
        report.request_id = present.map_or_else(String::new, |it| it.request_id.clone());
        report
    }

    /// When something is due.
    pub(crate) fn deadline(&self) -> Option<Time> {
        if self.skills.all().is_empty() {
            return None;
        }
        let present = self.present.values().filter_map(|it| match it.state {
            State::Sent { again, .. } => Some(again),
            State::Acts { until } => Some(until),
            State::Ended { .. } => None,
        });
        present.chain([self.next_report]).min()
    }
}

impl Present {
    /// Ends; what the autopilot is to be told.
    fn cancel(&mut self) -> Option<Said> {
        if matches!(self.state, State::Ended { .. }) {
            return None;
        }
        self.state = ended(CANCELLED, String::new());
        self.cancel.map(|command| Said::Command { command, confirmation: 0 })
    }

    fn act(&mut self, now: Time) -> Option<Said> {
        match self.state {
            State::Sent { tries, again } if again <= now && TRIES <= tries => {
                self.state = ended("unanswered", "the autopilot does not acknowledge the command".to_owned());
                None
            }
            State::Sent { tries, again } if again <= now => {
                self.state = State::Sent { tries: tries + 1, again: now + AGAIN };
                Some(Said::Command { command: self.command, confirmation: tries })
            }
            State::Acts { until } if until <= now => {
                self.state = ended(&self.success, String::new());
                None
            }
            State::Sent { .. } | State::Acts { .. } | State::Ended { .. } => None,
        }
    }
}

fn ended(outcome: &str, reason: String) -> State {
    State::Ended { outcome: outcome.to_owned(), reason }
}

#[cfg(test)]
mod tests {
    use super::*;
    use domain::declared_skill::DeclaredSkill;
    use domain::file::Source;

    fn tasks() -> Tasks {
        let text = "version = 1\nsummary = \"Lowers\"\nseconds = 2.0\nlimit_s = 30.0\noutcome = { done = \"success\" }
            [input.length_m]\nleast = 0.0\nmost = 10.0
            [mavlink]\ncommand = \"DO_WINCH\"\nparams = [1, 1, \"length_m\", 0.5]\ncancel = [1, 3]";
        let skill = DeclaredSkill::read(&Source { path: "lower.toml".into(), text: text.into() }).unwrap();
        Tasks::of(&DeclaredSkills::of(vec![skill]))
    }

    fn order(cancel: bool) -> v1::TaskOrder {
        let inputs = vec![v1::TaskValue { name: "length_m".into(), value: 7.0 }];
        v1::TaskOrder { request_id: "r".into(), skill: "lower".into(), inputs, cancel }
    }

    /// What is sent and reported from an order on, by the tenth of a second: it is acknowledged at the second try, or cancelled.
    #[track_caller]
    fn check(ack: Option<u8>, cancelled_ms: Option<u64>, sends: &[(u64, [f32; 4])], outcome: (u64, &str)) {
        let (mut tasks, mut sent, mut ends) = (tasks(), Vec::new(), None);
        for ms in (0..8_000).step_by(100) {
            let (now, mut says, mut effects) = (Time::after(Duration::from_millis(ms)), Vec::new(), Vec::new());
            if ms == 0 {
                tasks.order(order(false), now);
            }
            if cancelled_ms == Some(ms) {
                says.extend(tasks.order(order(true), now));
            }
            if let Some(result) = ack.filter(|_| ms == 1_200) {
                tasks.acknowledged(Ack { command: 42600, result, target: (0, 0) }, now);
            }
            tasks.act(true, now, &mut says, &mut effects);
            for said in says {
                let Said::Command { command, .. } = said else { panic!("{said:?}") };
                assert_eq!(command.command, 42600);
                sent.push((ms, [command.params[0], command.params[1], command.params[2], command.params[3]]));
            }
            let report = tasks.report("lower", 1);
            if ends.is_none() && report.state() == TaskState::Ended {
                ends = Some((ms, report.outcome));
            }
        }
        assert_eq!(sent, sends);
        assert_eq!(ends, Some((outcome.0, outcome.1.to_owned())));
    }

    /// The shipped skill.
    #[test]
    fn a_task_along_a_leg_runs_until_the_order_to_end_beside_another_one() {
        let shipped = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../config/skills/camera_by_distance.toml");
        let camera = DeclaredSkill::read(&Source::read(shipped.as_ref()).unwrap()).unwrap();
        let mut tasks = Tasks::of(&DeclaredSkills::of(vec![camera, tasks().skills.all()[0].clone()]));
        let films = |cancel| {
            let inputs = vec![v1::TaskValue { name: "every_m".into(), value: 12.0 }];
            v1::TaskOrder { request_id: "c".into(), skill: "camera_by_distance".into(), inputs, cancel }
        };
        let mut sent = Vec::new();
        for second in 0..100 {
            let (now, mut effects) = (Time::after(Duration::from_secs(second)), Vec::new());
            match second {
                0 => _ = tasks.order(films(false), now),
                10 => _ = tasks.order(order(false), now),
                99 => sent.extend(tasks.order(films(true), now)),
                _ => {}
            }
            let said = sent.len();
            tasks.act(true, now, &mut sent, &mut effects);
            for said in &sent[said..] {
                let Said::Command { command, .. } = said else { panic!("{said:?}") };
                tasks.acknowledged(Ack { command: command.command, result: 0, target: (0, 0) }, now);
            }
            let expected = if second < 99 { TaskState::Running } else { TaskState::Ended };
            assert_eq!(tasks.report("camera_by_distance", 1).state(), expected, "{second} s");
        }
        let params =
            |said: &Said| if let Said::Command { command, .. } = said { command.params } else { [f32::NAN; 7] };
        let [films, lowers, ends] = sent.iter().map(params).collect::<Vec<_>>()[..] else { panic!("{sent:?}") };
        assert_eq!(films, [12.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!((lowers[2], ends), (7.0, [0.0; 7]));
        assert_eq!(tasks.report("lower", 1).outcome, "done");
    }

    #[test]
    fn a_command_is_sent_until_it_is_acknowledged_and_then_takes_its_time() {
        let lowers = [1.0, 1.0, 7.0, 0.5];
        check(Some(0), None, &[(0, lowers), (1_000, lowers)], (3_200, "done"));
        check(Some(4), None, &[(0, lowers), (1_000, lowers)], (1_200, "refused"));
        check(None, None, &[(0, lowers), (1_000, lowers), (2_000, lowers), (3_000, lowers)], (4_000, "unanswered"));
        check(
            Some(0),
            Some(2_000),
            &[(0, lowers), (1_000, lowers), (2_000, [1.0, 3.0, 0.0, 0.0])],
            (2_000, "cancelled"),
        );
    }
}
