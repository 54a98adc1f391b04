//! The table as humans read it: a line for each row, most urgent first.

use std::fmt::Write as _;

use super::when::{During, When};
use super::{Contingencies, Phase, Row, Severity};

/// What each column of [`cells`] says.
pub const HEADINGS: [&str; 10] =
    ["flag", "group", "label", "alarm", "raised by", "counts", "response", "narrows", "falls", "source of the numbers"];

/// A row, column by column.
pub fn cells(row: &Row) -> [String; 10] {
    [
        format!("`{}`", row.flag),
        row.group.map_or_else(String::new, |it| it.to_string()),
        row.label.to_string(),
        alarm(row),
        raised_by(row),
        counts(row),
        row.response(),
        row.narrows.iter().map(|it| it.name()).collect::<Vec<_>>().join(", "),
        falls(row),
        row.source.clone().unwrap_or_default(),
    ]
}

/// The whole table in Markdown.
pub fn markdown(table: &Contingencies) -> String {
    let rows: Vec<Vec<String>> = table.rows().iter().map(|row| cells(row).to_vec()).collect();
    markdown_of(&HEADINGS, &rows)
}

/// How severe responses are, the least first, and why each stands above the one before it, in Markdown.
pub fn lattice_markdown() -> String {
    let line = |it: Severity| {
        let why = it.why_above_the_one_before().unwrap_or("nothing stands below it");
        vec![it.name().to_owned(), it.in_words().to_owned(), why.to_owned()]
    };
    markdown_of(&["severity", "the vehicle", "above the one before it because"], &Severity::ALL.map(line))
}

/// Any table in Markdown.
pub fn markdown_of(headings: &[&str], rows: &[Vec<String>]) -> String {
    let mut text = format!("| {} |\n|{}\n", headings.join(" | "), "---|".repeat(headings.len()));
    for row in rows {
        // A bar would begin another column.
        let cells: Vec<String> = row.iter().map(|cell| cell.replace('|', "\\|").replace('\n', " ")).collect();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "| {} |", cells.join(" | "));
    }
    text
}

/// Its class, and the flags beside which it is not an alarm.
fn alarm(row: &Row) -> String {
    if row.explained_by.is_empty() {
        return row.alarm.to_string();
    }
    let others: Vec<String> = row.explained_by.iter().map(|it| format!("`{it}`")).collect();
    format!("{}, not beside {}", row.alarm, others.join(", "))
}

fn raised_by(row: &Row) -> String {
    row.when.as_ref().map_or_else(|| "the mission manager, an operator, or by hand".to_owned(), of_when)
}

fn of_when(when: &When) -> String {
    format!("`{}`{}{}", when.raises.text(), lasting(when.hold.as_secs_f64()), situation(when.during))
}

fn lasting(seconds: f64) -> String {
    if seconds > 0.0 { format!(" for {seconds} s") } else { String::new() }
}

fn situation(during: During) -> &'static str {
    match during {
        During::Always => "",
        During::Armed => ", while armed",
        During::Flying => ", while flying",
    }
}

fn counts(row: &Row) -> String {
    let words = |it: &mut dyn Iterator<Item = String>| it.collect::<Vec<_>>().join(", ");
    let phases = match row.phases.len() == Phase::ALL.len() {
        true => "always".to_owned(),
        false => words(&mut row.phases.iter().map(ToString::to_string)),
    };
    if row.situations == Row::usual_situations(row.severity(), row.then) {
        return phases;
    }
    format!("{phases}; {}", words(&mut row.situations.iter().map(ToString::to_string)))
}

fn falls(row: &Row) -> String {
    let condition = match row.when.as_ref().and_then(|it| it.clears.as_ref()) {
        Some(clears) => format!("by `{}`", clears.text()),
        None => "with its condition".to_owned(),
    };
    match row.clears {
        super::Clears::AfterAction => "after its response".to_owned(),
        super::Clears::WithCondition => condition,
        super::Clears::Never => "on the ground".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::Source;
    use crate::testing::{ACTIONS, table};

    #[test]
    fn each_row_is_a_line() {
        let text = table(
            "[[contingency]]\nflag = \"wind\"\npriority = 1\ngroup = \"weather\"\nnarrows = [\"slow\", \"no-new-area\"]\nwhen = \"wind.speed_m_s > 12 m/s\"\nfor_s = 5.0\n\
             clear_when = \"wind.speed_m_s < 10 m/s\"\nduring = \"flying\"\nphases = [\"cruise\", \"landing\"]\n\
             actions = [\"stop\"]\nemergency = \"stop\"\nclears = \"with-condition\"\nthen = \"resume\"\nsource = \"A|B\"\n",
        );
        let table = Contingencies::read(&Source { path: "c.toml".into(), text }, &ACTIONS).unwrap();
        let written = markdown(&table);
        let lines: Vec<&str> = written.lines().collect();
        assert_eq!(lines.len(), 2 + table.rows().len());
        assert_eq!(
            lines[0],
            "| flag | group | label | alarm | raised by | counts | response | narrows | falls | source of the numbers |"
        );
        assert_eq!(lines[1], "|---|---|---|---|---|---|---|---|---|---|");
        assert_eq!(
            lines[2],
            "| `wind` | weather | safety | caution | `wind.speed_m_s > 12 m/s` for 5 s, while flying | on the way, while landing | stop | \
             no-new-area, slow | by `wind.speed_m_s < 10 m/s` | A\\|B |"
        );
        assert_eq!(lattice_markdown().lines().count(), 2 + Severity::ALL.len());
        assert!(written.contains("`planner.silent_s >= 3600 s`, while flying"), "{written}");
    }
}
