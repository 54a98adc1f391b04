//! What a process must do that carries out a declared skill, case by case: the rules of docs/skills.md.

#![expect(clippy::disallowed_methods, reason = "a command that a person waits for; some reports a second")]

use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use bus::{Link, Scope, Stop};
use domain::declared_skill::{CANCELLED, DeclaredSkill};
use domain::geometry::Ned;
use domain::task::{REPEAT, SILENT, Stance, Task, TaskGoal};
use domain::time::Time;
use domain::wire::task::inputs_to_wire;
use kittiwake_proto::v1::{self, TaskState};

use super::examiner::Examiner;

/// The router is tried for this long.
const OPEN_LIMIT: Duration = Duration::from_secs(10);
/// As long as a task runs before it is troubled.
const BRIEFLY: Duration = Duration::from_millis(300);

/// How one case has ended.
pub(super) struct CaseResult {
    pub(super) case: &'static str,
    pub(super) passed: bool,
    /// In words.
    pub(super) seen: String,
}

/// The process, where the examination starts it.
pub(super) struct Author {
    command: Vec<String>,
    child: Child,
}

impl Author {
    /// Starts it.
    ///
    /// # Errors
    /// If there is no such program.
    pub(super) fn start(command: &[String]) -> Result<Author, String> {
        Ok(Author { child: spawn(command)?, command: command.to_vec() })
    }

    fn restart(&mut self) -> Result<(), String> {
        self.end();
        self.child = spawn(&self.command)?;
        Ok(())
    }

    fn end(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Author {
    fn drop(&mut self) {
        self.end();
    }
}

fn spawn(command: &[String]) -> Result<Child, String> {
    let (program, arguments) = command.split_first().ok_or("there is no command")?;
    let child = Command::new(program).args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).spawn();
    child.map_err(|cause| format!("{program} cannot be started: {cause}"))
}

/// Examines the process that carries out `skill` by orders for `task`; `tell` hears each result. Whether it has passed everything.
///
/// # Errors
/// If there is no router.
pub(super) fn examine(
    skill: &DeclaredSkill,
    task: &Task,
    (connect, vehicle): (&str, &str),
    author: Option<Author>,
    mut tell: impl FnMut(CaseResult),
) -> Result<bool, String> {
    let link =
        Link { connect: vec![connect.to_owned()], scope: Scope::Vehicle(vehicle.to_owned()), open_timeout: OPEN_LIMIT };
    let (send_orders, orders) = channel();
    let (send_reports, reports) = channel();
    let stop = Stop::new();
    let mut examiner = Examiner { orders, reports: send_reports, next: Time::ZERO };
    thread::scope(|scope| {
        let bus = scope.spawn(|| bus::Process::of(&mut examiner, &link).run(&stop));
        let mut exam = Exam {
            skill,
            goal: skill.goal(task, Ned::default()),
            orders: send_orders,
            reports,
            orders_sent: 0,
            author,
        };
        let (mut passed, mut silence) = (true, None);
        let restart = exam.author.is_some().then_some(RESTART);
        for (case, check) in CASES.into_iter().chain(restart) {
            let result = check(&mut exam);
            let is_passed = result.is_ok();
            passed &= is_passed;
            let (Ok(seen) | Err(seen)) = result;
            let result = CaseResult { case, passed: is_passed, seen };
            if case == CASES[0].0 && !is_passed {
                // Nobody is there, or no router: the other cases would say the same.
                silence = Some(result);
                break;
            }
            tell(result);
        }
        stop.stop();
        match bus.join() {
            Ok(Ok(())) => {
                silence.into_iter().for_each(tell);
                Ok(passed)
            }
            Ok(Err(cause)) => Err(cause.to_string()),
            Err(_) => Err("the connection to the bus has ended".to_owned()),
        }
    })
}

/// What was seen; an error: what is wrong about it.
type Seen = Result<String, String>;
type Case = (&'static str, fn(&mut Exam<'_>) -> Seen);

const CASES: [Case; 8] = [
    ("it reports, with the version of its declaration", is_there),
    ("it does a task, and ends with a declared outcome", does_a_task),
    ("an order that comes again is not carried out again", is_done_once),
    ("it reports at least once a second", reports_regularly),
    ("it ends a task that is cancelled", ends_when_cancelled),
    ("a cancellation of another task changes nothing", ignores_other_cancellations),
    ("an order for another skill changes nothing", ignores_other_skills),
    ("another order takes the place of what runs", is_replaced),
];

const RESTART: Case = ("killed in a task and started again, it is ready", is_ready_after_a_restart);

struct Exam<'a> {
    skill: &'a DeclaredSkill,
    goal: TaskGoal,
    orders: Sender<v1::TaskOrder>,
    reports: Receiver<v1::TaskReport>,
    orders_sent: u64,
    author: Option<Author>,
}

impl Exam<'_> {
    /// A name that no order had before, also not one of an earlier examination.
    fn new_id(&mut self) -> String {
        self.orders_sent += 1;
        format!("exam-{}-{}", std::process::id(), self.orders_sent)
    }

    fn send(&self, request_id: &str, skill: &str, cancel: bool) {
        let inputs = inputs_to_wire(&self.goal.task.inputs);
        let order = v1::TaskOrder { request_id: request_id.to_owned(), skill: skill.to_owned(), inputs, cancel };
        // The bus ends first only where there is none.
        let _ = self.orders.send(order);
    }

    fn order(&self, request_id: &str) {
        self.send(request_id, &self.skill.name, false);
    }

    fn cancel(&self, request_id: &str) {
        self.send(request_id, &self.skill.name, true);
    }

    /// The first report of this skill within `limit` of which `holds`, and how long it took.
    fn report(
        &self,
        limit: Duration,
        mut holds: impl FnMut(&v1::TaskReport) -> bool,
    ) -> Option<(v1::TaskReport, Duration)> {
        let begun = Instant::now();
        loop {
            let left = limit.checked_sub(begun.elapsed())?;
            let report = self.reports.recv_timeout(left).ok()?;
            if report.skill == self.skill.name && holds(&report) {
                return Some((report, begun.elapsed()));
            }
        }
    }

    /// Orders a task, again and again as the skill manager does, until it runs; returns its name.
    fn running(&mut self) -> Result<String, String> {
        let id = self.new_id();
        let begun = Instant::now();
        while begun.elapsed() < SILENT + self.interrupt() {
            self.order(&id);
            match self.report(REPEAT, |it| it.request_id == id).map(|(it, _)| it.state()) {
                Some(TaskState::Running) => return Ok(id),
                Some(_) => return Err("it has ended before it could be troubled: give a greater --input".to_owned()),
                None => {}
            }
        }
        Err(format!("no report of an order within {} s", SILENT.as_secs()))
    }

    fn ended(&self, id: &str, limit: Duration) -> Option<(v1::TaskReport, Duration)> {
        self.report(limit, |it| it.request_id == id && it.state() == TaskState::Ended)
    }

    /// Ends what runs, so that the next case begins like the first.
    fn finish(&self, id: &str) {
        self.cancel(id);
        self.ended(id, self.interrupt() + SILENT);
    }

    fn interrupt(&self) -> Duration {
        Duration::from_secs_f64(self.goal.interrupt_s)
    }
}

fn is_there(exam: &mut Exam<'_>) -> Seen {
    let Some((report, _)) = exam.report(OPEN_LIMIT, |_| true) else {
        return Err("nothing was heard on kw/VEHICLE/task/report: does it use the same --vehicle?".to_owned());
    };
    if report.version == exam.skill.version {
        Ok(format!("version {}", report.version))
    } else {
        Err(format!("version {}, declared is {}", report.version, exam.skill.version))
    }
}

fn does_a_task(exam: &mut Exam<'_>) -> Seen {
    if exam.goal.stance == Stance::Flies {
        // It ends with the leg, by an order.
        let id = exam.running()?;
        exam.cancel(&id);
        let ended = exam.ended(&id, SILENT).map(|_| "it runs until the order to end".to_owned());
        return ended.ok_or_else(|| "not ended by an order".to_owned());
    }
    let id = exam.new_id();
    exam.order(&id);
    let limit = Duration::from_secs_f64(exam.goal.limit_s);
    let Some((report, took)) = exam.ended(&id, limit) else {
        exam.finish(&id);
        return Err(format!("not ended after `limit_s`, {} s", exam.goal.limit_s));
    };
    let outcome = &report.outcome;
    let seen = format!("{outcome} after {:.1} s, declared {:.1} s", took.as_secs_f64(), exam.goal.estimate_s);
    if exam.skill.outcomes().any(|(name, _)| name == outcome) { Ok(seen) } else { Err(format!("{seen}: not declared")) }
}

fn is_done_once(exam: &mut Exam<'_>) -> Seen {
    let Some((before, _)) = exam.report(SILENT, |it| it.state() == TaskState::Ended) else {
        return Err("the end is not reported any more".to_owned());
    };
    exam.order(&before.request_id);
    let again = exam.report(2 * REPEAT, |it| it.state() != TaskState::Ended || it.outcome != before.outcome);
    again.map_or_else(|| Ok(String::new()), |(it, _)| Err(format!("{} `{}`", it.state().as_str_name(), it.outcome)))
}

fn reports_regularly(exam: &mut Exam<'_>) -> Seen {
    let begun = Instant::now();
    let mut longest = Duration::ZERO;
    while begun.elapsed() < SILENT {
        let Some((_, gap)) = exam.report(SILENT, |_| true) else { return Err("nothing for 3 s".to_owned()) };
        longest = longest.max(gap);
    }
    let seen = format!("{:.1} s at most", longest.as_secs_f64());
    if longest < Duration::from_millis(1200) { Ok(seen) } else { Err(seen) }
}

fn ends_when_cancelled(exam: &mut Exam<'_>) -> Seen {
    let id = exam.running()?;
    thread::sleep(BRIEFLY);
    exam.cancel(&id);
    let limit = exam.interrupt() + Duration::from_secs(1);
    let Some((report, took)) = exam.ended(&id, limit) else {
        exam.finish(&id);
        return Err(format!(
            "not ended {:.1} s later; `interrupt_s` is {} s",
            limit.as_secs_f64(),
            exam.goal.interrupt_s
        ));
    };
    let seen = format!("{} after {:.1} s, declared {} s", report.outcome, took.as_secs_f64(), exam.goal.interrupt_s);
    if report.outcome == CANCELLED { Ok(seen) } else { Err(format!("{seen}: expected `{CANCELLED}`")) }
}

/// Runs, and goes on running after `trouble`.
fn goes_on_after(exam: &mut Exam<'_>, trouble: impl FnOnce(&mut Exam<'_>)) -> Seen {
    let id = exam.running()?;
    trouble(exam);
    let other = exam.report(BRIEFLY * 3, |it| it.request_id != id || it.outcome == CANCELLED);
    exam.finish(&id);
    other.map_or_else(|| Ok(String::new()), |(it, _)| Err(format!("it reports {} `{}`", it.request_id, it.outcome)))
}

fn ignores_other_cancellations(exam: &mut Exam<'_>) -> Seen {
    goes_on_after(exam, |exam| {
        let other = exam.new_id();
        exam.cancel(&other);
    })
}

fn ignores_other_skills(exam: &mut Exam<'_>) -> Seen {
    goes_on_after(exam, |exam| {
        let other = exam.new_id();
        exam.send(&other, "of_somebody_else", false);
    })
}

fn is_replaced(exam: &mut Exam<'_>) -> Seen {
    let before = exam.running()?;
    thread::sleep(BRIEFLY);
    let next = exam.running();
    if let Ok(id) = &next {
        exam.finish(id);
    }
    next.map(|_| String::new()).map_err(|why| format!("{before} still runs: {why}"))
}

fn is_ready_after_a_restart(exam: &mut Exam<'_>) -> Seen {
    let before = exam.running()?;
    exam.author.as_mut().map_or(Ok(()), Author::restart)?;
    let Some((report, took)) = exam.report(OPEN_LIMIT, |it| it.request_id != before) else {
        return Err(format!("not heard within {} s, or it goes on with the task", OPEN_LIMIT.as_secs()));
    };
    let seen = format!("heard after {:.1} s", took.as_secs_f64());
    if report.state() == TaskState::Ready { Ok(seen) } else { Err(format!("{seen}: {}", report.state().as_str_name())) }
}
