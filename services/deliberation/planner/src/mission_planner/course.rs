//! A mission as far as it has come, as a question brings it and an answer takes it away.

use domain::geodesy::Origin;
use domain::mission::{self, InvalidObjective, Mission, Progress};
use domain::plan::{MissionStatus, Step};
use domain::time::Pace;

use super::MissionPlanner;
use crate::airspace::Around;
use crate::known_areas::Known;
use crate::notes::Notes;
use crate::objectives::{Objective, Objectives};
use crate::rules::Rules;

pub(crate) struct Brought {
    /// Without its areas.
    pub(crate) mission: MissionStatus,
    pub(crate) notes: Notes,
    /// Of the mission.
    pub(crate) areas: Known,
    pub(crate) vehicle_origin: Option<Origin>,
    /// As it is estimated, towards north and east in m/s.
    pub(crate) wind: Option<(f64, f64)>,
    /// The steps of the present plan that were not flown.
    pub(crate) rest: Vec<Step>,
}

impl MissionPlanner {
    /// A planner that goes on with this mission.
    ///
    /// # Errors
    /// If the mission has an objective that no mission may have.
    pub(crate) fn going_on(rules: &Rules, pace: Pace, brought: Brought) -> Result<MissionPlanner, InvalidObjective> {
        let Brought { mission: status, notes, areas: Known { areas, feeds, map, .. }, vehicle_origin, wind, rest } =
            brought;
        let objectives: Vec<mission::Objective> = status.objectives.iter().map(|it| it.objective.clone()).collect();
        for it in &objectives {
            mission::Objective::new(it.name.clone(), it.position, it.flying)?;
        }
        let mut past: Vec<Objective> = status.objectives.into_iter().map(Objective::of).collect();
        let current = past.iter_mut().find(|it| it.status.progress == Progress::Waiting);
        current.into_iter().for_each(|it| it.dwells_since = notes.dwells_since);
        let MissionStatus { mission: name, order, sites, origin, .. } = status;
        let wind = wind.map_or(rules.wind, |it| rules.aircraft.energy.wind_where_measured(it));
        Ok(MissionPlanner {
            rules: rules.in_wind(wind),
            objectives: Objectives::with_past(past),
            around: Around { map, ..Around::default() },
            permissions: notes.permissions,
            rest,
            revision: status.revision,
            last_step_id: notes.last_step_id,
            stuck: notes.stuck,
            hold: notes.hold,
            vehicle_origin,
            begun: notes.begun,
            ..MissionPlanner::new(rules, Mission { name, objectives, areas, order, sites, origin, feeds }, pace)
        })
    }

    /// The mission as far as it has come, and the notes for the next question.
    pub(crate) fn course(&mut self) -> (MissionStatus, Notes) {
        let notes = Notes {
            last_step_id: self.last_step_id,
            begun: self.begun,
            dwells_since: self.objectives.current().and_then(|it| it.dwells_since),
            permissions: self.permissions.clone(),
            hold: self.hold.clone(),
            stuck: self.stuck.clone(),
        };
        (self.status(), notes)
    }

    /// The mission's areas, with what is known of them for the next question. They have the name `id`.
    pub(crate) fn into_areas(self, id: String) -> Known {
        Known { id, areas: self.mission.areas, feeds: self.mission.feeds, map: self.around.map }
    }
}
