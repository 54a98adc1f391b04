//! The steps from a start to a goal: a chain of actions, a way for each that flies somewhere, and
//! before each border a wait for its permission.

use std::time::Duration;

use domain::airspace::Motion;
use domain::fmu::FlightMode;
use domain::known_ground::climb_m;
use domain::plan::{PermissionNeed, Step};
use domain::quantity::Positive;
use domain::skill::Goal;
use domain::state::{State, Tolerance};
use domain::way::Asked;

use crate::actions::{Action, free_speeds, free_way, time_s};
use crate::airspace::{Access, Airspace};
use crate::back_chaining::{self, Link};
use crate::communication::{Section, sections};
use crate::plan::{NEW, hold};
use crate::routing::{self, NoWay};
use crate::rules::Rules;
use crate::survey::Via;

/// Steps from `start` through all of `ahead`, each of which is reached within `tolerance`; first to fly first. They have no ids
/// yet, and what they ask for has no length yet.
pub(crate) fn draft(
    start: &State,
    ahead: &[Via],
    tolerance: Tolerance,
    airspace: &Airspace,
    rules: &Rules,
) -> Result<Vec<Step>, NoWay> {
    let mut draft = Draft { airspace, rules, asked: Asked::new(), at: Duration::ZERO, steps: Vec::new() };
    let mut from = start.clone();
    for via in ahead {
        let flown = draft.steps.len();
        if let Err(why) = draft.fly_to(&from, &via.state, tolerance) {
            let turn = via.state.position;
            return Err(if ahead.len() == 1 { why } else { NoWay(format!("{why}, on the way to its turn at {turn}")) });
        }
        if flown < draft.steps.len()
            && let Some(last) = draft.steps.last_mut()
        {
            last.passed = via.passed as u32;
            from = via.state.clone();
        }
    }
    Ok(draft.steps)
}

struct Draft<'a> {
    airspace: &'a Airspace<'a>,
    rules: &'a Rules,
    asked: Asked,
    /// When the next step begins, from now on.
    at: Duration,
    steps: Vec<Step>,
}

impl Draft<'_> {
    /// From `start`, where the steps before end, to `goal`.
    fn fly_to(&mut self, start: &State, goal: &State, tolerance: Tolerance) -> Result<(), NoWay> {
        let airspace = self.airspace;
        let links = back_chaining::chain(start, goal, tolerance, &self.under_floors(start, goal))?;
        let flies_at_once = links.last().is_some_and(|it| it.action == Action::Position);
        // Only where the vehicle is now: a planned position is allowed.
        let is_here = self.steps.is_empty();
        let is_trespassing = is_here && start.flying && airspace.is_trespassed(start.position);
        if is_trespassing && !links.is_empty() && !flies_at_once {
            // Out of the area first, even where the landing is right below, and back with its permission.
            let there = State::new(start.position, true);
            self.fly_waiting_before_each_border(&Link { action: Action::Position, from: start.clone(), to: there })?;
        }
        for link in links.iter().rev() {
            match link.action {
                Action::Position => self.fly_waiting_before_each_border(link)?,
                Action::Land | Action::Takeoff | Action::Stop | Action::Release | Action::Task => {
                    self.wait_and_fly(link)?
                }
            }
        }
        Ok(())
    }

    /// The rules with the height over the ground at which `start` is left and `goal` is landed at, if they are there: as low as
    /// the areas over them ask.
    fn under_floors(&self, start: &State, goal: &State) -> Rules {
        let (rule, limits, usual) =
            (&self.airspace.rule, self.rules.flight_limits(), self.rules.config.takeoff_height_m);
        let on_ground = [start, goal].into_iter().filter(|it| !it.flying);
        let over_m = on_ground.map(|it| climb_m(it.position, usual.get(), rule, &limits)).fold(usual.get(), f64::min);
        let mut rules = self.rules.clone();
        rules.config.takeoff_height_m = Positive::try_from(over_m).unwrap_or(usual);
        rules
    }

    fn fly_waiting_before_each_border(&mut self, link: &Link) -> Result<(), NoWay> {
        let (from, to) = (link.from.position, link.to.position);
        let way = routing::find(from, to, self.at, self.airspace, &self.asked, self.rules)?;
        let mut from = link.from.clone();
        for Section { to, at, ask } in sections(&way, self.airspace, &self.asked, self.rules) {
            let to = State { position: to, ..link.to.clone() };
            self.add(link.action, &from, to.clone(), ask);
            (self.at, from) = (at, to);
        }
        Ok(())
    }

    fn wait_and_fly(&mut self, link: &Link) -> Result<(), NoWay> {
        let way = (link.from.position, link.to.position);
        let goal = link.action.parameters(&link.from, &link.to, self.rules).goal;
        let motion = self.motion(&link.from, &goal);
        let (from, to) = free_way(&goal, way);
        let entries = self.airspace.first_entries(from, to, motion, &self.asked);
        let ask: Vec<usize> = entries.into_iter().map(|(_, zone)| zone).collect();
        for zone in &ask {
            match &self.airspace.zones[*zone].access {
                Access::Closed { .. } if goal.is_release() => {
                    let area = &self.airspace.zones[*zone].area.name;
                    return Err(NoWay(format!(
                        "area {area}: the load may fall into it (a load falls as far aside as down)"
                    )));
                }
                Access::Closed { reason } => return Err(NoWay(reason.clone())),
                Access::Ask { wait_s, .. } => self.pass(*wait_s),
            }
        }
        if !ask.is_empty() {
            let mode = link.from.flying.then_some(FlightMode::Loiter);
            self.add(Action::Stop, &link.from, State { mode, ..link.from.clone() }, ask);
        }
        self.add(link.action, &link.from, link.to.clone(), Vec::new());
        self.pass(self.rules.speeds().time_s(way.0, way.1) + time_s(&goal));
        Ok(())
    }

    fn pass(&mut self, seconds: f64) {
        self.at = self.at.saturating_add(Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX));
    }

    /// How what needs the free way of an action with this goal moves.
    fn motion(&self, from: &State, goal: &Goal) -> Motion {
        let speeds = free_speeds(goal, self.rules.speeds());
        Motion { begins: self.at, speeds, airborne: from.flying, is_load: goal.is_release() }
    }

    fn add(&mut self, action: Action, from: &State, mut to: State, ask: Vec<usize>) {
        let mut nominal = action.parameters(from, &to, self.rules);
        let motion = self.motion(from, &nominal.goal);
        let (begin, end) = free_way(&nominal.goal, (from.position, to.position));
        let needed = self.airspace.needed(begin, end, motion, &self.asked);
        nominal.precondition.permissions = needed.clone();
        nominal.invariant.permissions = needed;
        let auxiliary = !ask.is_empty();
        hold(&mut nominal, auxiliary);
        self.asked.extend(&ask);
        to.permissions = self.airspace.needed(to.position, to.position, motion, &self.asked).into_iter().collect();
        let need =
            |zone: usize| PermissionNeed { area: self.airspace.zones[zone].area.name.clone(), lasts: Duration::ZERO };
        let ask = ask.into_iter().map(need).collect();
        self.steps.push(Step {
            id: NEW,
            objective: 0,
            from: from.position,
            reaches: to,
            nominal,
            ask,
            ask_ahead: Vec::new(),
            auxiliary,
            passed: 0,
            along: Vec::new(),
            text: String::new(),
        });
    }
}
