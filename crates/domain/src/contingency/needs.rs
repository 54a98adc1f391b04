//! What an action cannot be flown without, and which flags say that it is missing.

use serde::Deserialize;

use super::snapshot::Field;
use super::{Action, Row};

/// What an action cannot be flown without.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Need {
    /// That it is known where the vehicle is.
    Position,
    /// The planner.
    Planner,
    /// The link to the ground.
    Link,
}

/// `a position`, as in "needs a position".
impl std::fmt::Display for Need {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Need::Position => "a position",
            Need::Planner => "the planner",
            Need::Link => "the link to the ground",
        })
    }
}

impl Row {
    /// What is missing while its flag is up, by what raises it. (A silent monitor takes nothing away: the skill manager hears the vehicle
    /// itself.)
    pub fn takes_away(&self) -> Option<Need> {
        if self.flag == super::FRAME_MOVED {
            // It is known in another frame than that of the mission.
            return Some(Need::Position);
        }
        self.when.as_ref()?.fields().iter().find_map(|it| it.says_missing())
    }

    /// Whether it says that the position may be another one than it says.
    pub fn doubts_position(&self) -> bool {
        let doubts = |it: &Field| match it {
            Field::HorizontalDeviation | Field::PositionJump => true,
            it => it.says_missing() == Some(Need::Position),
        };
        self.when.as_ref().is_some_and(|it| it.fields().iter().any(doubts))
    }

    /// Whether it says that a wait was long enough: its response does not wait again.
    pub fn ends_a_wait(&self) -> bool {
        self.when.as_ref().is_some_and(|it| it.fields().contains(&Field::OperatorWait))
    }
}

impl Field {
    /// What is missing while it raises a flag.
    fn says_missing(self) -> Option<Need> {
        match self {
            Field::EstimatorInvalid | Field::PositionSilence => Some(Need::Position),
            Field::PlannerSilence => Some(Need::Planner),
            Field::LinkSilence => Some(Need::Link),
            _ => None,
        }
    }
}

/// The first need of `action` that is missing while the flags of the rows `up` are, and the row whose flag says so; `None`: it can be
/// tried.
pub fn missing(action: &Action, rows: &[Row], up: impl Iterator<Item = usize> + Clone) -> Option<(Need, usize)> {
    action.needs.iter().find_map(|need| {
        let row = up.clone().find(|row| rows.get(*row).is_some_and(|it| it.takes_away() == Some(*need)))?;
        Some((*need, row))
    })
}

#[cfg(test)]
mod tests {
    use super::super::Contingencies;
    use super::*;
    use crate::file::Source;
    use crate::testing::{ACTIONS, table};

    #[test]
    fn an_action_is_impossible_while_a_flag_takes_away_what_it_needs() {
        let row = |flag: &str, priority: u32, when: &str| {
            format!(
                "[[contingency]]\nflag = \"{flag}\"\npriority = {priority}\nwhen = \"{when}\"\n\
                 actions = [\"stop\"]\nemergency = \"stop\"\nclears = \"with-condition\"\nthen = \"resume\"\n"
            )
        };
        let text = table(
            &[
                row("estimator_lost", 1, "known(estimator.invalid) and estimator.invalid"),
                row("position_stale", 2, "position.silent_s >= 0.5 s"),
                row("planner_lost", 3, "planner.silent_s >= 1 s"),
                row("link_lost", 4, "known(link.silent_s) and link.silent_s >= 10 s"),
                row("battery_stale", 5, "battery.silent_s >= 2 s"),
            ]
            .concat(),
        );
        let table = Contingencies::read(&Source { path: "c.toml".into(), text }, &ACTIONS).unwrap();
        #[track_caller]
        fn check(table: &Contingencies, needs: &[Need], up: &[&str], expected: Option<(Need, &str)>) {
            let rows = table.rows();
            let action = Action { needs: needs.iter().copied().collect(), ..rows[0].actions[0].clone() };
            let up: Vec<usize> = up.iter().map(|flag| rows.iter().position(|it| it.flag == *flag).unwrap()).collect();
            let found = missing(&action, rows, up.into_iter()).map(|(need, row)| (need, rows[row].flag.as_str()));
            assert_eq!(found, expected, "{needs:?}");
        }
        let all =
            ["estimator_lost", "position_stale", "planner_lost", "link_lost", "battery_stale", "introspection_lost"];
        check(&table, &[], &all, None);
        check(&table, &[Need::Position], &[], None);
        check(&table, &[Need::Position], &all, Some((Need::Position, "estimator_lost")));
        check(&table, &[Need::Position], &["position_stale"], Some((Need::Position, "position_stale")));
        check(&table, &[Need::Position], &["introspection_lost"], None);
        check(&table, &[Need::Position], &["planner_lost", "link_lost", "battery_stale"], None);
        check(&table, &[Need::Planner, Need::Link], &["link_lost"], Some((Need::Link, "link_lost")));
        check(&table, &[Need::Planner, Need::Link], &["planner_lost"], Some((Need::Planner, "planner_lost")));
    }
}
