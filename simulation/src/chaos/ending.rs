//! How a flight ended, as it is seen from outside.

use std::fmt;

use kittiwake_proto::v1;

use crate::Simulation;

/// A vehicle that stands this near to a place has landed there: what wind and the estimate's error leave of an approach, and less than
/// two places of a mission are apart.
const AT_PLACE_M: f64 = 15.0;

/// How a flight ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Ending {
    /// The mission is over, and the vehicle stands on the ground.
    Over {
        /// As what it is reported.
        outcome: v1::MissionOutcome,
        /// As it is reported.
        reason: String,
        /// The listed place where the vehicle stands; `None` if it came down elsewhere.
        place: Option<String>,
    },
    /// On the ground, until something happens, for this reason.
    Waits(String),
    /// In the air, for this reason.
    Holds(String),
    /// None of these.
    Adrift {
        /// Whether it flies.
        flies: bool,
        /// What the mission manager says it does.
        phase: v1::MissionPhase,
    },
}

impl Ending {
    /// How it has ended by now.
    pub fn of(simulation: &Simulation<'_>) -> Ending {
        let (stands, reason) = (simulation.is_on_ground(), simulation.reason_to_stay());
        match simulation.report() {
            Some(report) if stands => Ending::Over {
                outcome: report.outcome(),
                reason: report.reason,
                place: simulation.position().and_then(|it| place(it, &simulation.places())),
            },
            None if stands && !reason.is_empty() => Ending::Waits(reason),
            None if !stands && !reason.is_empty() => Ending::Holds(reason),
            _ => Ending::Adrift { flies: !stands, phase: simulation.phase() },
        }
    }

    /// For counting: the same for flights that ended alike.
    pub fn kind(&self) -> &'static str {
        match self {
            Ending::Over { outcome: v1::MissionOutcome::Success, .. } => "mission done",
            Ending::Over { outcome: v1::MissionOutcome::Crash, .. } => "crashed",
            Ending::Over { place: Some(_), .. } => "landed at a listed place",
            Ending::Over { place: None, .. } => "came down elsewhere, with a reason",
            Ending::Waits(_) => "waits on the ground, with a reason",
            Ending::Holds(_) => "holds in the air, with a reason",
            Ending::Adrift { .. } => "did not end",
        }
    }
}

/// The listed place that is nearest, if the vehicle stands there.
fn place(stands: v1::Ned, places: &[(String, v1::Ned)]) -> Option<String> {
    let away_m = |place: &v1::Ned| (place.north_m - stands.north_m).hypot(place.east_m - stands.east_m);
    let near = places.iter().map(|(name, place)| (away_m(place), name)).filter(|(away_m, _)| *away_m < AT_PLACE_M);
    near.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, name)| name.clone())
}

impl fmt::Display for Ending {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Ending::Over { outcome, reason, place } => {
                let outcome = outcome.as_str_name().trim_start_matches("MISSION_OUTCOME_").to_lowercase();
                let place = place.as_ref().map_or("at no listed place".to_owned(), |it| format!("at `{it}`"));
                write!(f, "over: {outcome}, on the ground {place}: {reason}")
            }
            Ending::Waits(reason) => write!(f, "on the ground: {reason}"),
            Ending::Holds(reason) => write!(f, "in the air: {reason}"),
            Ending::Adrift { flies, phase } => {
                let place = if *flies { "in the air" } else { "on the ground" };
                write!(f, "{place} without a reason, mission {phase:?}")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vehicle_has_landed_at_the_nearest_place_that_is_near_enough() {
        let ned = |north_m, east_m| v1::Ned { north_m, east_m, down_m: 0.0 };
        let places = [("home".to_owned(), ned(0.0, 0.0)), ("quay".to_owned(), ned(0.0, 20.0))];
        let check = |north_m, east_m, expected: Option<&str>| {
            assert_eq!(place(ned(north_m, east_m), &places).as_deref(), expected, "{north_m}, {east_m}");
        };
        check(0.0, 0.0, Some("home"));
        check(5.0, 9.0, Some("home"));
        check(5.0, 11.0, Some("quay"));
        check(0.0, 34.0, Some("quay"));
        check(0.0, 35.5, None);
        check(20.0, 20.0, None);
    }

    #[test]
    fn an_ending_is_told_in_words() {
        let over = |outcome, place: Option<&str>| Ending::Over {
            outcome,
            reason: "`battery_low`: 24 %".into(),
            place: place.map(str::to_owned),
        };
        let done = over(v1::MissionOutcome::Success, Some("home"));
        assert_eq!(done.to_string(), "over: success, on the ground at `home`: `battery_low`: 24 %");
        assert_eq!(done.kind(), "mission done");
        let ditched = over(v1::MissionOutcome::Emergency, None);
        assert_eq!(ditched.to_string(), "over: emergency, on the ground at no listed place: `battery_low`: 24 %");
        assert_eq!(ditched.kind(), "came down elsewhere, with a reason");
        assert_eq!(Ending::Holds("response to `obstacle`".into()).to_string(), "in the air: response to `obstacle`");
    }
}
