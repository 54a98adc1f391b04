//! What an operator asks about the mission: to try another one without flying it, to change it.
//!
//! A change is made as a whole or not at all: a mission that cannot be flown is refused with the reason, and the
//! present mission and plan stay as they are. A change that touches the present objective withdraws
//! the plan; any other change does not disturb the flight.
//!
//! Once the mission has ended another one can be uploaded while the vehicle stands on the ground: it waits there for an operator's order.

use domain::energy::Wind;
use domain::feed::Feed;
use domain::file::{LARGEST_BYTES, Mistakes, Source};
use domain::mission::bounds::MOST_OBJECTIVES;
use domain::mission::terms::Order;
use domain::mission::{Mission, Objective, Progress};
use domain::state::State;
use domain::time::Now;

use crate::alternates::with_alternates;
use crate::forecast::{MissionForecast, words_of};
use crate::lasting_areas::{Closed, added_over_the_vehicle, with_lasting_areas};
use crate::mission_planner::MissionPlanner;
use crate::mission_planner::origin::Misfit;
use crate::new_airspace;

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum MissionRequest {
    /// What the mission in this text would take, in this wind or, without one, in that of the configuration.
    Validate(String, Option<Wind>),
    /// The mission in this text takes the place of the present one.
    Upload(String),
    /// The areas of the mission in this text that came from feeds take the place of the present ones, or are only tried.
    Airspace {
        text: String,
        /// Nothing is changed.
        is_tried: bool,
    },
    /// Another objective, at this place in the list.
    Insert(usize, Objective),
    Remove(String),
    Skip {
        objective: String,
        /// The operator's name, for the report.
        operator: String,
    },
}

/// What happened, or why nothing did.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Reply {
    pub(crate) text: String,
    /// The mistakes in the text of the mission, each with its line and column.
    pub(crate) mistakes: Vec<String>,
    /// What the objectives of a mission that was tried or changed take, if that was computed.
    pub(crate) forecast: Option<Box<MissionForecast>>,
}

impl Reply {
    /// Words only.
    pub(crate) fn new(text: impl Into<String>) -> Reply {
        Reply { text: text.into(), ..Reply::default() }
    }
}

/// A settled mission is over for good: the manager lands and reports.
const OVER: &str = "the mission is over: every objective is settled";

/// The end of the mission.
#[derive(Debug, Default)]
pub(crate) struct End {
    /// Why nothing of the mission is flown any more; empty while it goes on.
    pub(crate) why: String,
    /// It has begun, and what its objectives came to is not reported yet.
    pub(crate) is_flown: bool,
    /// The mission of the next flight waits for its start: the end is that of the one before.
    pub(crate) next_waits: bool,
}

impl End {
    /// Whether nothing of the planner's mission is flown any more.
    fn is_of_this_mission(&self) -> bool {
        !self.why.is_empty() && !self.next_waits
    }

    /// Why nothing is flown any more.
    fn in_words(&self) -> &str {
        if self.why.is_empty() { OVER } else { &self.why }
    }
}

/// Answers `request` for a vehicle in `state`, to which the tower has closed areas.
pub(crate) fn answer(
    planner: &mut MissionPlanner,
    request: MissionRequest,
    state: &State,
    (end, closed): (&End, &Closed),
    now: Now,
) -> Result<Reply, Reply> {
    let asks_about_another = matches!(request, MissionRequest::Upload(_) | MissionRequest::Validate(..));
    let is_flown = state.flying || end.is_flown || !(planner.is_over() || end.is_of_this_mission());
    if asks_about_another && !is_flown {
        planner.forget_answers_of_tower();
    }
    match request {
        MissionRequest::Airspace { .. } if end.is_of_this_mission() || planner.is_over() => {
            Err(Reply::new(format!("{}: upload the next mission with the new airspace", end.in_words())))
        }
        MissionRequest::Airspace { text, is_tried } => {
            new_airspace::adopt(planner, (&text, is_tried), closed, state, now)
        }
        MissionRequest::Insert(..) if end.is_of_this_mission() => {
            Err(Reply::new(format!("{}: nobody would fly it", end.why)))
        }
        MissionRequest::Remove(_) | MissionRequest::Skip { .. } if end.is_of_this_mission() => {
            Err(Reply::new(format!("{}: nothing is left to leave out", end.why)))
        }
        MissionRequest::Validate(text, wind) => {
            try_out(planner, (&text, wind), closed, state, now).map(|it| validate(planner, it))
        }
        MissionRequest::Upload(text) => upload(planner, &text, state, (end, closed), now),
        MissionRequest::Insert(index, objective) => insert(planner, index, objective, state, now),
        MissionRequest::Remove(name) => remove(planner, &name),
        MissionRequest::Skip { objective, operator } => skip(planner, &objective, &operator),
    }
}

/// A mission that can be flown.
struct Tried {
    /// With the areas that stay whatever its text lists.
    mission: Mission,
    forecast: Box<MissionForecast>,
    /// In words, what becomes of areas.
    remarks: Vec<String>,
}

/// The mission in `text` and what it takes.
fn try_out(
    planner: &MissionPlanner,
    (text, wind): (&str, Option<Wind>),
    closed: &Closed,
    state: &State,
    now: Now,
) -> Result<Tried, Reply> {
    let mission = Mission::read_with(&source(text)?, &planner.rules().skills, None).map_err(mistakes_in_text)?;
    match planner.misfit(mission.origin) {
        // On the ground the mission waits until the vehicle knows its place.
        Some(Misfit::Unknown) if !state.flying => {}
        Some(misfit) => return Err(Reply::new(misfit.to_string())),
        None => {}
    }
    let is_renewed = |old: &&Feed| mission.feeds.iter().any(|it| it.renews(old, now.utc_ms));
    let renewed: Vec<Feed> = planner.mission().feeds.iter().filter(is_renewed).cloned().collect();
    let (mission, stays) = with_lasting_areas(planner, closed, mission, |feed| renewed.contains(feed))?;
    let over = added_over_the_vehicle(planner.mission(), &mission, state, now);
    if let Some((_, words)) = over.iter().find(|(of_data_set, _)| !of_data_set) {
        return Err(Reply::new(format!("{words}: fly it out first, or leave the area out")));
    }
    let forecast = judged(planner, &mission, wind.unwrap_or(planner.rules().wind), state, now)?;
    let leaves = over.into_iter().map(|(_, words)| format!("{words}, and leaves it"));
    let remarks = stays.into_iter().chain(leaves).collect();
    Ok(Tried { mission, forecast, remarks })
}

/// What the mission in `text` takes, in words.
fn validate(planner: &MissionPlanner, tried: Tried) -> Reply {
    let Tried { mission, forecast, remarks } = tried;
    let text = match words_of(forecast.objectives.iter().filter(|it| it.worth.is_some())) {
        None => format!("every objective of `{}` can be reached", mission.name),
        Some(left_out) => format!("every required objective of `{}` can be reached; {left_out}", mission.name),
    };
    let text = std::iter::once(text).chain(remarks).collect::<Vec<_>>().join("; ");
    Reply { forecast: Some(forecast), ..Reply::new(planner.with_wind(text, &mission)) }
}

/// What `mission` takes, if it is to be flown.
pub(crate) fn judged(
    planner: &MissionPlanner,
    mission: &Mission,
    wind: Wind,
    state: &State,
    now: Now,
) -> Result<Box<MissionForecast>, Reply> {
    let forecast = planner.forecast(mission, state, now, wind);
    let forecast = Box::new(with_alternates(forecast, planner, mission, wind, now));
    match forecast.not_flown() {
        Some(why) => Err(Reply { forecast: Some(forecast), ..Reply::new(why) }),
        None => Ok(forecast),
    }
}

pub(crate) fn source(text: &str) -> Result<Source, Reply> {
    // Of what comes over the bus its own limit is lower; `kittiwake plan` asks in the same process.
    if LARGEST_BYTES < text.len() as u64 {
        return Err(Reply::new(format!("the text has {} bytes, more than the limit of {LARGEST_BYTES}", text.len())));
    }
    Ok(Source { path: "mission".into(), text: text.to_owned() })
}

pub(crate) fn mistakes_in_text(mistakes: Mistakes) -> Reply {
    let least = if mistakes.is_full() { "at least " } else { "" };
    let mistakes: Vec<String> = mistakes.0.iter().map(|mistake| mistake.to_string()).collect();
    let plural = if mistakes.len() == 1 { "" } else { "s" };
    let text = format!("{least}{} mistake{plural} in the text", mistakes.len());
    Reply { text, mistakes, ..Reply::default() }
}

/// The mission in `text` takes the place of the present one. If nothing of that is flown any more, it is taken where the vehicle stands,
/// but not before the report, which is about the objectives of the flight.
fn upload(
    planner: &mut MissionPlanner,
    text: &str,
    state: &State,
    (end, closed): (&End, &Closed),
    now: Now,
) -> Result<Reply, Reply> {
    let waits = !end.why.is_empty() || planner.is_over();
    if waits && (state.flying || end.is_flown) {
        let once = if state.flying { "the vehicle has landed" } else { "its end is reported" };
        return Err(Reply::new(format!("{}: nobody would fly it; upload it once {once}", end.in_words())));
    }
    let Tried { mission, forecast, remarks } = try_out(planner, (text, None), closed, state, now)?;
    let text = match waits {
        true => format!("`{}` waits for an operator's start", mission.name),
        false => format!("`{}` takes the place of `{}`", mission.name, planner.mission().name),
    };
    let text = new_airspace::with_feeds(text, planner.mission(), &mission, now);
    let text = std::iter::once(text).chain(remarks).collect::<Vec<_>>().join("; ");
    let text = planner.with_wind(text, &mission);
    planner.take_over(mission);
    Ok(Reply { forecast: Some(forecast), ..Reply::new(text) })
}

fn insert(
    planner: &mut MissionPlanner,
    index: usize,
    objective: Objective,
    state: &State,
    now: Now,
) -> Result<Reply, Reply> {
    if planner.is_over() {
        return Err(Reply::new(OVER));
    }
    let (all, current) = (planner.objectives().all(), planner.objectives().current_index());
    if index < current {
        let text = format!("objective {index} is settled; the first place to insert at is {current}");
        return Err(Reply::new(text));
    }
    if all.len() < index || MOST_OBJECTIVES <= all.len() {
        let count = all.len();
        return Err(Reply::new(format!(
            "cannot insert at {index}: the mission has {count} objectives, and the limit is {MOST_OBJECTIVES}"
        )));
    }
    if all.iter().any(|it| it.status.objective.name == objective.name) {
        return Err(Reply::new(format!("there is an objective `{}` already", objective.name)));
    }
    if let Some(why) = planner.mission().unfit_place(&objective, index == all.len()) {
        return Err(Reply::new(why));
    }
    let mut mission = planner.rest_of_mission();
    let waiting_before = all[..index].iter().filter(|it| it.status.progress == Progress::Waiting).count();
    mission.objectives.insert(waiting_before, objective.clone());
    // The order was chosen, and the operator has chosen the place.
    mission.order = Order::Given;
    let forecast = planner.forecast(&mission, state, now, planner.rules().wind);
    let of_this = forecast.objectives.iter().filter(|it| it.objective == objective.name);
    let too_much = || Some(format!("with it the mission {}", forecast.shortfall()?));
    if let Some(why) = words_of(of_this).or_else(too_much) {
        return Err(Reply::new(why));
    }
    let inserted = Mission { objectives: vec![objective.clone()], ..planner.mission().clone() };
    let text = planner.with_wind(format!("objective `{}` inserted at {index}", objective.name), &inserted);
    planner.change(index, |it| it.insert(index, &objective));
    Ok(Reply { forecast: Some(Box::new(forecast)), ..Reply::new(text) })
}

fn remove(planner: &mut MissionPlanner, name: &str) -> Result<Reply, Reply> {
    let index = waiting(planner, name)?;
    if planner.objectives().all().len() == 1 {
        let text = format!("`{name}` is the only objective; skip it, or upload another mission");
        return Err(Reply::new(text));
    }
    planner.change(index, |it| it.remove(index));
    Ok(Reply::new(format!("objective `{name}` removed")))
}

fn skip(planner: &mut MissionPlanner, name: &str, operator: &str) -> Result<Reply, Reply> {
    let index = waiting(planner, name)?;
    let by = if operator.is_empty() { "the operator" } else { operator };
    planner.change(index, |it| it.give_up(index, format!("skipped by {by}")));
    Ok(Reply::new(format!("objective `{name}` skipped")))
}

/// The index of the objective with this name, if it is not settled.
fn waiting(planner: &MissionPlanner, name: &str) -> Result<usize, Reply> {
    let all = planner.objectives().all();
    let index = all.iter().position(|it| it.status.objective.name == name);
    let index = index.ok_or_else(|| Reply::new(format!("there is no objective `{name}`")))?;
    match &all[index].status.progress {
        Progress::Waiting => Ok(index),
        Progress::Success => Err(Reply::new(format!("objective `{name}` has been reached"))),
        Progress::Failure(reason) => Err(Reply::new(format!("objective `{name}` has failed: {reason}"))),
    }
}
