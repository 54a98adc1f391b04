//! What is wrong with a table although each of its rows can be read: rows that never respond, two that are alike, thresholds that
//! flap, responses that need what their own flag takes away.
//!
//! A pure function of the table. What a single row may not say is refused when the file is read (`domain::contingency`).

use std::time::Duration;

use domain::contingency::snapshot::Field;
use domain::contingency::when::During;
use domain::contingency::{Clears, Contingencies, Phase, Row, Severity};

/// Something wrong with a row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remark {
    /// The row's flag.
    pub flag: String,
    /// What was found.
    pub what: String,
    /// How to mend it.
    pub help: &'static str,
}

/// Everything that is wrong with the rows of a table, row by row.
pub fn review(table: &Contingencies) -> Vec<Remark> {
    let rows = table.rows();
    rows.iter().enumerate().flat_map(|(index, row)| of_row(rows, index, row)).collect()
}

fn of_row(rows: &[Row], index: usize, row: &Row) -> Vec<Remark> {
    let mut remarks = Vec::new();
    let mut remark = |what: String, help| remarks.push(Remark { flag: row.flag.clone(), what, help });
    if let Some(other) = rows[..index].iter().find(|it| are_alike(it, row)) {
        let what = format!("`{}` and `{}` are alike: raised by the same, answered by the same", row.flag, other.flag);
        remark(what, "keep one of them");
    } else if let Some(other) = rows.iter().find(|it| it.flag != row.flag && hides(it, row)) {
        let what = format!(
            "`{}` never responds: whenever its flag is up, so is `{}`, which comes before it in each of its phases",
            row.flag, other.flag
        );
        remark(what, "give the row that is raised later the more severe response, or the more urgent priority");
    }
    // A row that holds may be there to be shown, and for what it narrows.
    let is_shown_only = row.severity() == Severity::Hold;
    if row.when.as_ref().is_some_and(|it| it.during == During::Flying)
        && row.phases.iter().eq([&Phase::OnGround])
        && !is_shown_only
    {
        let what = format!("`{}` never responds: it is raised while flying, and counts on the ground alone", row.flag);
        remark(what, "change `during`, or name a phase in the air");
    }
    if let Some(need) = row.takes_away()
        && let Some(action) = row.actions.iter().find(|it| it.needs.contains(&need))
    {
        let what = format!("`{}` says that {need} is missing, and its action `{}` needs it", row.flag, action.tree);
        remark(what, "name an action that can be flown without");
    }
    if let Some(value) = unheld_threshold(row) {
        let what = format!("`{}` is raised by the first sample of {value} beyond its threshold", row.flag);
        remark(what, "set `for_s` to how long it must hold");
    }
    if row.severity() == Severity::Hold && row.clears == Clears::Never {
        let what =
            format!("`{}` holds, and its flag falls on the ground alone: the vehicle would hold for ever", row.flag);
        remark(what, "set `clears = \"with-condition\"` or `\"after-action\"`, or name a response that comes down");
    }
    remarks
}

/// Whether one is enough.
fn are_alike(a: &Row, b: &Row) -> bool {
    let same_trigger = match (trigger(a), trigger(b)) {
        (Some(of_a), Some(of_b)) => of_a == of_b,
        _ => a.is_watched() && a.when == b.when,
    };
    let trees = |row: &Row| row.actions.iter().map(|it| it.tree.clone()).collect::<Vec<_>>();
    same_trigger && trees(a) == trees(b) && !a.phases.is_disjoint(&b.phases)
}

/// Whether `row` never responds because of `other`.
fn hides(other: &Row, row: &Row) -> bool {
    let follows = matches!((trigger(row), trigger(other)), (Some(later), Some(earlier)) if later.implies(&earlier));
    let narrows_more = !row.narrows.is_subset(&other.narrows);
    let order = |it: &Row| it.order(it.severity());
    follows
        && !narrows_more
        && !row.only_slows()
        && !other.only_slows()
        && row.phases.is_subset(&other.phases)
        && order(row) < order(other)
}

/// What raises a row, where that can be compared with another row's.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Trigger {
    field: Field,
    above: bool,
    level: f64,
    hold: Duration,
    during: During,
}

impl Trigger {
    /// Whether `earlier` holds whenever this does.
    fn implies(&self, earlier: &Trigger) -> bool {
        let is_beyond = if self.above { earlier.level <= self.level } else { self.level <= earlier.level };
        let strictness = |it: During| match it {
            During::Always => 0,
            During::Armed => 1,
            During::Flying => 2,
        };
        self.field == earlier.field
            && self.above == earlier.above
            && is_beyond
            && earlier.hold <= self.hold
            && strictness(earlier.during) <= strictness(self.during)
    }
}

fn trigger(row: &Row) -> Option<Trigger> {
    let when = row.when.as_ref()?;
    let threshold = when.raises.threshold()?;
    let (field, above, level) = (threshold.field, threshold.above, threshold.value);
    Some(Trigger { field, above, level, hold: when.hold, during: when.during })
}

/// What a row without a hold measures, unless that lasts by itself.
fn unheld_threshold(row: &Row) -> Option<&'static str> {
    let when = row.when.as_ref().filter(|it| it.hold.is_zero())?;
    when.raises.thresholds().into_iter().map(|it| it.field).find(|it| !it.lasts()).map(Field::name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use domain::file::Source;
    use std::path::Path;

    fn shipped() -> String {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/contingencies.toml");
        std::fs::read_to_string(path).unwrap()
    }

    fn read(text: String) -> Contingencies {
        let trees = mcm::Trees::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/trees")).unwrap();
        let source = Source { path: "c.toml".into(), text };
        Contingencies::read(&source, &trees.actions()).unwrap_or_else(|mistakes| panic!("{mistakes}"))
    }

    #[test]
    fn there_is_nothing_against_the_shipped_table() {
        assert_eq!(review(&read(shipped())), []);
    }

    /// A row after those of the shipped table, and what is said about it.
    #[track_caller]
    fn check(row: &str, flag: &str, expected: &str) {
        let remarks = review(&read(format!("{}\n[[contingency]]\n{row}", shipped())));
        let found = remarks.iter().find(|it| it.flag == flag && it.what.contains(expected));
        assert!(found.is_some(), "{expected}: {remarks:#?}");
    }

    const RETURNS: &str =
        "actions = [\"return_home\"]\nemergency = \"land\"\nclears = \"never\"\nthen = \"end-mission\"\n";
    const HOLDS: &str = "actions = [\"stop\"]\nemergency = \"stop\"\nclears = \"with-condition\"\nthen = \"resume\"\n";

    #[test]
    fn a_row_that_never_responds_is_found_with_the_row_that_hides_it() {
        let lower = "when = \"battery.charge_percent < 20 %\"\nfor_s = 2.0\nduring = \"flying\"";
        check(
            &format!("flag = \"lower\"\npriority = 200\n{lower}\nphases = [\"cruise\"]\n{RETURNS}"),
            "lower",
            "`lower` never responds: whenever its flag is up, so is `battery_low`",
        );
        let percent = "when = \"battery.charge_percent < 4 %\"\nfor_s = 2.0\nduring = \"flying\"";
        check(
            &format!("flag = \"percent\"\npriority = 201\n{percent}\nphases = [\"cruise\"]\n{RETURNS}"),
            "percent",
            "`percent` never responds",
        );
        let flying = "when = \"wind.speed_m_s > 3 m/s\"\nfor_s = 2.0\nduring = \"flying\"\nphases = [\"on-ground\"]";
        check(
            &format!("flag = \"grounded\"\npriority = 202\n{flying}\n{RETURNS}"),
            "grounded",
            "it is raised while flying, and counts on the ground alone",
        );
    }

    #[test]
    fn rows_that_are_alike_flap_or_need_what_is_gone_are_found() {
        let twin = "when = \"battery.silent_s >= 2 s\"\nphases = [\"cruise\"]";
        let holds = HOLDS.replace("[\"stop\"]", "[\"stop\", \"hold_position\"]");
        check(
            &format!("flag = \"twin\"\npriority = 203\n{twin}\n{holds}"),
            "twin",
            "`twin` and `battery_stale` are alike",
        );
        let sample = "when = \"wind.speed_m_s > 3 m/s\"\nphases = [\"cruise\"]";
        check(
            &format!("flag = \"gust\"\npriority = 204\n{sample}\n{HOLDS}"),
            "gust",
            "by the first sample of wind.speed_m_s",
        );
        let blind = "when = \"position.silent_s >= 9 s\"";
        let needs = HOLDS.replace("[\"stop\"]", "[\"hold_position\"]");
        check(
            &format!("flag = \"blind\"\npriority = 3\n{blind}\n{needs}"),
            "blind",
            "says that a position is missing, and its action `hold_position` needs it",
        );
        let never = HOLDS.replace("with-condition", "never");
        check(&format!("flag = \"ever\"\npriority = 205\n{never}"), "ever", "the vehicle would hold for ever");
    }
}
