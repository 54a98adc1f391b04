//! The steps from a start to a goal: a chain of actions, a way for each that flies somewhere, and
//! before each border a wait for its permission.

use domain::fmu::FlightMode;
use domain::geometry::Ned;
use domain::plan::Parameters;
use domain::skill::Goal;
use domain::state::State;

use crate::actions::{Action, Waits, position::Position, stop::Stop};
use crate::airspace::{Access, Airspace, Asked};
use crate::back_chaining::{self, Link, NoChain};
use crate::communication::{Section, sections};
use crate::config::Config;
use crate::plan::{ActionStep, CommunicationStep, Step};
use crate::routing::{self, NoWay};

/// Why a goal cannot be reached, for the mission report.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Unreachable {
    /// Independent of the areas.
    #[error(transparent)]
    NoChain(#[from] NoChain),
    /// Because of an area.
    #[error(transparent)]
    NoWay(#[from] NoWay),
}

/// Steps from `start` to `goal`, first to fly first. They have no ids yet.
pub fn draft(start: &State, goal: &State, airspace: &Airspace, config: &Config) -> Result<Vec<Step>, Unreachable> {
    let mut draft = Draft { airspace, config, asked: Asked::new(), steps: Vec::new() };
    let links = back_chaining::chain(start, goal, config)?;
    let flies_at_once = links.last().is_some_and(|it| it.action.waits() == Waits::BeforeEachBorder);
    let is_trespassing = start.flying && !airspace.trespassed(start.position, &Asked::new()).is_empty();
    if is_trespassing && !links.is_empty() && !flies_at_once {
        // Out of the area first, even where the landing is right below, and back with its permission.
        let there = State::new(start.position, true);
        draft.fly_waiting_before_each_border(&Link { action: &Position, from: start.clone(), to: there })?;
    }
    for link in links.iter().rev() {
        match link.action.waits() {
            Waits::BeforeEachBorder => draft.fly_waiting_before_each_border(link)?,
            Waits::WhereItStarts => draft.wait_and_fly(link)?,
        }
    }
    Ok(draft.steps)
}

struct Draft<'a> {
    airspace: &'a Airspace<'a>,
    config: &'a Config,
    asked: Asked,
    steps: Vec<Step>,
}

impl Draft<'_> {
    fn fly_waiting_before_each_border(&mut self, link: &Link) -> Result<(), NoWay> {
        let (from, to) = (link.from.position, link.to.position);
        let way = routing::find(from, to, self.airspace, &self.asked, self.config)?;
        let mut from = link.from.clone();
        for Section { to, ask } in sections(&way, self.airspace, &self.asked, self.config.stand_off_m.get()) {
            let to = State { position: to, ..link.to.clone() };
            self.add(link.action, &from, to.clone(), ask);
            from = to;
        }
        Ok(())
    }

    fn wait_and_fly(&mut self, link: &Link) -> Result<(), NoWay> {
        let entries = self.airspace.first_entries(link.from.position, link.to.position, &self.asked);
        let ask: Vec<usize> = entries.into_iter().map(|(_, zone)| zone).collect();
        for zone in &ask {
            if let Access::Closed { reason } = &self.airspace.zones[*zone].access {
                return Err(NoWay(reason.clone()));
            }
        }
        if !ask.is_empty() {
            let mode = link.from.flying.then_some(FlightMode::Loiter);
            self.add(&Stop, &link.from, State { mode, ..link.from.clone() }, ask);
        }
        self.add(link.action, &link.from, link.to.clone(), Vec::new());
        Ok(())
    }

    fn add(&mut self, action: &dyn Action, from: &State, mut to: State, ask: Vec<usize>) {
        let mut nominal = action.set_parameters(from, &to, self.config);
        let needed = self.airspace.needed(from.position, to.position, &self.asked);
        nominal.precondition.permissions = needed.clone();
        nominal.invariant.permissions = needed;
        let auxiliary = !ask.is_empty();
        hold(&mut nominal, auxiliary);
        self.asked.extend(&ask);
        to.permissions = self.airspace.needed(to.position, to.position, &self.asked).into_iter().collect();
        let ask = ask.into_iter().map(|zone| self.airspace.zones[zone].area.name.clone()).collect();
        self.steps.push(Step {
            id: None,
            action: ActionStep { name: action.name(), from: from.position, to, nominal },
            communication: CommunicationStep { ask, auxiliary },
        });
    }
}

impl Step {
    /// The same step as one that asks for the permissions of `ask`, or, if there are none, for nothing.
    pub fn asking(mut self, ask: Vec<String>) -> Step {
        let auxiliary = !ask.is_empty();
        hold(&mut self.action.nominal, auxiliary);
        self.communication = CommunicationStep { ask, auxiliary };
        self
    }

    /// How long it is flown at least, in seconds.
    pub fn flight_time_s(&self, config: &Config) -> f64 {
        config.flight_time_s(self.action.from.distance_m(self.action.to.position))
    }

    /// The straight way it is planned to take.
    pub fn way(&self) -> (Ned, Ned) {
        (self.action.from, self.action.to.position)
    }
}

/// A step that waits for permissions at a position stays there until it is replaced.
fn hold(parameters: &mut Parameters, waits: bool) {
    if let Goal::Position { hold_at_target, .. } = &mut parameters.goal {
        *hold_at_target = waits;
    }
}
