//! What is wrong with a table although each of its rows can be read: two rows that are alike, thresholds that flap, responses that need
//! what their own flag takes away, rows that never rise or never respond (`rises`), hazards without an answer ([`hazards`]).
//!
//! A pure function of the table. What a single row may not say is refused when the file is read (`domain::contingency`).

use domain::contingency::snapshot::{Field, Kind};
use domain::contingency::when::During;
use domain::contingency::{Clears, Contingencies, Phase, Row, Severity};

use super::{hazards, rises};

/// Something wrong with a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remark {
    /// Where.
    pub place: Place,
    /// What was found.
    pub what: String,
    /// How to mend it.
    pub help: &'static str,
}

/// Where in a table.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// The row of this flag.
    Row(String),
    /// The waiver of this hazard.
    Waiver(&'static str),
    /// Nothing that is there: something is missing.
    Table,
}

/// Everything that is wrong with a table: row by row, then hazard by hazard.
pub fn review(table: &Contingencies) -> Vec<Remark> {
    let rows = table.rows();
    let mut remarks: Vec<Remark> =
        rows.iter().enumerate().flat_map(|(index, row)| of_row(&rows[..index], row)).collect();
    // One that is as another one never responds, which is said already.
    let more = rises::of_all(table).into_iter().filter(|it| remarks.iter().all(|known| known.place != it.place));
    let more: Vec<Remark> = more.chain(hazards::unanswered(table)).collect();
    remarks.extend(more);
    remarks
}

fn of_row(earlier: &[Row], row: &Row) -> Vec<Remark> {
    let mut remarks = Vec::new();
    let mut remark = |what: String, help| remarks.push(Remark { place: Place::Row(row.flag.clone()), what, help });
    if let Some(other) = earlier.iter().find(|it| are_alike(it, row)) {
        let what = format!("`{}` and `{}` are alike: raised by the same, answered by the same", row.flag, other.flag);
        remark(what, "keep one of them");
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
    let trees = |row: &Row| row.actions.iter().map(|it| it.tree.clone()).collect::<Vec<_>>();
    a.is_watched() && a.when == b.when && trees(a) == trees(b) && !a.phases.is_disjoint(&b.phases)
}

/// What a row without a hold measures, unless that lasts by itself.
fn unheld_threshold(row: &Row) -> Option<&'static str> {
    let when = row.when.as_ref().filter(|it| it.hold.is_zero())?;
    let is_measured = |it: &Field| matches!(it.kind(), Kind::Number { .. }) && !it.lasts();
    when.fields().iter().copied().find(is_measured).map(Field::name)
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
        let found = remarks.iter().find(|it| it.place == Place::Row(flag.to_owned()) && it.what.contains(expected));
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
