//! Which actions of a response can be flown now, and on.

use std::sync::Arc;
use std::time::Duration;

use domain::contingency::Severity;
use domain::contingency::needs::{Need, missing};

use super::World;
use crate::flags::age_s;

impl World {
    /// Why this action of the response that is under way cannot be flown now: something is missing that it needs, or a flag forbids it.
    /// The one rule for every action; the last one of a response is tried whatever is missing.
    pub(crate) fn why_impossible(&self, action: usize) -> Option<String> {
        let rows = self.setup.table.rows();
        let actions = &rows[self.response_row()?].actions;
        let wanted = actions.get(action).filter(|_| action + 1 < actions.len())?;
        if let Some((need, row)) = missing(wanted, rows, self.flags.rows_up()) {
            return Some(format!("it needs {need}, and `{}` is up", self.flags.name(row)));
        }
        if let Some(why) = self.why_blown_away().filter(|_| wanted.needs.contains(&Need::Position)) {
            return Some(why);
        }
        let here = self.seen.vehicle.filter(|_| wanted.severity == Severity::Land)?.position;
        Some(format!("no landing here while `{}` is up", self.landing_forbidden_by(here)?))
    }

    /// The same of the action that is flown: what it needs has been missing for longer than a process or a link takes to come back.
    pub(crate) fn why_no_longer_possible(&self) -> Option<String> {
        /// Longer than the death of a process, and than a link that stutters. (ENG: 3 s until one that hangs is killed.)
        const PATIENCE: Duration = Duration::from_secs(5);
        // The last one is flown whatever is missing.
        let [flown, _, ..] = self.actions_left() else { return None };
        if let Some(why) = self.why_blown_away().filter(|_| flown.needs.contains(&Need::Position)) {
            return Some(why);
        }
        let (need, row) = missing(flown, self.setup.table.rows(), self.flags.rows_up())?;
        let name = self.flags.name(row);
        let age_s = age_s(self.flags.get(name)?, self.now.time);
        (PATIENCE.as_secs_f64() <= age_s).then(|| format!("it needs {need}, and `{name}` has been up for {age_s:.0} s"))
    }

    /// The flag because of which it is not known where the vehicle is, if one is up.
    pub(crate) fn position_is_missing(&self) -> Option<&Arc<str>> {
        let rows = self.setup.table.rows();
        let row = self.flags.rows_up().find(|row| rows[*row].takes_away() == Some(Need::Position))?;
        Some(self.flags.name(row))
    }
}
