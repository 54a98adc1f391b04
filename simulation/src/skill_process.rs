//! A process that carries out every declared skill, as its declarations say or otherwise.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Duration;

use domain::declared_skill::{CANCELLED, DeclaredSkills};
use domain::geometry::Ned;
use domain::task::{Stance, Task};
use domain::time::{Now, Time};
use domain::wire::task::task_of_order;
use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1::{self, TaskState};
use node::{Effect, Event, Node};

/// How it carries out its orders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Conduct {
    /// As declared: it takes its time, and succeeds.
    #[default]
    Nominal,
    /// It ends as an outcome that is a failure, or as one that no declaration has.
    Fails,
    /// It begins and does not end.
    Endless,
    /// It hears no order.
    Deaf,
    /// It says nothing at all.
    Gone,
}

/// The process; its conduct may be changed from outside.
pub(crate) struct SkillProcess {
    skills: DeclaredSkills,
    conduct: Rc<Cell<Conduct>>,
    /// What it carries out, or has ended, of each skill.
    tasks: BTreeMap<String, Carried>,
    next_report: Time,
}

struct Carried {
    request_id: String,
    ends: Time,
    /// Once it has ended.
    outcome: Option<String>,
}

const PERIOD: Duration = Duration::from_secs(1);

impl SkillProcess {
    pub(crate) fn new(skills: DeclaredSkills, conduct: Rc<Cell<Conduct>>) -> SkillProcess {
        SkillProcess { skills, conduct, tasks: BTreeMap::new(), next_report: Time::ZERO }
    }

    fn take(&mut self, order: v1::TaskOrder, now: Time) {
        let present = self.tasks.get_mut(&order.skill).filter(|it| it.request_id == order.request_id);
        match present {
            Some(present) if order.cancel => {
                present.outcome.get_or_insert_with(|| CANCELLED.to_owned());
            }
            Some(_) => {}
            None if order.cancel => {}
            None => {
                let (request_id, skill) = (order.request_id.clone(), order.skill.clone());
                let Ok(task) = task_of_order(order) else { return };
                let ends = now + self.takes(&task);
                self.tasks.insert(skill, Carried { request_id, ends, outcome: None });
            }
        }
    }

    fn takes(&self, task: &Task) -> Duration {
        let goal = self.skills.goal(task, Ned::default());
        match (self.conduct.get(), goal.stance) {
            (Conduct::Endless, _) => Duration::from_secs(1_000_000),
            // It ends by an order.
            (Conduct::Nominal, Stance::Flies) => Duration::from_secs_f64(goal.limit_s),
            _ => Duration::from_secs_f64(goal.estimate_s),
        }
    }

    fn end_due(&mut self, now: Time) {
        for (name, carried) in &mut self.tasks {
            let succeeds = self.conduct.get() != Conduct::Fails;
            if carried.ends <= now && carried.outcome.is_none() {
                let mut outcomes = self.skills.get(name).into_iter().flat_map(|it| it.outcomes());
                let outcome = outcomes.find(|(_, success)| *success == succeeds).map_or("broken", |(name, _)| name);
                carried.outcome = Some(outcome.to_owned());
            }
        }
    }

    fn report(&self, effects: &mut Vec<Effect>) {
        for skill in self.skills.all() {
            let mut report =
                v1::TaskReport { skill: skill.name.clone(), version: skill.version, ..v1::TaskReport::default() };
            let carried = self.tasks.get(&skill.name);
            let state = match carried.map(|it| &it.outcome) {
                None => TaskState::Ready,
                Some(None) => TaskState::Running,
                Some(Some(outcome)) => {
                    report.outcome.clone_from(outcome);
                    TaskState::Ended
                }
            };
            report.set_state(state);
            report.request_id = carried.map_or_else(String::new, |it| it.request_id.clone());
            effects.push(Effect::publish(report));
        }
    }
}

impl Node for SkillProcess {
    fn name(&self) -> &'static str {
        "skill-process"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[Topic::TaskOrder]
    }

    fn on(&mut self, now: Now, event: Event, _: &mut Vec<Effect>) {
        if let Event::Message { message: Message::TaskOrder(order), .. } = event
            && self.skills.get(&order.skill).is_some()
            && !matches!(self.conduct.get(), Conduct::Deaf | Conduct::Gone)
        {
            self.take(order, now.time);
            self.next_report = now.time;
        }
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.end_due(now.time);
        let has_ended = self.tasks.values().any(|it| it.ends == now.time);
        if self.next_report <= now.time || has_ended {
            self.next_report = now.time + PERIOD;
            if self.conduct.get() != Conduct::Gone {
                self.report(effects);
            }
        }
    }

    fn deadline(&self) -> Option<Time> {
        let ends = self.tasks.values().filter(|it| it.outcome.is_none()).map(|it| it.ends);
        ends.chain([self.next_report]).min()
    }
}
