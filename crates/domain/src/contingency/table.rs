//! Reads and checks the contingency file.

use std::collections::{BTreeMap, BTreeSet};

use serde::Deserialize;
use toml::Spanned;

use super::alarm::Alarm;
use super::group::Group;
use super::label::Label;
use super::narrowing::Narrows;
use super::needs::Need;
use super::when::During;
use super::{Action, BRING_DOWN, Clears, Contingencies, Phase, REQUIRED, REQUIRED_FIELDS, Row, Severity, Then};
use crate::file::{Mistake, Mistakes, Source, did_you_mean};
use crate::situation::Situation;

mod ending;
mod explained;
mod former;
mod label;
mod narrowing;
mod waiver;
mod when;

use ending::{check_brings_down, check_end, check_yields};
use explained::check_explained;
use label::check_comfort;
use narrowing::{check_narrows, check_slowing};

impl Contingencies {
    /// Parses and checks a contingency file; `trees` are the names of the action trees that exist.
    /// Every mistake that can be found is reported at once.
    pub fn read(source: &Source, trees: &[&str]) -> Result<Contingencies, Mistakes> {
        let File { action: actions, contingency: mut entries, waiver } = source.parse()?;
        let mut mistakes = Vec::new();
        let waivers = waiver::read(source, waiver, &mut mistakes);
        // An action that slows is not a tree: its limit holds beside whatever is flown. One that yields flies nothing.
        let is_tree = |it: &ActionEntry| !matches!(it.severity, Severity::Slow | Severity::Yield);
        for (name, _) in actions.iter().filter(|(_, it)| is_tree(it)) {
            check_tree(source, name, trees, &mut mistakes);
        }
        for (name, action) in &actions {
            mistakes.extend(former::durations(source, name.as_ref(), action));
        }
        for (index, entry) in entries.iter().enumerate() {
            check_twins(source, entry, &entries[..index], &mut mistakes);
            check_actions(source, entry, &actions, &mut mistakes);
            check_end(source, entry, &actions, &mut mistakes);
            check_yields(source, entry, &actions, &mut mistakes);
            check_slowing(source, entry, &actions, &mut mistakes);
            check_narrows(source, entry, &mut mistakes);
            check_comfort(source, entry, &actions, &mut mistakes);
            check_source(source, entry, &mut mistakes);
        }
        check_explained(source, &entries, &mut mistakes);
        entries.sort_by_key(|it| *it.priority.as_ref());
        for required in REQUIRED {
            if !entries.iter().any(|it| it.flag.as_ref() == required) {
                let message = format!("no row for the flag `{required}`, which the mission manager raises itself");
                mistakes.push(source.mistake(None, message, "add a [[contingency]] with this flag"));
            }
        }
        for entry in entries.iter().filter(|it| BRING_DOWN.contains(&it.flag.as_ref().as_str())) {
            check_brings_down(source, entry, &actions, &mut mistakes);
        }
        let row = |entry: Entry| {
            let when = when::read(source, &entry, &mut mistakes);
            Row { when, ..entry.into_row(&actions) }
        };
        let rows: Vec<Row> = entries.into_iter().map(row).collect();
        // A row with a mistake may be the one.
        let all_were_read = mistakes.is_empty();
        for field in REQUIRED_FIELDS {
            let reads = |row: &Row| row.when.as_ref().is_some_and(|it| it.fields().contains(&field));
            if all_were_read && !rows.iter().any(reads) {
                let message = format!("no row reads `{}`, which must be watched", field.name());
                mistakes.push(source.mistake(None, message, "add a [[contingency]] whose `when` reads it"));
            }
        }
        Mistakes(mistakes).or(Contingencies { rows, waivers })
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    action: BTreeMap<Spanned<String>, ActionEntry>,
    #[serde(default)]
    contingency: Vec<Entry>,
    #[serde(default)]
    waiver: Vec<waiver::Entry>,
}

/// The part of an action that is the same in every row.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ActionEntry {
    severity: Severity,
    tries: std::num::NonZeroU32,
    /// Keys of the former form: the time after which a try failed, and for how long one waited for a way.
    limit_s: Option<Spanned<toml::Value>>,
    wait_s: Option<Spanned<toml::Value>>,
    /// What it cannot be flown without.
    #[serde(default)]
    needs: BTreeSet<Need>,
}

type Actions = BTreeMap<Spanned<String>, ActionEntry>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    flag: Spanned<String>,
    priority: Spanned<u32>,
    group: Option<Group>,
    /// The former form of the next five keys.
    raise: Option<Spanned<toml::Table>>,
    /// An expression; the next four keys belong to it.
    when: Option<Spanned<String>>,
    clear_when: Option<Spanned<String>>,
    for_s: Option<Spanned<f64>>,
    clears_after_s: Option<Spanned<f64>>,
    during: Option<Spanned<During>>,
    phases: Option<Spanned<BTreeSet<Phase>>>,
    situations: Option<Spanned<BTreeSet<Situation>>>,
    actions: Spanned<Vec<Spanned<String>>>,
    emergency: Spanned<String>,
    /// What is forbidden while its flag is up.
    narrows: Option<Spanned<Vec<Spanned<Narrows>>>>,
    clears: Clears,
    then: Then,
    /// Without the key: see [`Label::usual`].
    label: Option<Spanned<Label>>,
    /// Without the key: a warning where the response is more than a hold, else a caution.
    alarm: Option<Alarm>,
    /// Flags of the same cause: while one of them is up, this one calls for nobody.
    explained_by: Option<Spanned<Vec<Spanned<String>>>>,
    source: Option<Spanned<String>>,
}

impl Entry {
    fn chain(&self) -> impl Iterator<Item = &Spanned<String>> {
        self.actions.as_ref().iter().chain([&self.emergency])
    }

    fn alarm(&self, severity: Severity) -> Alarm {
        self.alarm.unwrap_or(if severity == Severity::Hold { Alarm::Caution } else { Alarm::Warning })
    }

    fn label(&self, severity: Severity) -> Label {
        self.label.as_ref().map_or_else(|| Label::usual(severity, self.alarm(severity)), |it| *it.as_ref())
    }

    /// Without its expression. Actions that do not exist are left out; they have been reported as mistakes.
    fn into_row(self, actions: &Actions) -> Row {
        let action = |name: &Spanned<String>| {
            let entry = find(actions, name.as_ref())?;
            Some(Action {
                tree: name.as_ref().clone(),
                severity: entry.severity,
                tries: entry.tries.get(),
                needs: entry.needs.clone(),
            })
        };
        let mut actions: Vec<Action> = self.chain().filter_map(action).collect();
        // After the last action the response starts with the first again: naming one twice in a row only doubles its
        // tries.
        actions.dedup_by(|a, b| a.tree == b.tree);
        let severity = actions.first().map_or(Severity::Hold, |it| it.severity);
        let (alarm, label) = (self.alarm(severity), self.label(severity));
        let usual_situations = || Row::usual_situations(severity, self.then);
        Row {
            actions,
            flag: self.flag.into_inner(),
            priority: self.priority.into_inner(),
            group: self.group,
            when: None,
            phases: self.phases.map_or_else(|| Phase::ALL.into_iter().collect(), Spanned::into_inner),
            situations: self.situations.map_or_else(usual_situations, Spanned::into_inner),
            narrows: self.narrows.into_iter().flat_map(Spanned::into_inner).map(Spanned::into_inner).collect(),
            clears: self.clears,
            then: self.then,
            label,
            alarm,
            explained_by: self
                .explained_by
                .into_iter()
                .flat_map(Spanned::into_inner)
                .map(Spanned::into_inner)
                .collect(),
            source: self.source.map(Spanned::into_inner),
        }
    }
}

fn find<'a>(actions: &'a Actions, name: &str) -> Option<&'a ActionEntry> {
    actions.iter().find(|(key, _)| key.as_ref() == name).map(|(_, entry)| entry)
}

fn check_tree(source: &Source, name: &Spanned<String>, trees: &[&str], mistakes: &mut Vec<Mistake>) {
    if !trees.contains(&name.as_ref().as_str()) {
        let message = format!("there is no action tree `{}`", name.as_ref());
        mistakes.push(source.mistake(Some(name.span()), message, did_you_mean(name.as_ref(), trees)));
    }
}

fn check_twins(source: &Source, entry: &Entry, earlier: &[Entry], mistakes: &mut Vec<Mistake>) {
    let flag = entry.flag.as_ref();
    if !flag.starts_with(|it: char| it.is_ascii_lowercase())
        || !flag.chars().all(|it| it.is_ascii_lowercase() || it.is_ascii_digit() || it == '_')
    {
        let help = "a flag is lower-case letters, digits and underscores";
        mistakes.push(source.mistake(Some(entry.flag.span()), format!("`{flag}` is not a flag name"), help));
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

fn check_actions(source: &Source, entry: &Entry, actions: &Actions, mistakes: &mut Vec<Mistake>) {
    let known: Vec<&str> = actions.keys().map(|it| it.as_ref().as_str()).collect();
    for name in entry.chain() {
        if find(actions, name.as_ref()).is_none() {
            let message = format!("there is no action `{}`", name.as_ref());
            let help = did_you_mean(name.as_ref(), &known);
            mistakes.push(source.mistake(Some(name.span()), message, help));
        }
    }
    let empty = |is_empty: bool, span| Some(span).filter(|_| is_empty);
    let phases = entry.phases.as_ref().and_then(|it| empty(it.as_ref().is_empty(), it.span()));
    let situations = entry.situations.as_ref().and_then(|it| empty(it.as_ref().is_empty(), it.span()));
    for (place, help) in [
        (phases, "name at least one phase, or leave the key out for all of them"),
        (situations, "name at least one situation, or leave the key out for the usual ones"),
    ] {
        if place.is_some() {
            mistakes.push(source.mistake(place, "this row never counts", help));
        }
    }
    let severity = |name: &Spanned<String>| find(actions, name.as_ref()).map(|it| it.severity);
    let holds = entry.actions.as_ref().first().and_then(severity) == Some(Severity::Hold);
    let Some(more) = entry.chain().find(|it| severity(it).is_some_and(|it| Severity::Hold < it)).filter(|_| holds)
    else {
        return;
    };
    let message = format!("`{}` holds, and its action `{}` is more severe", entry.flag.as_ref(), more.as_ref());
    let help = "a row that holds ends in holding; give what calls for more a row of its own";
    mistakes.push(source.mistake(Some(more.span()), message, help));
}

fn check_source(source: &Source, entry: &Entry, mistakes: &mut Vec<Mistake>) {
    if let Some(text) = entry.source.as_ref().filter(|it| it.as_ref().trim().is_empty()) {
        let help = "name the document or the reason that the numbers come from, or leave the key out";
        mistakes.push(source.mistake(Some(text.span()), "this source says nothing", help));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{ACTIONS, check_mistake, table};

    /// Two rows, and those that every table needs.
    fn good() -> String {
        table(
            r#"
[[contingency]]
flag = "battery_low"
priority = 40
group = "energy"
when = "battery.charge_percent < 20 %"
phases = ["takeoff", "cruise"]
actions = ["return_home"]
emergency = "land"
clears = "never"
then = "end-mission"

[[contingency]]
flag = "obstacle"
priority = 90
actions = ["stop"]
emergency = "stop"
clears = "after-action"
then = "resume"
"#,
        )
    }

    fn read(text: &str) -> Result<Contingencies, Mistakes> {
        Contingencies::read(&Source { path: "c.toml".into(), text: text.into() }, &ACTIONS)
    }

    #[test]
    fn rows_come_most_urgent_first_with_their_whole_chain() {
        let table = read(&good()).unwrap();
        assert_eq!(
            table.rows().iter().take(2).map(|it| it.flag.as_str()).collect::<Vec<_>>(),
            ["battery_low", "obstacle"]
        );
        let row = table.row("battery_low").unwrap();
        assert_eq!((row.response().as_str(), row.severity()), ("return_home, else land", Severity::Return));
        assert_eq!(row.phases, BTreeSet::from([Phase::Takeoff, Phase::Cruise]));
        assert_eq!(table.row("obstacle").unwrap().phases.len(), Phase::ALL.len());
    }

    #[test]
    fn the_charge_below_which_it_lands_where_it_is_is_that_of_the_rows() {
        #[track_caller]
        fn check(find: &str, replace: &str, expected: f64) {
            assert_eq!(read(&good().replacen(find, replace, 1)).unwrap().lands_below().get(), expected);
        }
        // Nothing but a return.
        check("< 20 %", "< 20 %", 0.0);
        check("[\"return_home\"]", "[\"land\"]", 0.2);
        check("battery.charge_percent < 20 %", "battery.voltage_v < 13 V", 0.0);
    }

    #[test]
    fn every_mistake_is_reported_with_its_place() {
        #[track_caller]
        fn check(find: &str, replace: &str, expected: &str) {
            check_mistake(&good(), find, replace, read, expected);
        }
        check("priority = 40\n", "", "c.toml:14:1: missing field `priority`");
        check("\"energy\"", "\"enrgy\"", "c.toml:17:9: unknown variant `enrgy`, expected one of `energy`, `link`");
        check("priority = 40", "priority = 90", "c.toml:27:12: priority 90 is already that of `battery_low`");
        check("[\"return_home\"]", "[\"return_hom\"]", "c.toml:20:12: there is no action `return_hom`");
        check("[action.land]", "[action.lan]", "c.toml:9:9: there is no action tree `lan`");
        check(
            "tries = 2",
            "tries = 2\nlimit_s = 60.0",
            "c.toml:4:11: `limit_s` of action `stop`: a try has no time limit",
        );
        check("tries = 2", "tries = 2\nwait_s = 180", "c.toml:4:10: `wait_s` of action `stop`: no time limits a wait");
        check("tries = 2", "tries = 0", "c.toml:3:9: invalid value: integer `0`, expected a whole number above 0");
        check("[\"takeoff\", \"cruise\"]", "[]", "c.toml:19:10: this row never counts");
        check("\"cruise\"]", "\"cruising\"]", "c.toml:19:22: unknown variant `cruising`");
        check(
            "emergency = \"stop\"",
            "emergency = \"land\"",
            "c.toml:29:13: `obstacle` holds, and its action `land` is more severe",
        );
        check("\"never\"", "\"sometimes\"", "c.toml:22:10: unknown variant `sometimes`");
        check("\"obstacle\"", "\"battery_low\"", "c.toml:26:8: two rows for the flag `battery_low`");
        check("\"transition_failed\"", "\"trans\"", "c.toml: no row for the flag `transition_failed`");
        check("planner.silent_s", "battery.silent_s", "c.toml: no row reads `planner.silent_s`, which must be watched");
        check("\"ended_in_air\"", "\"ended\"", "c.toml: no row for the flag `ended_in_air`");
        let ended = |change: &str| format!("flag = \"ended_in_air\"\n{change}");
        check(
            &ended(""),
            &ended("phases = [\"cruise\"]\n"),
            "c.toml:62:10: `ended_in_air` must count everywhere in the air",
        );
        check("label = \"binding\"", "label = \"safety\"", "c.toml:82:8: `somebody_else_flies` must command nothing");
        check(
            "actions = [\"stop\"]\nemergency = \"stop\"",
            "actions = [\"yield_control\"]\nemergency = \"yield_control\"",
            "c.toml:28:12: `obstacle` yields, and nobody else flies",
        );
        check("\"battery_low\"", "\"Battery Low\"", "c.toml:15:8: `Battery Low` is not a flag name");
    }
}
