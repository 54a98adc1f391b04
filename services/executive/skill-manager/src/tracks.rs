//! Tasks along a flight. They begin and end with it, and no flight waits for them. One that the next flight has, too, goes on.

use std::sync::Arc;

use domain::task::TaskGoal;
use domain::time::{Pace, Time};
use kittiwake_proto::v1::{SkillKind, SkillOutcome};

use crate::catalog::Skill as _;
use crate::catalog::task::Task;
use crate::config::Config;
use crate::fsm::{Ending, SkillId, SkillState};
use crate::messages::{SkillReport, TaskOrder, TaskReport};
use crate::vehicle::View;

/// One task.
#[derive(Debug)]
pub(crate) struct Track {
    id: SkillId,
    /// The request of the flight that it goes along with.
    flight: String,
    goal: Arc<TaskGoal>,
    task: Task,
    /// How it has ended, if it has.
    ending: Option<Ending>,
}

impl Track {
    /// It begins once that flight does.
    pub(crate) fn new(id: SkillId, flight: &str, goal: Arc<TaskGoal>, config: &Config, pace: Pace) -> Track {
        let request_id = format!("{flight}-{}", goal.task.skill);
        let task = Task::new(goal.clone(), &request_id, config, pace);
        Track { id, flight: flight.to_owned(), goal, task, ending: None }
    }

    fn has_failed(&self) -> bool {
        self.ending.as_ref().is_some_and(|it| it.outcome != SkillOutcome::Succeeded)
    }

    fn report(&self) -> SkillReport {
        let goes_on = SkillState::Execute { trouble: None };
        SkillReport {
            id: self.id,
            request_id: self.flight.clone(),
            kind: SkillKind::Task,
            state: self.ending.clone().map_or(goes_on, SkillState::Ended),
            motion: None,
            landed_timestamp_us: 0,
            flown_by_other: false,
            along: self.goal.task.skill.clone(),
        }
    }

    /// Ends it here; the order that ends it in its process, if it goes on there.
    fn end(&mut self, ending: Ending) -> Option<TaskOrder> {
        self.ending = Some(ending);
        self.task.order_to_end().map(|(order, _)| order)
    }
}

/// Those of the present flight.
#[derive(Debug, Default)]
pub(crate) struct Tracks(Vec<Track>);

impl Tracks {
    /// A flight with these has begun, or the last one has ended: what is to be told about each, and the orders that end the others. One
    /// that has failed begins again.
    pub(crate) fn follow(&mut self, wanted: Vec<Track>) -> (Vec<SkillReport>, Vec<TaskOrder>) {
        let is_wanted = |it: &Track| wanted.iter().any(|new| new.goal == it.goal);
        let (going_on, over): (Vec<Track>, Vec<Track>) =
            std::mem::take(&mut self.0).into_iter().partition(|it| !it.has_failed() && is_wanted(it));
        let (mut reports, mut orders) = (Vec::new(), Vec::new());
        for mut track in over.into_iter().filter(|it| it.ending.is_none()) {
            orders.extend(track.end(Ending::because(SkillOutcome::Cancelled, "the leg has ended")));
            reports.push(track.report());
        }
        self.0 = going_on;
        for new in wanted {
            match self.0.iter_mut().find(|it| it.goal == new.goal) {
                Some(track) => track.flight = new.flight,
                None => self.0.push(new),
            }
        }
        reports.extend(self.0.iter().map(Track::report));
        (reports, orders)
    }

    /// Those that end by now: what is to be told, and the orders that end them in their processes.
    pub(crate) fn proceed(&mut self, view: &View, now: Time) -> (Vec<SkillReport>, Vec<TaskOrder>) {
        let (mut reports, mut orders) = (Vec::new(), Vec::new());
        for track in self.going_on() {
            if let Some(ending) = track.task.progress(view, now) {
                orders.extend(track.end(ending));
                reports.push(track.report());
            }
        }
        (reports, orders)
    }

    /// What their processes are to be told now. `may_begin`: no other process has yet to end what it does.
    pub(crate) fn take_orders(&mut self, may_begin: bool, now: Time) -> Vec<TaskOrder> {
        self.going_on().filter(|it| may_begin && !it.task.is_begun()).for_each(|it| it.task.execute(now));
        self.going_on().filter_map(|it| it.task.take_order(now)).collect()
    }

    /// A process has reported about a declared skill.
    pub(crate) fn hear(&mut self, report: &TaskReport, now: Time) {
        self.going_on().for_each(|it| it.task.hear(report, now));
    }

    /// Whether one of them is the task of that name.
    pub(crate) fn has(&self, request_id: &str) -> bool {
        self.0.iter().any(|it| it.task.is_ordered_as(request_id))
    }

    /// When something is due.
    pub(crate) fn deadline(&self) -> Option<Time> {
        self.0.iter().filter(|it| it.ending.is_none()).filter_map(|it| it.task.deadline()).min()
    }

    fn going_on(&mut self) -> impl Iterator<Item = &mut Track> {
        self.0.iter_mut().filter(|it| it.ending.is_none())
    }
}
