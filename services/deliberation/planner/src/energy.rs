//! What steps take out of the battery, and which objective is given up where that is too much.

use domain::energy::Leg;
use domain::geometry::Ned;
use domain::mission::Progress;
use domain::plan::Step;
use domain::quantity::Fraction;
use domain::skill::Goal;
use domain::state::State;
use domain::task::Stance;

use crate::actions::time_s;
use crate::back_chaining;
use crate::communication::SAME_PLACE_M;
use crate::objectives::{Objective, Objectives};
use crate::plan::flight_time_s;
use crate::rules::Rules;

/// What is known of the way from one state to another before a way is searched: flown straight.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Hop {
    /// At the speeds that are planned with, in seconds.
    pub time_s: f64,
    pub energy_wh: f64,
}

impl Rules {
    /// What `step` takes, in Wh.
    pub(crate) fn step_wh(&self, step: &Step) -> f64 {
        let (from, to) = step.way();
        let time_s = flight_time_s(step, self);
        let along_w: f64 = step.along.iter().map(|it| it.power_w).sum();
        self.piece_wh(&step.nominal.goal, from, to, time_s) + along_w * time_s / 3600.0
    }

    /// What a stay at `goal` takes, in Wh: nothing on the ground.
    pub(crate) fn stay_wh(&self, goal: &State, stay_s: f64) -> f64 {
        if goal.flying { self.aircraft.energy.hover_wh(stay_s, self.wind) } else { 0.0 }
    }

    /// Straight from `from` to `to`, takeoff and landing included.
    pub(crate) fn hop(&self, from: &State, to: &State) -> Hop {
        let links = back_chaining::chain(from, to, self.tolerance(), self).unwrap_or_default();
        links.iter().fold(Hop::default(), |hop, link| {
            let goal = link.action.parameters(&link.from, &link.to, self).goal;
            let (from, to) = (link.from.position, link.to.position);
            let time_s = self.speeds().time_s(from, to) + time_s(&goal);
            Hop { time_s: hop.time_s + time_s, energy_wh: hop.energy_wh + self.piece_wh(&goal, from, to, time_s) }
        })
    }

    /// From `from` through what `objective` leads through, each straight.
    pub(crate) fn visit(&self, from: &State, objective: &Objective) -> Hop {
        let ahead = objective.ahead();
        let from = &objective.as_begun(from);
        let froms = std::iter::once(from).chain(ahead.iter().map(|it| &it.state));
        let along = objective.terms().along.iter();
        let along_w: f64 = along.map(|it| self.skills.goal(it, objective.goal.position).power_w).sum();
        froms.zip(&ahead).fold(Hop::default(), |sum, (from, to)| {
            let hop = self.hop(from, &to.state);
            let energy_wh = hop.energy_wh + along_w * hop.time_s / 3600.0;
            Hop { time_s: sum.time_s + hop.time_s, energy_wh: sum.energy_wh + energy_wh }
        })
    }

    /// Straight from `from` to the take-off point, landed there.
    pub(crate) fn home(&self, from: &State) -> Hop {
        self.hop(from, &State::new(Ned::default(), false))
    }

    fn piece_wh(&self, goal: &Goal, from: Ned, to: Ned, time_s: f64) -> f64 {
        let more_wh = match goal {
            Goal::Task(it) if it.stance == Stance::Stands => return it.power_w * it.estimate_s / 3600.0,
            Goal::Takeoff { .. } => self.aircraft.energy.takeoff_wh(self.wind),
            Goal::Land | Goal::LandOnTarget => self.aircraft.energy.landing_wh(self.wind),
            Goal::Position { .. } if SAME_PLACE_M < from.distance_m(to) => self.aircraft.energy.stop_wh(self.wind),
            // What hovering for a release takes is in the time of the leg.
            Goal::Task(it) => it.power_w * it.estimate_s / 3600.0,
            Goal::Stop | Goal::Position { .. } | Goal::Velocity { .. } | Goal::Release { .. } => 0.0,
        };
        self.aircraft.energy.leg_wh(Leg { from, to, time_s }, self.wind) + more_wh
    }
}

/// The objective to be given up, so that with this charge the vehicle can come back with its reserve, and why; `None` if it can
/// fly `steps` to the current one and on.
///
/// The rest of the mission is judged by straight ways. If it is too much, the optional objective that is worth least goes first.
/// A required one is flown if the vehicle can come back from it, or if it is the place to come back to.
pub(crate) fn to_give_up(
    steps: &[Step],
    state: &State,
    objectives: &Objectives,
    charge: Fraction,
    rules: &Rules,
) -> Option<(usize, String)> {
    let (waiting, all) = (objectives.waiting(), objectives.all());
    let current = all.get(*waiting.first()?)?;
    let budget = rules.aircraft.energy.budget(charge);
    let stay_s = |index: usize| all[index].terms().dwell.as_secs_f64();
    let there_wh =
        steps.iter().map(|it| rules.step_wh(it)).sum::<f64>() + rules.stay_wh(&current.goal, stay_s(waiting[0]));
    let hops = waiting.windows(2).map(|pair| {
        let (from, to) = (&all[pair[0]].goal, &all[pair[1]]);
        rules.visit(from, to).energy_wh + rules.stay_wh(&to.goal, stay_s(pair[1]))
    });
    let last = waiting.last().map(|it| &all[*it].goal).filter(|it| it.flying);
    let home_wh = last.map_or(0.0, |last| rules.home(last).energy_wh);
    let too_much = budget.shortfall(there_wh + hops.sum::<f64>() + home_wh)?;
    if let Some((index, worth)) = least_worth(objectives) {
        return Some((index, format!("left out, worth {worth}: the mission {too_much}")));
    }
    let is_end = waiting.len() == 1 && !current.goal.flying;
    let back = rules.home(&current.goal);
    let is_home = !current.goal.flying && back == Hop::default();
    if state.flying && is_home {
        return None;
    }
    let back_wh = if is_end { 0.0 } else { back.energy_wh };
    let there_and_back = budget.shortfall(there_wh + back_wh)?;
    Some((waiting[0], format!("the way there and back {there_and_back}")))
}

/// Of the objectives that wait and are optional, the one that is worth least; of equal ones the last.
fn least_worth(objectives: &Objectives) -> Option<(usize, f64)> {
    let optional = objectives.all().iter().enumerate().filter(|(_, it)| it.status.progress == Progress::Waiting);
    let worth = optional.filter_map(|(index, it)| Some((index, it.terms().worth?)));
    worth.reduce(|least, it| if it.1 <= least.1 { it } else { least })
}
