//! Reads and checks the contingency file.

use serde::Deserialize;
use toml::Spanned;

use super::{Clears, Contingencies, Row, Rule, TRANSITION_FAILED, Then};
use crate::file::{Mistake, Mistakes, Source, did_you_mean};

impl Contingencies {
    /// Parses and checks a contingency file; `actions` are the names of the trees that exist.
    /// Every mistake that can be found is told at once.
    pub fn read(source: &Source, actions: &[&str]) -> Result<Contingencies, Mistakes> {
        let file: File = source.parse()?;
        let mut mistakes = Vec::new();
        for (index, entry) in file.contingency.iter().enumerate() {
            check_twins(source, entry, &file.contingency[..index], &mut mistakes);
            check_actions(source, entry, actions, &mut mistakes);
            check_rule(source, entry, &mut mistakes);
        }
        let mut entries = file.contingency;
        entries.sort_by_key(|it| *it.priority.as_ref());
        check_groups(source, &entries, &mut mistakes);
        if !entries.iter().any(|it| it.flag.as_ref() == TRANSITION_FAILED) {
            let message = format!("no row for the flag `{TRANSITION_FAILED}`, which the mission manager raises itself");
            mistakes.push(source.mistake(None, message, "add a [[contingency]] with this flag"));
        }
        Mistakes(mistakes).or(Contingencies { rows: entries.into_iter().map(Row::from).collect() })
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    contingency: Vec<Entry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    flag: Spanned<String>,
    priority: Spanned<u32>,
    group: Option<Spanned<String>>,
    raise: Option<Spanned<Rule>>,
    actions: Spanned<Vec<Spanned<String>>>,
    emergency: Spanned<String>,
    clears: Clears,
    then: Then,
}

impl From<Entry> for Row {
    fn from(it: Entry) -> Row {
        Row {
            flag: it.flag.into_inner(),
            priority: it.priority.into_inner(),
            group: it.group.map(Spanned::into_inner),
            raise: it.raise.map(Spanned::into_inner),
            actions: it.actions.into_inner().into_iter().map(Spanned::into_inner).collect(),
            emergency: it.emergency.into_inner(),
            clears: it.clears,
            then: it.then,
        }
    }
}

fn check_twins(source: &Source, entry: &Entry, earlier: &[Entry], mistakes: &mut Vec<Mistake>) {
    let flag = entry.flag.as_ref();
    if !flag.starts_with(|it: char| it.is_ascii_lowercase())
        || !flag.chars().all(|it| it.is_ascii_lowercase() || it.is_ascii_digit() || it == '_')
    {
        let help = "a flag is lower-case letters, digits and underscores";
        mistakes.push(source.mistake(Some(entry.flag.span()), format!("`{flag}` is no flag name"), help));
    }
    if earlier.iter().any(|it| it.flag.as_ref() == flag) {
        let message = format!("two rows for the flag `{flag}`");
        mistakes.push(source.mistake(Some(entry.flag.span()), message, "one flag has one row"));
    }
    if let Some(twin) = earlier.iter().find(|it| it.priority.as_ref() == entry.priority.as_ref()) {
        let message = format!("priority {} is already that of `{}`", entry.priority.as_ref(), twin.flag.as_ref());
        mistakes.push(source.mistake(
            Some(entry.priority.span()),
            message,
            "give each row its own; lower is more urgent",
        ));
    }
}

fn check_actions(source: &Source, entry: &Entry, known: &[&str], mistakes: &mut Vec<Mistake>) {
    for action in entry.actions.as_ref().iter().chain([&entry.emergency]) {
        if !known.contains(&action.as_ref().as_str()) {
            let message = format!("there is no action tree `{}`", action.as_ref());
            mistakes.push(source.mistake(Some(action.span()), message, did_you_mean(action.as_ref(), known)));
        }
    }
}

fn check_rule(source: &Source, entry: &Entry, mistakes: &mut Vec<Mistake>) {
    let Some(rule) = &entry.raise else { return };
    let (numbers, hysteresis) = match *rule.as_ref() {
        Rule::Below { threshold, clear, for_s, .. } => (vec![threshold, clear, for_s], threshold <= clear),
        Rule::Above { threshold, clear, for_s, .. } => (vec![threshold, clear, for_s], clear <= threshold),
        Rule::Reported { for_s, .. } => (vec![for_s], true),
        Rule::Stale { .. } => (vec![], true),
    };
    if numbers.iter().any(|it| !it.is_finite()) || numbers.last().is_some_and(|for_s| !(0.0..=3600.0).contains(for_s)) {
        let help = "thresholds are finite; `for_s` is seconds from 0 to 3600";
        mistakes.push(source.mistake(Some(rule.span()), "a number of this rule is out of range", help));
    }
    if !hysteresis {
        let help = "`clear` lies at the threshold or on its safe side";
        mistakes.push(source.mistake(Some(rule.span()), "this rule would clear while it still holds", help));
    }
}

/// Groups become one branch of the tree each, so their rows must follow each other in priority.
fn check_groups(source: &Source, by_priority: &[Entry], mistakes: &mut Vec<Mistake>) {
    let name = |it: &Entry| it.group.as_ref().map(|it| it.as_ref().clone());
    for (index, entry) in by_priority.iter().enumerate().skip(1) {
        let Some(group) = &entry.group else { continue };
        let interrupted = name(&by_priority[index - 1]) != name(entry)
            && by_priority[..index].iter().any(|it| name(it) == name(entry));
        if interrupted {
            let message = format!("group `{}` is interrupted by a row of another priority", group.as_ref());
            mistakes.push(source.mistake(Some(group.span()), message, "rows of a group follow each other in priority"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r#"
[[contingency]]
flag = "battery_low"
priority = 40
group = "energy"
raise = { fact = "below", value = "battery-remaining", threshold = 0.2, clear = 0.25, for_s = 1.0, during = "flying" }
actions = ["return_home"]
emergency = "land"
clears = "never"
then = "end-mission"

[[contingency]]
flag = "transition_failed"
priority = 90
actions = ["stop"]
emergency = "land"
clears = "after-action"
then = "resume"
"#;

    fn read(text: &str) -> Result<Contingencies, Mistakes> {
        let source = Source { path: "c.toml".into(), text: text.into() };
        Contingencies::read(&source, &["stop", "land", "return_home"])
    }

    #[test]
    fn rows_come_most_urgent_first() {
        let table = read(GOOD).unwrap();
        assert_eq!(
            table.rows().iter().map(|it| it.flag.as_str()).collect::<Vec<_>>(),
            ["battery_low", "transition_failed"]
        );
        assert!(table.row("battery_low").unwrap().raise.is_some());
    }

    #[test]
    fn every_mistake_is_told_with_its_place() {
        #[track_caller]
        fn check(find: &str, replace: &str, expected: &str) {
            assert!(GOOD.contains(find), "the test's own text lacks `{find}`");
            let error = read(&GOOD.replacen(find, replace, 1)).unwrap_err().to_string();
            assert!(error.starts_with(expected), "expected `{expected}`, got `{error}`");
        }
        check("priority = 40\n", "", "c.toml:2:1: missing field `priority`");
        check("priority = 40", "priority = 90", "c.toml:14:12: priority 90 is already that of `battery_low`");
        check("[\"return_home\"]", "[\"return_hom\"]", "c.toml:7:12: there is no action tree `return_hom`");
        check("clear = 0.25", "clear = 0.1", "c.toml:6:9: this rule would clear while it still holds");
        check("for_s = 1.0", "for_s = -1.0", "c.toml:6:9: a number of this rule is out of range");
        check("battery-remaining", "battery-left", "c.toml:6:9: unknown variant `battery-left`, expected one of");
        check("\"never\"", "\"sometimes\"", "c.toml:9:10: unknown variant `sometimes`");
        check("\"transition_failed\"", "\"battery_low\"", "c.toml:13:8: two rows for the flag `battery_low`");
        check("\"transition_failed\"", "\"trans\"", "c.toml: no row for the flag `transition_failed`");
        check("\"battery_low\"", "\"Battery Low\"", "c.toml:3:8: `Battery Low` is no flag name");
    }
}
