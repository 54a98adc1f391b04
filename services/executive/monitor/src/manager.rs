//! What only the mission manager knows and rules read: the outlook of the battery, and how the flight goes on.

use std::time::Duration;

use domain::geometry::Ned;
use domain::time::{Pace, Time};
use domain::wire::InvalidMessage;
use kittiwake_proto::v1;

/// What the mission manager said longer ago, in wall time, is not known any more. (ENG: six statuses at 2 Hz; `manager_lost` is raised
/// after one second.)
const SILENT: Duration = Duration::from_secs(3);

/// The part of a status that rules read; a value that is not a finite number was refused.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Outlook {
    pub(crate) home_margin_percent: Option<f64>,
    pub(crate) place_margin_percent: Option<f64>,
    pub(crate) consumption_percent: Option<f64>,
    pub(crate) endurance_s: Option<f64>,
    pub(crate) airspeed_left_m_s: Option<f64>,
    pub(crate) path_deviation_m: Option<f64>,
    pub(crate) pace_percent: Option<f64>,
    pub(crate) cancel_s: Option<f64>,
    pub(crate) operator_s: Option<f64>,
    pub(crate) plan_s: Option<f64>,
    /// Where the mission leads next, and how fast, in metres per second.
    pub(crate) intends: Option<(Ned, f64)>,
}

impl TryFrom<&v1::McmStatus> for Outlook {
    type Error = InvalidMessage;
    fn try_from(status: &v1::McmStatus) -> Result<Outlook, InvalidMessage> {
        let (energy, progress) = (status.energy.as_ref(), status.progress.as_ref());
        let margin = |it: Option<&v1::PlaceOutlook>| it.map(|it| it.margin * 100.0);
        let outlook = Outlook {
            home_margin_percent: margin(energy.and_then(|it| it.home.as_ref())),
            place_margin_percent: margin(energy.and_then(|it| it.best.as_ref())),
            consumption_percent: energy.and_then(|it| it.consumption).map(|it| it * 100.0),
            endurance_s: energy.map(|it| it.endurance_s),
            airspeed_left_m_s: energy.and_then(|it| it.airspeed_left_m_s),
            path_deviation_m: progress.and_then(|it| it.path_deviation_m),
            pace_percent: progress.and_then(|it| it.pace).map(|it| it * 100.0),
            cancel_s: progress.map(|it| it.cancel_s),
            operator_s: progress.map(|it| it.operator_s),
            plan_s: progress.map(|it| it.plan_s),
            intends: match progress.and_then(|it| it.goal) {
                Some(goal) => Some((goal.try_into()?, progress.map_or(0.0, |it| it.goal_speed_m_s))),
                None => None,
            },
        };
        if let Some((_, value)) = outlook.intends.filter(|(_, speed_m_s)| !(0.1..=200.0).contains(speed_m_s)) {
            let (field, expected) = ("progress.goal_speed_m_s", "0.1 to 200 m/s");
            return Err(InvalidMessage::OutOfRange { field, value: format!("{value:?}"), expected });
        }
        let values = [
            ("energy.home.margin", outlook.home_margin_percent),
            ("energy.best.margin", outlook.place_margin_percent),
            ("energy.consumption", outlook.consumption_percent),
            ("energy.endurance_s", outlook.endurance_s),
            ("energy.airspeed_left_m_s", outlook.airspeed_left_m_s),
            ("progress.path_deviation_m", outlook.path_deviation_m),
            ("progress.pace", outlook.pace_percent),
            ("progress.cancel_s", outlook.cancel_s),
            ("progress.operator_s", outlook.operator_s),
            ("progress.plan_s", outlook.plan_s),
        ];
        match values.into_iter().find_map(|(field, it)| Some((field, it.filter(|it| !it.is_finite())?))) {
            Some((field, value)) => {
                Err(InvalidMessage::OutOfRange { field, value: format!("{value:?}"), expected: "a finite number" })
            }
            None => Ok(outlook),
        }
    }
}

/// The outlook as it was heard last.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct HeardOutlook(Option<(Time, Outlook)>);

impl HeardOutlook {
    /// The mission manager has said how it stands.
    pub(crate) fn hear(&mut self, now: Time, outlook: Outlook) {
        self.0 = Some((now, outlook));
    }

    /// The last outlook; empty once the mission manager is silent.
    pub(crate) fn at(&self, now: Time, pace: Pace) -> Outlook {
        self.0.filter(|(at, _)| now - *at < pace.wall(SILENT)).map(|(_, it)| it).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(margin: f64) -> v1::McmStatus {
        let best = v1::PlaceOutlook { margin, ..Default::default() };
        let energy = v1::EnergyOutlook { best: Some(best), endurance_s: 60.0, ..Default::default() };
        v1::McmStatus { energy: Some(energy), ..Default::default() }
    }

    #[test]
    fn what_the_manager_said_counts_until_it_is_silent() {
        let mut heard = HeardOutlook::default();
        let at = |ms| Time::after(Duration::from_millis(ms));
        assert_eq!(heard.at(at(0), Pace::REAL_TIME), Outlook::default());
        heard.hear(at(0), Outlook::try_from(&status(0.12)).unwrap());
        let known = heard.at(at(2_900), Pace::REAL_TIME);
        assert_eq!(
            (known.place_margin_percent, known.endurance_s, known.home_margin_percent),
            (Some(12.0), Some(60.0), None)
        );
        assert_eq!(heard.at(at(3_000), Pace::REAL_TIME), Outlook::default());
    }

    #[test]
    fn a_value_that_is_no_number_is_refused_with_its_name() {
        let refused = Outlook::try_from(&status(f64::NAN)).unwrap_err().to_string();
        assert!(refused.contains("energy.best.margin"), "{refused}");
    }
}
