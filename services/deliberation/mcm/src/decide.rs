//! What is decided at a tick: one pure function of flags and situation, the table, and how far the mission has come.

use domain::contingency::narrowing::{Narrowing, narrowing};
use domain::contingency::{Moment, Phase, Raised, Row, responder};
use domain::situation::Situation;
use domain::time::Time;

/// All that a decision follows from, beside the table.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Inputs {
    /// The rows whose flags are up, the most urgent one first.
    pub(crate) raised: Vec<Raised>,
    pub(crate) moment: Moment,
    pub(crate) progress: Progress,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Progress {
    pub(crate) stage: Stage,
    pub(crate) plan: PlanStage,
    /// What an operator must order before the mission begins or goes on.
    pub(crate) order: Option<Wait>,
}

/// How far the mission has come as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Stage {
    /// No plan was asked for.
    #[default]
    Before,
    Begun,
    /// It is over, and not reported.
    Ending,
    Reported,
}

/// How far the plan has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum PlanStage {
    /// It has a step to fly.
    Flown,
    /// There is none, and this is waited for.
    Awaited(Wait),
    /// There is none, and none is needed: every objective is settled.
    #[default]
    Settled,
}

/// What is flown next, and what is done for it. The leaves of one tick all act by the same decision.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Decision {
    pub(crate) activity: Activity,
    /// What the mission waits for, whatever is flown meanwhile.
    pub(crate) wait: Option<Wait>,
    /// What the flags that are up forbid, whatever is flown.
    pub(crate) narrowing: Narrowing,
    /// The rows whose flags are up and not answered, and what each waits for.
    pub(crate) waits: Vec<(usize, Waits)>,
}

/// What is flown next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Activity {
    /// This row responds. Which of its actions is tried is up to the tree, which counts their tries.
    Respond(usize),
    /// Nothing, before the first plan.
    Begin,
    /// The present step.
    Fly,
    /// There is no step: the vehicle stands, or flies a transition, until there is one.
    Bridge,
    /// The mission is over: the vehicle comes to rest, and the report is made.
    End,
    /// The report is made.
    Over,
}

/// What is waited for, and until when: then what it was for follows without.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Wait {
    pub(crate) what: Awaited,
    /// `None`: for as long as it takes.
    pub(crate) until: Option<Time>,
}

/// What the mission waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Awaited {
    /// An operator's order to start.
    Start,
    /// An operator's order to go on after an unplanned landing. In time, or the mission is over.
    GoAhead,
    /// An operator's order to begin the next mission.
    NextStart,
    /// An operator's verdict on a plan. In time, or the default counts.
    Approval,
    /// The vehicle's state, to plan from.
    Vehicle,
    /// The planner's answer.
    Answer,
    /// The time to ask for a plan: there is no way yet, or a step or an answer was unusable.
    Retry,
    /// The end of a stay that the mission asks for; then a plan is asked for.
    Stay,
}

impl Wait {
    /// Whether an operator must order something.
    pub(crate) fn is_for_start(self) -> bool {
        matches!(self.what, Awaited::Start | Awaited::GoAhead | Awaited::NextStart)
    }

    /// Whether it is over at `now`.
    pub(crate) fn is_over(self, now: Time) -> bool {
        self.until.is_some_and(|it| it <= now)
    }
}

/// What a flag that is up and not answered waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Waits {
    /// Another row responds.
    Behind(usize),
    /// It does not count in this phase.
    Until(Phase),
    /// The vehicle is about to stand on the ground.
    ForTouchdown,
    /// The vehicle has not been seen yet.
    ForFirstSight,
}

impl Default for Inputs {
    /// Nothing is seen, and no flag is up.
    fn default() -> Inputs {
        let moment = Moment { situation: Situation::Unseen, phase: Phase::Cruise };
        Inputs { raised: Vec::new(), moment, progress: Progress::default() }
    }
}

impl Decision {
    /// The row that responds; `None`: the mission goes on, or is over.
    pub(crate) fn responder(&self) -> Option<usize> {
        let Activity::Respond(row) = self.activity else { return None };
        Some(row)
    }
}

/// Decides. It does not know the time: what follows when a wait is over is done by who waits.
pub(crate) fn decide(inputs: &Inputs, rows: &[Row]) -> Decision {
    let Inputs { raised, moment, progress } = inputs;
    let responds = responder(rows, raised.iter().copied(), *moment);
    let waits = raised.iter().filter_map(|it| Some((it.row, waits(rows.get(it.row)?, it.row, responds, *moment)?)));
    Decision {
        activity: activity(responds, *progress),
        wait: wait(*progress),
        narrowing: narrowing(rows, raised.iter().copied(), moment.phase),
        waits: waits.collect(),
    }
}

/// A response comes before the end, which may be in the air, and the end before a step.
fn activity(responder: Option<usize>, progress: Progress) -> Activity {
    match (responder, progress.stage, progress.plan) {
        (Some(row), ..) => Activity::Respond(row),
        (None, Stage::Reported, _) => Activity::Over,
        (None, Stage::Ending, _) => Activity::End,
        (None, Stage::Before | Stage::Begun, PlanStage::Flown) => Activity::Fly,
        (None, Stage::Before, _) => Activity::Begin,
        (None, Stage::Begun, _) => Activity::Bridge,
    }
}

/// An operator's order comes before a plan.
fn wait(progress: Progress) -> Option<Wait> {
    progress.order.or(match (progress.stage, progress.plan) {
        (Stage::Before | Stage::Begun, PlanStage::Awaited(wait)) => Some(wait),
        _ => None,
    })
}

/// What `row`, whose number is `number` and whose flag is up, waits for. Nothing waits after the end: flags are reported then.
fn waits(row: &Row, number: usize, responder: Option<usize>, moment: Moment) -> Option<Waits> {
    if row.only_slows() || responder == Some(number) || moment.situation == Situation::Ended {
        return None;
    }
    let may_begin = row.situations.contains(&moment.situation);
    Some(match (responder, moment.situation) {
        (Some(other), _) => Waits::Behind(other),
        (None, Situation::Unseen) => Waits::ForFirstSight,
        (None, Situation::TouchingDown) if !may_begin && row.phases.contains(&moment.phase) => Waits::ForTouchdown,
        (None, _) => Waits::Until(moment.phase),
    })
}

impl Default for Decision {
    /// Before the first tick.
    fn default() -> Decision {
        decide(&Inputs::default(), &[])
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn wait(what: Awaited) -> Wait {
        Wait { what, until: Some(Time::after(Duration::from_secs(5))) }
    }

    #[test]
    fn a_response_comes_before_the_end_and_the_end_before_a_step_and_an_order_is_waited_for_before_a_plan() {
        use Awaited::{Answer, GoAhead, Start};
        let (flown, asked, settled) = (PlanStage::Flown, PlanStage::Awaited(wait(Answer)), PlanStage::Settled);
        #[track_caller]
        fn check(stage: Stage, plan: PlanStage, order: Option<Awaited>, flies: Activity, waits: Option<Awaited>) {
            let progress = Progress { stage, plan, order: order.map(wait) };
            assert_eq!((activity(None, progress), super::wait(progress)), (flies, waits.map(wait)));
            assert_eq!(activity(Some(7), progress), Activity::Respond(7));
        }
        check(Stage::Before, asked, Some(Start), Activity::Begin, Some(Start));
        check(Stage::Before, asked, None, Activity::Begin, Some(Answer));
        check(Stage::Begun, flown, None, Activity::Fly, None);
        check(Stage::Begun, asked, None, Activity::Bridge, Some(Answer));
        check(Stage::Begun, asked, Some(GoAhead), Activity::Bridge, Some(GoAhead));
        check(Stage::Begun, settled, None, Activity::Bridge, None);
        check(Stage::Ending, asked, None, Activity::End, None);
        check(Stage::Reported, flown, Some(Awaited::NextStart), Activity::Over, Some(Awaited::NextStart));
    }

    #[test]
    fn a_wait_is_over_at_its_time_or_never() {
        use Awaited::Answer;
        let at = |s| Time::after(Duration::from_secs(s));
        assert_eq!([4, 5, 6].map(|s| wait(Answer).is_over(at(s))), [false, true, true]);
        assert!(!Wait { what: Answer, until: None }.is_over(at(1_000_000)));
    }
}
