//! The steps from a start to a goal: a chain of actions, a way for each that flies somewhere, and
//! before each border a wait for its permission.

use std::time::Duration;

use domain::airspace::Motion;
use domain::fmu::FlightMode;
use domain::geometry::Ned;
use domain::known_ground::climb_m;
use domain::plan::{Parameters, PermissionNeed};
use domain::quantity::Positive;
use domain::skill::Goal;
use domain::state::{State, Tolerance};
use domain::way::Asked;

use crate::actions::{Action, Waits, position::Position, release, stop::Stop};
use crate::airspace::{Access, Airspace};
use crate::back_chaining::{self, Link, NoChain};
use crate::communication::{Section, sections};
use crate::config::Config;
use crate::plan::{ActionStep, CommunicationStep, Step};
use crate::routing::{self, NoWay};
use crate::survey::Via;

/// Why a goal cannot be reached, for the mission report.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Unreachable {
    /// Independent of the areas.
    #[error(transparent)]
    NoChain(#[from] NoChain),
    /// Because of an area.
    #[error(transparent)]
    NoWay(#[from] NoWay),
    /// One of several states on the way cannot be reached.
    #[error("{why}, on the way to its turn at {turn}")]
    Turn {
        /// Where, in words.
        turn: String,
        /// Why.
        why: Box<Unreachable>,
    },
}

impl Unreachable {
    fn at(self, turn: Ned) -> Unreachable {
        Unreachable::Turn { turn: turn.to_string(), why: Box::new(self) }
    }
}

/// Steps from `start` through all of `ahead`, each of which is reached within `tolerance`; first to fly first. They have no ids
/// yet, and what they ask for has no length yet.
pub(crate) fn draft(
    start: &State,
    ahead: &[Via],
    tolerance: Tolerance,
    airspace: &Airspace,
    config: &Config,
) -> Result<Vec<Step>, Unreachable> {
    let mut draft = Draft { airspace, config, asked: Asked::new(), at: Duration::ZERO, steps: Vec::new() };
    let mut from = start.clone();
    for via in ahead {
        let flown = draft.steps.len();
        if let Err(why) = draft.fly_to(&from, &via.state, tolerance) {
            return Err(if ahead.len() == 1 { why } else { why.at(via.state.position) });
        }
        if flown < draft.steps.len()
            && let Some(last) = draft.steps.last_mut()
        {
            last.passed = via.passed;
            from = via.state.clone();
        }
    }
    Ok(draft.steps)
}

struct Draft<'a> {
    airspace: &'a Airspace<'a>,
    config: &'a Config,
    asked: Asked,
    /// When the next step begins, from now on.
    at: Duration,
    steps: Vec<Step>,
}

impl Draft<'_> {
    /// From `start`, where the steps before end, to `goal`.
    fn fly_to(&mut self, start: &State, goal: &State, tolerance: Tolerance) -> Result<(), Unreachable> {
        let airspace = self.airspace;
        let links = back_chaining::chain(start, goal, tolerance, &self.under_floors(start, goal))?;
        let flies_at_once = links.last().is_some_and(|it| it.action.waits() == Waits::BeforeEachBorder);
        // Only where the vehicle is now: where it is planned to be it may be.
        let is_here = self.steps.is_empty();
        let is_trespassing = is_here && start.flying && airspace.is_trespassed(start.position);
        if is_trespassing && !links.is_empty() && !flies_at_once {
            // Out of the area first, even where the landing is right below, and back with its permission.
            let there = State::new(start.position, true);
            self.fly_waiting_before_each_border(&Link { action: &Position, from: start.clone(), to: there })?;
        }
        for link in links.iter().rev() {
            match link.action.waits() {
                Waits::BeforeEachBorder => self.fly_waiting_before_each_border(link)?,
                Waits::WhereItStarts => self.wait_and_fly(link)?,
            }
        }
        Ok(())
    }

    /// The configuration with the height over the ground at which `start` is left and `goal` is landed at, if they are there: as low as
    /// the areas over them ask.
    fn under_floors(&self, start: &State, goal: &State) -> Config {
        let (rule, limits, usual) = (&self.airspace.rule, self.config.flight_limits(), self.config.takeoff_height_m);
        let on_ground = [start, goal].into_iter().filter(|it| !it.flying);
        let over_m = on_ground.map(|it| climb_m(it.position, usual.get(), rule, &limits)).fold(usual.get(), f64::min);
        Config { takeoff_height_m: Positive::try_from(over_m).unwrap_or(usual), ..self.config.clone() }
    }

    fn fly_waiting_before_each_border(&mut self, link: &Link) -> Result<(), NoWay> {
        let (from, to) = (link.from.position, link.to.position);
        let way = routing::find(from, to, self.at, self.airspace, &self.asked, self.config)?;
        let mut from = link.from.clone();
        for Section { to, at, ask } in sections(&way, self.airspace, &self.asked, self.config) {
            let to = State { position: to, ..link.to.clone() };
            self.add(link.action, &from, to.clone(), ask);
            (self.at, from) = (at, to);
        }
        Ok(())
    }

    fn wait_and_fly(&mut self, link: &Link) -> Result<(), NoWay> {
        let way = (link.from.position, link.to.position);
        let goal = link.action.set_parameters(&link.from, &link.to, self.config).goal;
        let motion = self.motion(&link.from, &goal);
        let (from, to) = release::free_way(&goal, way);
        let entries = self.airspace.first_entries(from, to, motion, &self.asked);
        let ask: Vec<usize> = entries.into_iter().map(|(_, zone)| zone).collect();
        for zone in &ask {
            match &self.airspace.zones[*zone].access {
                Access::Closed { reason } => return Err(NoWay(reason.clone())),
                Access::Ask { wait_s, .. } => self.pass(*wait_s),
            }
        }
        if !ask.is_empty() {
            let mode = link.from.flying.then_some(FlightMode::Loiter);
            self.add(&Stop, &link.from, State { mode, ..link.from.clone() }, ask);
        }
        self.add(link.action, &link.from, link.to.clone(), Vec::new());
        self.pass(self.config.speeds().time_s(way.0, way.1) + release::time_s(&goal));
        Ok(())
    }

    fn pass(&mut self, seconds: f64) {
        self.at = self.at.saturating_add(Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX));
    }

    /// How what needs the free way of an action with this goal moves.
    fn motion(&self, from: &State, goal: &Goal) -> Motion {
        let speeds = release::free_speeds(goal, self.config.speeds());
        Motion { begins: self.at, speeds, airborne: from.flying, accepts: goal.accepts() }
    }

    fn add(&mut self, action: &dyn Action, from: &State, mut to: State, ask: Vec<usize>) {
        let mut nominal = action.set_parameters(from, &to, self.config);
        let motion = self.motion(from, &nominal.goal);
        let (begin, end) = release::free_way(&nominal.goal, (from.position, to.position));
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
            id: None,
            action: ActionStep { name: action.name(), from: from.position, to, nominal },
            communication: CommunicationStep { ask, ask_ahead: Vec::new(), auxiliary },
            passed: 0,
        });
    }
}

impl Step {
    /// The same step as one that asks for the permissions of `ask`, or, if there are none, for nothing.
    pub(crate) fn asking(mut self, ask: Vec<PermissionNeed>) -> Step {
        let auxiliary = !ask.is_empty();
        hold(&mut self.action.nominal, auxiliary);
        self.communication = CommunicationStep { ask, ask_ahead: Vec::new(), auxiliary };
        self
    }

    /// How long it is flown at least, in seconds.
    pub(crate) fn flight_time_s(&self, config: &Config) -> f64 {
        config.speeds().time_s(self.action.from, self.action.to.position) + release::time_s(&self.action.nominal.goal)
    }

    /// The same as a duration.
    pub(crate) fn flight_time(&self, config: &Config) -> Duration {
        let besides = Duration::from_secs_f64(release::time_s(&self.action.nominal.goal));
        config.speeds().time(self.action.from, self.action.to.position).saturating_add(besides)
    }

    /// How what needs its free way moves if it begins at this time from now on.
    pub(crate) fn motion(&self, begins: Duration, config: &Config) -> Motion {
        let airborne = !matches!(self.action.nominal.goal, Goal::Takeoff { .. });
        let speeds = release::free_speeds(&self.action.nominal.goal, config.speeds());
        Motion { begins, speeds, airborne, accepts: self.action.nominal.goal.accepts() }
    }

    /// How long after its beginning this fraction of its free way is behind.
    pub(crate) fn free_time_to(&self, fraction: f64, config: &Config) -> Duration {
        let (from, to) = self.free_way();
        release::free_speeds(&self.action.nominal.goal, config.speeds()).time_to(fraction, from, to)
    }

    /// The straight way it is planned to take.
    pub(crate) fn way(&self) -> (Ned, Ned) {
        (self.action.from, self.action.to.position)
    }

    /// The straight way that must be free for it.
    pub(crate) fn free_way(&self) -> (Ned, Ned) {
        release::free_way(&self.action.nominal.goal, self.way())
    }

    /// Whether it releases the load.
    pub(crate) fn releases(&self) -> bool {
        matches!(self.action.nominal.goal, Goal::Release { .. })
    }

    /// Whether it asks for `area`.
    pub(crate) fn asks_for(&self, area: &str) -> bool {
        self.communication.ask.iter().any(|need| need.area == area)
    }
}

/// A step that waits for permissions at a position stays there until it is replaced.
fn hold(parameters: &mut Parameters, waits: bool) {
    if let Goal::Position { hold_at_target, .. } = &mut parameters.goal {
        *hold_at_target = waits;
    }
}
