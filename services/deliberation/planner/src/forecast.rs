//! What a mission needs, as far as it is known beforehand: each objective is planned from where the
//! one before leaves the vehicle, as if every permission were granted.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use domain::airspace::Grants;
use domain::alternates::Alternate;
use domain::energy::{Budget, Shortfall};
use domain::geometry::Ned;
use domain::mission::Progress;
use domain::plan::{Plan, Step};
use domain::quantity::Fraction;
use domain::skill::Goal;
use domain::state::State;
use domain::time::Now;

use crate::along;
use crate::energy::Hop;
use crate::mission_planner::{Answer, MissionPlanner, Question};
use crate::objectives::Objective;
use crate::plan::{flight_time_s, in_words};

/// What a mission takes.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct MissionForecast {
    /// In the order in which they are attempted.
    pub objectives: Vec<Forecast>,
    /// The way home after an end in the air, flown straight.
    pub way_home: Hop,
    /// In all, the way home included, in Wh.
    pub needs_wh: f64,
    /// What the battery gives; `None` where its charge is not known.
    pub budget: Option<Budget>,
    /// How the order was chosen, in words; empty for a given one.
    pub order: String,
    /// The optional objectives that are left out, and why.
    pub left_out: Vec<(String, String)>,
}

/// What one objective takes.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Forecast {
    pub objective: String,
    /// What it is worth; `None` if it is required.
    pub worth: Option<f64>,
    /// Why it cannot be reached, if so.
    pub unreachable: Option<String>,
    /// What has to be waited for before.
    pub wait: String,
    /// What would be flown; `None` if it is reached already, or never.
    pub plan: Option<Plan>,
    /// Its steps, each as a leg.
    pub legs: Vec<LegForecast>,
    /// When it begins, from now on, in seconds.
    pub begins_s: f64,
    /// At the speeds that are planned with, in seconds, waits not counted.
    pub flight_time_s: f64,
    pub length_m: f64,
    /// In Wh, the stay included.
    pub energy_wh: f64,
    /// How long the vehicle stays there, in seconds.
    pub stay_s: f64,
}

/// A permission and when it is needed, in seconds from now on.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PermissionForecast {
    pub area: String,
    /// When it is asked for.
    pub asked_s: f64,
    /// Whether that is before the leg begins.
    pub ahead: bool,
    /// Until when it must hold.
    pub until_s: f64,
}

/// A step as it is forecast.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LegForecast {
    pub text: String,
    /// Where it begins and ends.
    pub way: (Ned, Ned),
    pub time_s: f64,
    pub energy_wh: f64,
    /// The charge of the battery at its end, 0 to 1; `None` if it is not known.
    pub charge: Option<f64>,
    /// Permission areas it leads through.
    pub areas: Vec<String>,
    /// Permissions that it needs to be asked for: when it begins, or ahead.
    pub asks: Vec<PermissionForecast>,
    /// Those that are held at its end.
    pub held: BTreeSet<String>,
    /// Where the vehicle would best come down early; `None` if that was not looked for.
    pub alternate: Option<Alternate>,
}

impl MissionForecast {
    /// Why the mission must not be flown as it is, if so: the one rule of plan, check, upload and takeoff.
    pub(crate) fn not_flown(&self) -> Option<String> {
        let unreachable = words_of(self.objectives.iter().filter(|it| it.worth.is_none()));
        unreachable.or_else(|| Some(format!("the mission {}", self.shortfall()?)))
    }

    /// What the mission takes more than the battery gives, if so.
    pub(crate) fn shortfall(&self) -> Option<Shortfall> {
        self.budget?.shortfall(self.needs_wh)
    }

    /// Of the optional objectives that would be flown to, the one that is worth least, and its worth; of equal ones the last.
    pub(crate) fn least_worth(&self) -> Option<(String, f64)> {
        let flown = self.objectives.iter().filter(|it| it.plan.is_some() && it.unreachable.is_none());
        let worth = flown.filter_map(|it| Some((it.objective.clone(), it.worth?)));
        worth.reduce(|least, it| if it.1 <= least.1 { it } else { least })
    }
}

/// The objectives among these that cannot be reached, and why.
pub(crate) fn words_of<'a>(forecast: impl Iterator<Item = &'a Forecast>) -> Option<String> {
    let words = |it: &Forecast| Some(format!("objective `{}`: {}", it.objective, it.unreachable.as_ref()?));
    let found: Vec<String> = forecast.filter_map(words).collect();
    (!found.is_empty()).then(|| found.join("; "))
}

/// Most answers without a new objective, for all objectives together; a mission that needs more waits cannot be flown.
const MOST_WAITS: usize = 16;

/// Plans `planner`'s mission without flying it.
pub(crate) fn fly_through(mut planner: MissionPlanner, mut state: State, mut now: Now) -> MissionForecast {
    let (start, budget) = (now, state.charge.map(|it| planner.rules().aircraft.energy.budget(it)));
    // By name: the planner may choose another order.
    let mut forecasts: Vec<Forecast> = Vec::new();
    let (mut used_wh, first_charge) = (0.0, state.charge);
    // Each is planned for, stayed at, and passed.
    let most_answers = 3 * planner.objectives().all().len() + MOST_WAITS;
    for _ in 0..most_answers {
        let question = Question { state: state.clone(), grants: Grants::new(), failed: None, denials: Vec::new() };
        let answer = planner.replan(question, now);
        let index = planner.objectives().current_index();
        if let Some(objective) = planner.objectives().all().get(index)
            && forecasts.last().is_none_or(|it| it.objective != objective.status.objective.name)
        {
            forecasts.push(blank(objective));
        }
        let Some(forecast) = forecasts.last_mut() else { break };
        match answer {
            Answer::Plan(steps) => {
                let Some(last) = steps.last() else { break };
                forecast.plan = Some(planner.plan());
                let begins_s = (now.time - start.time).as_secs_f64();
                let legs = legs(&steps, begins_s, used_wh, (first_charge, &state.permissions), &planner);
                used_wh += legs.iter().map(|it| it.energy_wh).sum::<f64>();
                let time_s = legs.iter().map(|it| it.time_s).sum();
                forecast.add(legs, begins_s);
                state.permissions.extend(steps.iter().flat_map(asked));
                now = planner.after(now, Duration::try_from_secs_f64(time_s).unwrap_or(Duration::MAX));
                state = State {
                    permissions: state.permissions,
                    gripper: last.reaches.gripper.or(state.gripper),
                    charge: charge_after(first_charge, used_wh, &planner).and_then(|it| it.try_into().ok()),
                    ..last.reaches.clone()
                };
                planner.pass_turns_of(&steps);
                along::unfit(&steps, planner.rules()).into_iter().for_each(|it| planner.along_failed(it));
                // What was done at the place is not missed at what follows there.
                let is_done_there = |it: &&Step| it.releases() || matches!(it.nominal.goal, Goal::Task(_));
                for step in steps.iter().filter(|it| it.id != last.id).filter(is_done_there) {
                    planner.flown(step, false, &state, now);
                }
                planner.flown(last, true, &state, now);
            }
            Answer::Hold { wait, reason, planned } => {
                match planned {
                    true => forecast.stay_s = wait.as_secs_f64(),
                    false => forecast.wait = reason,
                }
                let stay_wh = planner.rules().stay_wh(&state, wait.as_secs_f64());
                (forecast.energy_wh, used_wh) = (forecast.energy_wh + stay_wh, used_wh + stay_wh);
                now = planner.after(now, wait);
            }
            Answer::Finished => break,
        }
    }
    // In a wind in which nothing can be flown there is no way home either.
    let flies_home = state.flying && planner.rules().speeds().hold_in_wind();
    let way_home = if flies_home { planner.rules().home(&state) } else { Hop::default() };
    let objectives = settled(&planner, &mut forecasts);
    let needs_wh = used_wh + way_home.energy_wh;
    let order = planner.chosen_order().map(|it| it.in_words()).unwrap_or_default();
    MissionForecast { objectives, way_home, needs_wh, budget, order, left_out: Vec::new() }
}

/// A forecast for each objective, in the order in which they were attempted, with its result.
fn settled(planner: &MissionPlanner, forecasts: &mut Vec<Forecast>) -> Vec<Forecast> {
    let settle = |objective: &Objective| {
        let made = forecasts
            .iter()
            .position(|it| it.objective == objective.status.objective.name)
            .map(|it| forecasts.swap_remove(it));
        let unreachable = match &objective.status.progress {
            Progress::Success => None,
            Progress::Failure(reason) => Some(reason.clone()),
            Progress::Waiting => Some("not reached within the waits of a forecast".into()),
        };
        Forecast { unreachable, ..made.unwrap_or_else(|| blank(objective)) }
    };
    planner.objectives().all().iter().map(settle).collect()
}

fn blank(objective: &Objective) -> Forecast {
    let asked = &objective.status.objective;
    Forecast { objective: asked.name.clone(), worth: asked.terms.worth, ..Forecast::default() }
}

/// `steps` as legs; the first begins `begins_s` from now on, when `used_wh` have been used.
fn legs(
    steps: &[Step],
    begins_s: f64,
    mut used_wh: f64,
    (first_charge, held): (Option<Fraction>, &BTreeSet<String>),
    planner: &MissionPlanner,
) -> Vec<LegForecast> {
    let rules = planner.rules();
    let (mut at_s, mut held) = (begins_s, held.clone());
    // When each area was asked for ahead.
    let mut ahead: BTreeMap<String, f64> = BTreeMap::new();
    let leg = |step: &Step| {
        let (time_s, energy_wh) = (flight_time_s(step, rules), rules.step_wh(step));
        let asks = step.ask.iter().map(|need| PermissionForecast {
            area: need.area.clone(),
            asked_s: ahead.get(&need.area).copied().unwrap_or(at_s),
            ahead: ahead.contains_key(&need.area),
            until_s: at_s + need.lasts.as_secs_f64(),
        });
        let asks = asks.collect();
        let later = step.ask_ahead.iter();
        ahead.extend(later.map(|it| (it.need.area.clone(), at_s + it.after.as_secs_f64())));
        (at_s, used_wh) = (at_s + time_s, used_wh + energy_wh);
        held.extend(asked(step));
        LegForecast {
            text: in_words(step),
            way: step.way(),
            time_s,
            energy_wh,
            charge: charge_after(first_charge, used_wh, planner),
            areas: step.nominal.invariant.permissions.clone(),
            asks,
            held: held.clone(),
            alternate: None,
        }
    };
    steps.iter().map(leg).collect()
}

impl Forecast {
    /// Legs are flown to it, from `begins_s` on.
    fn add(&mut self, legs: Vec<LegForecast>, begins_s: f64) {
        if self.legs.is_empty() {
            self.begins_s = begins_s;
        }
        for leg in &legs {
            self.flight_time_s += leg.time_s;
            self.energy_wh += leg.energy_wh;
            self.length_m += leg.way.0.distance_m(leg.way.1);
        }
        self.legs.extend(legs);
    }

    /// Areas to get permission for.
    pub(crate) fn permissions(&self) -> Vec<String> {
        self.legs.iter().flat_map(|it| &it.asks).map(|it| it.area.clone()).collect()
    }
}

fn charge_after(first_charge: Option<Fraction>, used_wh: f64, planner: &MissionPlanner) -> Option<f64> {
    Some(planner.rules().aircraft.energy.charge_after(first_charge?, used_wh))
}

fn asked(step: &Step) -> impl Iterator<Item = String> {
    step.ask.iter().map(|need| need.area.clone())
}
