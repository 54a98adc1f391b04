//! Declared skills that the autopilot carries out: a task is one command. The exchange is that of any other process
//! (docs/skills.md).
//!
//! An acknowledgement says that the command was taken. The task has succeeded once as much time has passed since then as its declaration
//! says; without an acknowledgement nothing has. Where the declaration says `done = "picture"`, one must be reported: ArduPilot
//! acknowledges a command to a camera without a camera, too.

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

use crate::command::{ACCEPTED, IN_PROGRESS, NumberedCommand, in_words};

/// How often a process reports at least.
const PERIOD: Duration = Duration::from_millis(500);
/// A command that is not acknowledged is sent again after this time, and so often. (MAVLink's command protocol.)
const AGAIN: Duration = Duration::from_secs(1);
const TRIES: u8 = 4;
/// A camera that takes pictures has reported one within this time. (ENG: one that stores a picture before it reports takes up to two
/// seconds.)
const REPORTS_PICTURE: Duration = Duration::from_secs(10);
/// One that is in progress is not sent again within this time: PX4 refuses a command to its gripper while that moves. (ENG)
const PROGRESSES: Duration = Duration::from_secs(10);

/// The skills, and the task of each that was ordered last.
#[derive(Debug, Default)]
pub struct Tasks {
    skills: DeclaredSkills,
    present: BTreeMap<String, Present>,
    next_report: Time,
}

#[derive(Debug)]
struct Present {
    request_id: String,
    task: Task,
    command: NumberedCommand,
    /// What ends it.
    cancel: Option<NumberedCommand>,
    takes: Duration,
    takes_pictures: bool,
    success: String,
    state: State,
}

#[derive(Debug, Clone, PartialEq)]
enum State {
    /// The command that begins the task, or the one that `ends` it, was sent so often, and is sent again then.
    Sent {
        ends: bool,
        tries: u8,
        again: Time,
    },
    /// The task goes on. Until a picture is reported, one must be by then.
    Acts {
        until: Time,
        picture_by: Option<Time>,
    },
    Ended {
        outcome: String,
        reason: String,
    },
}

impl Tasks {
    /// Of these, those with a command.
    pub fn of(skills: &DeclaredSkills) -> Tasks {
        let with_command = skills.all().iter().filter(|it| it.payload_command.is_some()).cloned().collect();
        Tasks { skills: DeclaredSkills::of(with_command), ..Tasks::default() }
    }

    /// An order has arrived, which may be for another process; what ends the task before it.
    pub fn order(&mut self, order: v1::TaskOrder, now: Time) -> Option<NumberedCommand> {
        let command = self.skills.get(&order.skill)?.payload_command.clone()?;
        let present = self.present.get_mut(&order.skill).filter(|it| it.request_id == order.request_id);
        self.next_report = now;
        match (order.cancel, present) {
            (true, Some(present)) => present.cancel(now),
            (false, None) => {
                let (request_id, task) = (order.request_id.clone(), task_of_order(order).ok()?);
                let begun = self.begun(request_id, task, &command, now);
                let before = self.present.insert(begun.task.skill.clone(), begun);
                let before = before.filter(|it| !matches!(it.state, State::Ended { .. }));
                return before?.cancel;
            }
            (true, None) | (false, Some(_)) => {}
        }
        None
    }

    fn begun(&self, request_id: String, task: Task, command: &PayloadCommand, now: Time) -> Present {
        let goal = self.skills.goal(&task, Ned::default());
        let with = |params: &[Param]| NumberedCommand {
            number: command.command,
            params: numbers(params, &goal.task),
            repeats: 0,
        };
        Present {
            request_id,
            command: with(&command.params),
            cancel: command.cancel.as_deref().map(with),
            // Along a leg it is ended by an order.
            takes: Duration::from_secs_f64(if goal.stance == Stance::Flies { goal.limit_s } else { goal.estimate_s }),
            takes_pictures: command.takes_pictures,
            success: goal.succeeds_as.first().cloned().unwrap_or_default(),
            task,
            state: State::Sent { ends: false, tries: 0, again: now },
        }
    }

    /// The autopilot has acknowledged our command `number` with this MAV_RESULT.
    pub fn acknowledged(&mut self, number: u16, result: u8, now: Time) {
        let awaits = |it: &Present| match it.state {
            State::Sent { ends, tries: 1.., .. } => (it.sends(ends).number == number).then_some(ends),
            _ => None,
        };
        let present = self.present.values_mut().find_map(|it| awaits(it).map(|ends| (it, ends)));
        let Some((present, ends)) = present else { return };
        present.state = match result {
            ACCEPTED if ends => ended(CANCELLED, String::new()),
            ACCEPTED => {
                let picture_by = present.takes_pictures.then_some(now + REPORTS_PICTURE);
                State::Acts { until: now + present.takes, picture_by }
            }
            IN_PROGRESS => State::Sent { ends, tries: 1, again: now + PROGRESSES },
            result => present.failed(ends, "refused", &format!("is refused by the autopilot: {}", in_words(result))),
        };
        self.next_report = now;
    }

    /// A picture is reported.
    pub fn picture_reported(&mut self) {
        for present in self.present.values_mut() {
            if let State::Acts { picture_by, .. } = &mut present.state {
                *picture_by = None;
            }
        }
    }

    /// Does what is due; `is_heard`: there is an autopilot that could do it.
    pub fn act(&mut self, is_heard: bool, now: Time, sends: &mut Vec<NumberedCommand>, effects: &mut Vec<Effect>) {
        for present in self.present.values_mut() {
            let before = present.state.clone();
            sends.extend(present.act(now));
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
    pub fn deadline(&self) -> Option<Time> {
        if self.skills.all().is_empty() {
            return None;
        }
        let present = self.present.values().filter_map(|it| match it.state {
            State::Sent { again, .. } => Some(again),
            State::Acts { until, picture_by } => Some(picture_by.unwrap_or(until)),
            State::Ended { .. } => None,
        });
        present.chain([self.next_report]).min()
    }
}

impl Present {
    /// The command that begins it, or the one that `ends` it.
    fn sends(&self, ends: bool) -> NumberedCommand {
        self.cancel.filter(|_| ends).unwrap_or(self.command)
    }

    /// Ends it, once the autopilot has acknowledged that.
    fn cancel(&mut self, now: Time) {
        self.state = match self.state {
            State::Ended { .. } | State::Sent { ends: true, .. } => return,
            _ if self.cancel.is_some() => State::Sent { ends: true, tries: 0, again: now },
            _ => ended(CANCELLED, String::new()),
        };
    }

    fn act(&mut self, now: Time) -> Option<NumberedCommand> {
        match self.state {
            State::Sent { ends, tries, again } if again <= now && TRIES <= tries => {
                self.state = self.failed(ends, "unanswered", "is not acknowledged by the autopilot");
                None
            }
            State::Sent { ends, tries, again } if again <= now => {
                self.state = State::Sent { ends, tries: tries + 1, again: now + AGAIN };
                Some(NumberedCommand { repeats: tries, ..self.sends(ends) })
            }
            State::Acts { picture_by: Some(by), .. } if by <= now => {
                let why = "the autopilot has acknowledged the command, and reports no picture: is its camera set up?";
                self.state = ended("unanswered", why.to_owned());
                None
            }
            State::Acts { until, picture_by: None } if until <= now => {
                self.state = ended(&self.success, String::new());
                None
            }
            State::Sent { .. } | State::Acts { .. } | State::Ended { .. } => None,
        }
    }

    /// The autopilot did not take the command. Where that should have `ended` the task, the payload may go on: people have to know.
    fn failed(&self, ends: bool, outcome: &str, why: &str) -> State {
        if !ends {
            return ended(outcome, format!("the command {why}"));
        }
        let why = format!("the command that ends it {why}: it may go on");
        tracing::warn!("{}: {why}", self.task.skill);
        ended("error", why)
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
            [mavlink]\ncommand = \"DO_WINCH\"\nparams = [1, 1, \"length_m\", 0.5]\ncancel = [1, 2]";
        let skill = DeclaredSkill::read(&Source { path: "lower.toml".into(), text: text.into() }).unwrap();
        Tasks::of(&DeclaredSkills::of(vec![skill]))
    }

    fn order(request_id: &str, cancel: bool) -> v1::TaskOrder {
        let inputs = vec![v1::TaskValue { name: "length_m".into(), value: 7.0, ..Default::default() }];
        v1::TaskOrder { request_id: request_id.into(), skill: "lower".into(), inputs, cancel }
    }

    /// What is sent and reported from an order on, by the tenth of a second: it is acknowledged with a result, or cancelled.
    #[track_caller]
    fn check(acks: &[(u64, u8)], cancelled_ms: Option<u64>, expected: &[(u64, [f64; 4])], outcome: (u64, &str, &str)) {
        let (mut tasks, mut sent, mut ends) = (tasks(), Vec::new(), None);
        for ms in (0..8_000).step_by(100) {
            let (now, mut sends, mut effects) = (Time::after(Duration::from_millis(ms)), Vec::new(), Vec::new());
            if ms == 0 {
                tasks.order(order("r", false), now);
            }
            // The skill manager repeats it.
            if cancelled_ms.is_some_and(|at| at <= ms) {
                assert_eq!(tasks.order(order("r", true), now), None);
            }
            for (_, result) in acks.iter().filter(|(at, _)| *at == ms) {
                tasks.acknowledged(42600, *result, now);
            }
            tasks.act(true, now, &mut sends, &mut effects);
            sent.extend(sends.into_iter().map(|it| (ms, params(it))));
            let report = tasks.report("lower", 1);
            if ends.is_none() && report.state() == TaskState::Ended {
                ends = Some((ms, report.outcome, report.reason));
            }
        }
        assert_eq!(sent, expected);
        assert_eq!(ends, Some((outcome.0, outcome.1.to_owned(), outcome.2.to_owned())));
    }

    fn params(command: NumberedCommand) -> [f64; 4] {
        assert_eq!(command.number, 42600);
        std::array::from_fn(|i| command.params[i])
    }

    const LOWERS: [f64; 4] = [1.0, 1.0, 7.0, 0.5];
    const STOPS: [f64; 4] = [1.0, 2.0, 0.0, 0.0];

    /// The shipped skill.
    fn camera() -> DeclaredSkill {
        let shipped = concat!(env!("CARGO_MANIFEST_DIR"), "/../../config/skills/camera_by_distance.toml");
        DeclaredSkill::read(&Source::read(shipped.as_ref()).unwrap()).unwrap()
    }

    fn films(cancel: bool) -> v1::TaskOrder {
        let inputs = vec![v1::TaskValue { name: "every_m".into(), value: 12.0, ..Default::default() }];
        v1::TaskOrder { request_id: "c".into(), skill: "camera_by_distance".into(), inputs, cancel }
    }

    #[test]
    fn a_camera_that_reports_no_picture_has_failed_although_its_command_was_acknowledged() {
        /// After which second it has ended, where a picture is reported in this one.
        fn ends_after(picture_s: Option<u64>) -> Option<(u64, String)> {
            let mut tasks = Tasks::of(&DeclaredSkills::of(vec![camera()]));
            tasks.order(films(false), Time::ZERO);
            for second in 0..60 {
                let (now, mut sends) = (Time::after(Duration::from_secs(second)), Vec::new());
                if picture_s == Some(second) {
                    tasks.picture_reported();
                }
                tasks.act(true, now, &mut sends, &mut Vec::new());
                tasks.acknowledged(206, ACCEPTED, now);
                let report = tasks.report("camera_by_distance", 1);
                if report.state() == TaskState::Ended {
                    return Some((second, report.outcome));
                }
            }
            None
        }
        assert_eq!(ends_after(None), Some((10, "unanswered".to_owned())));
        assert_eq!(ends_after(Some(9)), None);
    }

    #[test]
    fn a_task_along_a_leg_runs_until_the_order_to_end_beside_another_one() {
        let mut tasks = Tasks::of(&DeclaredSkills::of(vec![camera(), tasks().skills.all()[0].clone()]));
        let mut sent: Vec<NumberedCommand> = Vec::new();
        for second in 0..100 {
            let (now, mut effects) = (Time::after(Duration::from_secs(second)), Vec::new());
            match second {
                0 => _ = tasks.order(films(false), now),
                10 => _ = tasks.order(order("r", false), now),
                99 => _ = tasks.order(films(true), now),
                _ => {}
            }
            let before = sent.len();
            tasks.picture_reported();
            tasks.act(true, now, &mut sent, &mut effects);
            for command in &sent[before..] {
                tasks.acknowledged(command.number, ACCEPTED, now);
            }
            let expected = if second < 99 { TaskState::Running } else { TaskState::Ended };
            assert_eq!(tasks.report("camera_by_distance", 1).state(), expected, "{second} s");
        }
        let [films, lowers, ends] = sent.iter().map(|it| it.params).collect::<Vec<_>>()[..] else { panic!("{sent:?}") };
        assert_eq!(films, [12.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!((lowers[2], ends), (7.0, [0.0; 7]));
        assert_eq!(tasks.report("lower", 1).outcome, "done");
    }

    #[test]
    fn a_command_is_sent_until_it_is_acknowledged_and_then_takes_its_time() {
        let twice = [(0, LOWERS), (1_000, LOWERS)];
        check(&[(1_200, 0)], None, &twice, (3_200, "done", ""));
        // PX4's gripper: taken at once, and open later.
        check(&[(200, 5), (3_000, 0)], None, &twice[..1], (5_000, "done", ""));
        check(&[(1_200, 4)], None, &twice, (1_200, "refused", "the command is refused by the autopilot: failed"));
        let four = [0, 1_000, 2_000, 3_000].map(|at| (at, LOWERS));
        check(&[], None, &four, (4_000, "unanswered", "the command is not acknowledged by the autopilot"));
    }

    #[test]
    fn the_command_that_ends_it_is_sent_until_it_is_acknowledged() {
        let stops = |at: &[u64]| [&[(0, LOWERS)], &*at.iter().map(|at| (*at, STOPS)).collect::<Vec<_>>()].concat();
        let refused = "the command that ends it is refused by the autopilot: failed: it may go on";
        let unanswered = "the command that ends it is not acknowledged by the autopilot: it may go on";
        check(&[(200, 0), (600, 0)], Some(500), &stops(&[500]), (600, "cancelled", ""));
        check(&[(200, 0), (1_600, 0)], Some(500), &stops(&[500, 1_500]), (1_600, "cancelled", ""));
        check(&[(200, 0), (600, 4)], Some(500), &stops(&[500]), (600, "error", refused));
        check(&[(200, 0)], Some(500), &stops(&[500, 1_500, 2_500, 3_500]), (4_500, "error", unanswered));
    }

    #[test]
    fn another_order_ends_what_runs_first() {
        let (mut tasks, now) = (tasks(), Time::ZERO);
        assert_eq!(tasks.order(order("r", false), now), None);
        let before = tasks.order(order("s", false), now).map(params);
        assert_eq!(before, Some(STOPS));
    }
}
