//! Whether the mission can be flown as it is asked for: its order, its deadlines, and what the battery suffices for.

use std::time::Duration;

use domain::energy::Wind;
use domain::mission::Mission;
use domain::mission::terms::Order;
use domain::plan::Step;
use domain::state::State;
use domain::time::Now;

use super::{Answer, AsForecast, MissionPlanner};
use crate::forecast::{self, MissionForecast};
use crate::objectives::Objective;
use crate::plan::flight_time_s;
use crate::{energy, free_order};

/// A wind in which nothing can be flown is looked at again after this time. (ENG: the mean that the monitor's rules take of a wind.)
const WIND_PASSES: Duration = Duration::from_secs(10);

impl MissionPlanner {
    /// What `mission` would need from `state` on in this wind, if it were the mission now; nothing changes. As many optional
    /// objectives are left out as the energy asks for.
    pub(crate) fn forecast(&self, mission: &Mission, state: &State, now: Now, wind: Wind) -> MissionForecast {
        let mut left_out: Vec<(String, String)> = Vec::new();
        loop {
            let mut scratch = MissionPlanner::new(&self.rules.in_wind(wind), mission.clone(), self.pace);
            scratch.permissions = self.permissions.clone();
            scratch.forecast = Some(AsForecast::default());
            left_out.iter().for_each(|(name, reason)| scratch.objectives.give_up_named(name, reason));
            let forecast = forecast::fly_through(scratch, state.clone(), now);
            match forecast.shortfall().zip(forecast.least_worth()) {
                Some((shortfall, (name, worth))) => {
                    left_out.push((name, format!("left out, worth {worth}: the mission {shortfall}")));
                }
                None => return MissionForecast { left_out, ..forecast },
            }
        }
    }

    /// Why nothing can be flown in this wind, if so.
    pub(super) fn too_windy(&self) -> Option<String> {
        let speeds = self.rules.speeds();
        let (wind_m_s, airspeed_m_s) = (speeds.wind.speed_m_s(), speeds.airspeed_m_s);
        (!speeds.hold_in_wind()).then(|| {
            format!(
                "cannot be flown in a wind of {wind_m_s:.1} m/s: the vehicle flies at most {airspeed_m_s:.1} m/s through the air"
            )
        })
    }

    /// The answer where nothing can be flown in this wind: one that was measured passes, and is waited for.
    pub(super) fn answer_to_wind(&mut self) -> Option<Answer> {
        let reason = self.too_windy()?;
        match (self.rules.wind, &self.forecast) {
            (Wind::Towards { .. }, None) => Some(Answer::Hold { wait: WIND_PASSES, reason, planned: false }),
            _ => {
                self.objectives.give_up_rest(&reason);
                Some(Answer::Finished)
            }
        }
    }

    /// Before the first plan: chooses a free order, and before takeoff leaves out what the battery does not suffice for. Why
    /// nothing is to be flown at all, if so: what an upload would be refused for.
    pub(super) fn begin(&mut self, state: &State, now: Now) -> Option<String> {
        if self.begun.is_some() {
            return None;
        }
        self.begun = Some(now.time);
        if self.mission.order == Order::Free
            && let Some(choice) =
                free_order::choose(&self.objectives, state, &self.rules, |it| self.time_left_s(it, now))
        {
            self.objectives.reorder(&choice.ordering.order);
            if let Some(forecast) = &mut self.forecast {
                forecast.chosen_order = Some(choice);
            }
        }
        if self.forecast.is_some() || state.flying {
            return None;
        }
        // The order is chosen.
        let rest = Mission { order: Order::Given, ..self.rest_of_mission() };
        let forecast = self.forecast(&rest, state, now, self.rules.wind);
        for (name, reason) in &forecast.left_out {
            self.objectives.give_up_named(name, reason);
        }
        let not_flown = forecast.not_flown()?;
        let required = forecast.objectives.iter().filter(|it| it.worth.is_none());
        for (name, reason) in required.filter_map(|it| Some((&it.objective, it.unreachable.as_ref()?))) {
            self.objectives.give_up_named(name, reason);
        }
        Some(not_flown)
    }

    /// The objective that must be given up for `steps` to the current one to be flown, which may be that one, and why.
    pub(super) fn infeasible(&self, steps: &[Step], state: &State, now: Now) -> Option<(usize, String)> {
        let current = self.objectives.current_index();
        let takes_s: f64 = steps.iter().map(|it| flight_time_s(it, &self.rules)).sum();
        let left_s = self.objectives.all().get(current).and_then(|it| self.time_left_s(it, now));
        if let Some(late_s) = left_s.map(|left_s| takes_s - left_s).filter(|it| 0.0 < *it) {
            return Some((current, format!("would be reached {late_s:.0} s too late, {takes_s:.0} s from now")));
        }
        if self.forecast.is_some() {
            return None;
        }
        energy::to_give_up(steps, state, &self.objectives, state.charge?, &self.rules)
    }
}

/// What the vehicle does at `objective` for `wait`.
pub(super) fn stays(objective: &Objective, wait: Duration) -> String {
    format!("stays at `{}` for {:.0} s more", objective.status.objective.name, wait.as_secs_f64())
}
