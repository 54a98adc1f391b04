//! Declared skills: whether a process offers each of them, and whether its conditions hold.

use std::collections::BTreeMap;

use domain::contingency::expression::{Expression, Verdict};
use domain::contingency::snapshot::Snapshot;
use domain::declared_skill::{DeclaredSkill, DeclaredSkills};
use domain::task::SILENT;
use domain::time::{Pace, Time};
use kittiwake_proto::v1;

/// The declarations, and what was heard of them.
#[derive(Debug, Clone, Default)]
pub(crate) struct Skills {
    declared: DeclaredSkills,
    /// When a process of the declared version was heard last, of each skill.
    heard: BTreeMap<String, Time>,
    /// One of another version, and which.
    others: BTreeMap<String, (Time, u32)>,
    /// What the rest of the mission uses, as the mission manager has told last.
    needed: Option<Vec<String>>,
    /// Since when it listens: a process may not have had the time to report.
    since: Option<Time>,
}

impl Skills {
    pub(crate) fn new(declared: DeclaredSkills) -> Skills {
        Skills { declared, ..Skills::default() }
    }

    /// A process has reported.
    pub(crate) fn hear(&mut self, now: Time, report: v1::TaskReport) {
        self.since.get_or_insert(now);
        match self.declared.get(&report.skill) {
            Some(skill) if skill.version == report.version => _ = self.heard.insert(report.skill, now),
            Some(_) => _ = self.others.insert(report.skill, (now, report.version)),
            None => {}
        }
    }

    /// The mission manager has told what the rest of the mission uses.
    pub(crate) fn needs(&mut self, now: Time, names: Vec<String>) {
        self.since.get_or_insert(now);
        self.needed = Some(names);
    }

    /// Why the rest of the mission cannot use one of its skills, if so; `None` before the mission manager was heard.
    pub(crate) fn missing(&self, now: Time, pace: Pace) -> Option<Option<String>> {
        let missing = |name: &String| match self.declared.get(name) {
            Some(skill) => self.why_not(skill, now, pace),
            None => Some(format!("skill `{name}` is not declared")),
        };
        self.needed.as_ref().map(|needed| needed.iter().find_map(missing))
    }

    /// Each declared skill as it is now; once the mission is known, those that its rest uses. (A narrow link carries it.)
    pub(crate) fn told(&self, snapshot: &Snapshot, now: Time, pace: Pace) -> Vec<v1::DeclaredSkill> {
        let told = |skill: &DeclaredSkill| v1::DeclaredSkill {
            name: skill.name.clone(),
            not_offered: self.why_not(skill, now, pace).unwrap_or_default(),
            may_be_late: self.since.is_none_or(|since| now - since < pace.wall(SILENT)),
            unmet_precondition: unmet(skill.precondition.as_ref(), snapshot),
            unmet_invariant: unmet(skill.invariant.as_ref(), snapshot),
            unmet_postcondition: unmet(skill.postcondition.as_ref(), snapshot),
        };
        let is_needed = |it: &&DeclaredSkill| self.needed.as_ref().is_none_or(|needed| needed.contains(&it.name));
        self.declared.all().iter().filter(is_needed).map(told).collect()
    }

    /// Why no process offers it, if none does.
    fn why_not(&self, skill: &DeclaredSkill, now: Time, pace: Pace) -> Option<String> {
        let name = &skill.name;
        let is_recent = |at: Time| now - at < pace.wall(SILENT);
        if self.heard.get(name).is_some_and(|at| is_recent(*at)) {
            return None;
        }
        Some(match self.others.get(name).filter(|(at, _)| is_recent(*at)) {
            Some((_, version)) => {
                format!("the process of skill `{name}` has version {version}, its declaration {}", skill.version)
            }
            None => format!("no process offers skill `{name}`"),
        })
    }
}

/// What does not hold, in words; empty if it holds, or nothing is asked for.
fn unmet(condition: Option<&Expression>, snapshot: &Snapshot) -> String {
    let Some(condition) = condition else { return String::new() };
    match condition.verdict(snapshot) {
        Verdict::Holds => String::new(),
        Verdict::DoesNotHold => {
            let values = condition.fields().iter().filter_map(|it| Some((it, snapshot.get(*it)?)));
            let values: Vec<String> =
                values.map(|(field, value)| format!("{} is {}", field.name(), field.in_words(value))).collect();
            format!("`{}`: {}", condition.text(), values.join(", "))
        }
        Verdict::Unknown(field) => {
            format!("`{}`: {} is not known", condition.text(), field.map_or("its result", |it| it.name()))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use domain::contingency::snapshot::Field;
    use domain::file::Source;
    use std::time::Duration;

    fn skills() -> Skills {
        let text = "
            version = 2\nsummary = \"Reads a meter\"\nseconds = 5.0\nlimit_s = 20.0
            precondition = \"position.height_m < 5 m\"\noutcome = { read = \"success\" }";
        let source = Source { path: "read_meter.toml".into(), text: text.into() };
        Skills::new(DeclaredSkills::of(vec![DeclaredSkill::read(&source).unwrap()]))
    }

    fn at(seconds: u64) -> Time {
        Time::after(Duration::from_secs(seconds))
    }

    #[test]
    fn a_skill_is_offered_while_a_process_of_its_version_reports() {
        #[track_caller]
        fn check(reports: &[(u64, &str, u32)], now_s: u64, expected: &str) {
            let mut skills = skills();
            for (at_s, skill, version) in reports {
                let report = v1::TaskReport { skill: (*skill).into(), version: *version, ..Default::default() };
                skills.hear(at(*at_s), report);
            }
            skills.needs(at(0), vec!["read_meter".into()]);
            let told = &skills.told(&Snapshot::UNKNOWN, at(now_s), Pace::REAL_TIME)[0];
            assert_eq!(told.not_offered, expected);
            let missing = skills.missing(at(now_s), Pace::REAL_TIME).flatten().unwrap_or_default();
            assert_eq!(missing, expected);
        }
        check(&[], 0, "no process offers skill `read_meter`");
        check(&[(0, "read_meter", 2)], 2, "");
        check(&[(0, "read_meter", 2)], 3, "no process offers skill `read_meter`");
        check(&[(0, "winch", 2)], 0, "no process offers skill `read_meter`");
        check(&[(0, "read_meter", 2), (0, "read_meter", 1)], 1, "");
        check(&[(0, "read_meter", 1)], 0, "the process of skill `read_meter` has version 1, its declaration 2");
    }

    #[test]
    fn a_condition_that_does_not_hold_is_told_with_its_values() {
        #[track_caller]
        fn check(height_m: Option<f64>, expected: &str) {
            let mut snapshot = Snapshot::UNKNOWN;
            snapshot.set(Field::Height, height_m);
            let told = skills().told(&snapshot, at(0), Pace::REAL_TIME);
            assert_eq!(told[0].unmet_precondition, expected);
            assert_eq!(told[0].unmet_invariant, "");
        }
        check(Some(3.0), "");
        check(Some(30.0), "`position.height_m < 5 m`: position.height_m is 30.00 m");
        check(None, "`position.height_m < 5 m`: position.height_m is not known");
    }
}
