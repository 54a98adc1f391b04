//! What a mission asks of its objectives besides their places: their order, which may be left out, until when, for how long
//! the vehicle stays, whether it releases its load, and how it lands.

use std::collections::BTreeMap;
use std::time::Duration;

use serde::Deserialize;
use toml::Spanned;

use super::bounds::LONGEST_ACTION;
use super::{Checker, ObjectiveEntry};
use crate::declared_skill::{MOST_TASKS, NAMES, is_name};
use crate::file::did_you_mean;
use crate::task::{Stance, Task, Value};

/// `{ skill = "winch_down", length_m = 12.0 }`
#[derive(Deserialize)]
pub(super) struct TaskEntry {
    skill: String,
    #[serde(flatten)]
    inputs: BTreeMap<String, Value>,
}

impl TaskEntry {
    fn task(&self) -> Task {
        Task {
            skill: self.skill.clone(),
            inputs: self.inputs.iter().map(|(name, it)| (name.clone(), it.clone())).collect(),
        }
    }
}

/// In which order the objectives of a mission are attempted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// As the mission lists them.
    #[default]
    Given,
    /// As takes the least time; chosen when the first plan is made.
    Free,
}

/// What is asked of one objective.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Terms {
    /// What an optional objective is worth, by which those that are left out are chosen; `None`: it is required.
    pub worth: Option<f64>,
    /// Names of the objectives that are attempted before, whatever becomes of them.
    pub after: Vec<String>,
    /// It must be reached within this mission time after the first plan.
    pub within: Option<Duration>,
    /// It must be reached by then, in milliseconds since the Unix epoch, UTC.
    pub by_utc_ms: Option<i64>,
    /// For how long the vehicle stays there, in mission time, before the objective counts as reached.
    pub dwell: Duration,
    /// It releases its load there, in flight; then it stays. The objective is reached once the load is gone.
    pub drop: bool,
    /// The landing there is on a target that the autopilot's sensor sees; once it is lost three times, the objective has failed.
    pub land_on_target: bool,
    /// Commands to the payload at this place, or during this survey: each a name and its numbers. They are kept, and nothing
    /// flies them yet.
    pub actions: Vec<String>,
    /// Declared skills that are used there, after a drop and before the stay.
    pub tasks: Vec<Task>,
    /// Those that are used on the leg there, or along the lines of the survey.
    pub along: Vec<Task>,
}

/// Most seconds of a stay, and of a time limit; a longer one is a typing mistake.
pub const LONGEST_S: f64 = 86_400.0;
/// The greatest worth; a greater one is a typing mistake.
const MOST_WORTH: f64 = 1e6;

impl Checker<'_> {
    /// `picture_distance_m`: from one picture of its survey to the next.
    pub(super) fn terms(&mut self, it: &ObjectiveEntry, picture_distance_m: Option<f64>) -> Terms {
        let worth = match (it.optional.as_ref().is_some_and(|it| *it.as_ref()), &it.worth) {
            (true, Some(worth)) => Some(self.number("worth", worth, "a number from 0 to 1000000", 0.0, MOST_WORTH)),
            (true, None) => {
                let span = it.optional.as_ref().map(Spanned::span);
                let message = format!("optional objective `{}` has no `worth`", it.name.as_ref());
                self.say(span, message, "add `worth = 1.0`: what is worth least is left out first");
                None
            }
            (false, Some(worth)) => {
                let message = format!("`worth` is given, and objective `{}` is required", it.name.as_ref());
                self.say(Some(worth.span()), message, "add `optional = true`, or take `worth` out");
                None
            }
            (false, None) => None,
        };
        let seconds = "seconds from 0 to 86400";
        let within = it.reach_within_s.as_ref().map(|it| self.number("reach_within_s", it, seconds, 0.0, LONGEST_S));
        let dwell_s = it.dwell_s.as_ref().map_or(0.0, |it| self.number("dwell_s", it, seconds, 0.0, LONGEST_S));
        if let Some(drop) = &it.drop
            && *drop.as_ref()
            && !it.flying
        {
            let message = format!("objective `{}` is on the ground, and a load is dropped in flight", it.name.as_ref());
            self.say(Some(drop.span()), message, "set `flying = true` and a height, or take `drop` out");
        }
        if let Some(on_target) = &it.land_on_target
            && *on_target.as_ref()
            && it.flying
        {
            let message =
                format!("objective `{}` is reached in flight, and `land_on_target` is for a landing", it.name.as_ref());
            self.say(Some(on_target.span()), message, "set `flying = false`, or take `land_on_target` out");
        }
        for action in &it.actions {
            let text = action.as_ref();
            // It is shown on terminals.
            let is_visible = |it: char| it == ' ' || it.is_ascii_graphic();
            if text.trim().is_empty() || LONGEST_ACTION < text.len() || !text.chars().all(is_visible) {
                let message =
                    format!("an action of objective `{}` is not a command with its numbers", it.name.as_ref());
                let help = format!(
                    "write it like \"MAV_CMD_IMAGE_START_CAPTURE 0 2\": at most {LONGEST_ACTION} characters of ASCII"
                );
                self.say(Some(action.span()), message, &help);
            }
        }
        let stance = Stance::at_place(it.flying);
        let tasks = self.tasks(&it.tasks, stance, it, None);
        let along = self.tasks(&it.along, Stance::Flies, it, picture_distance_m);
        if let Some((index, message)) = self.skills.and_then(|skills| skills.taken_twice(&along)) {
            self.say(it.along.get(index).map(Spanned::span), message, "take one of them out, or use it on another leg");
        }
        // What is out of range was reported.
        let time = |seconds| Duration::try_from_secs_f64(seconds).unwrap_or_default();
        Terms {
            worth,
            after: it.after.iter().map(|it| it.as_ref().clone()).collect(),
            within: within.map(time),
            by_utc_ms: it.reach_by_utc.as_ref().and_then(|it| self.moment(it)),
            dwell: time(dwell_s),
            drop: it.drop.as_ref().is_some_and(|it| *it.as_ref()),
            land_on_target: it.land_on_target.as_ref().is_some_and(|it| *it.as_ref()),
            actions: it.actions.iter().map(|it| it.as_ref().clone()).collect(),
            tasks,
            along,
        }
    }

    /// Those of `do` or `along`, for which the vehicle does this; a distance for those that need one and leave it out.
    fn tasks(
        &mut self,
        entries: &[Spanned<TaskEntry>],
        stance: Stance,
        it: &ObjectiveEntry,
        every_m: Option<f64>,
    ) -> Vec<Task> {
        let skills = self.skills;
        let task = |entry: &TaskEntry| match (skills.and_then(|it| it.get(&entry.skill)), every_m) {
            (Some(skill), Some(every_m)) => skill.with_every_m(entry.task(), every_m),
            _ => entry.task(),
        };
        for entry in entries {
            let mut names = [&entry.as_ref().skill].into_iter().chain(entry.as_ref().inputs.keys());
            if let Some(name) = names.find(|it| !is_name(it)) {
                self.say(Some(entry.span()), format!("{name:?} cannot name a skill or an input"), NAMES);
                continue;
            }
            if let Some((message, help)) =
                self.skills.and_then(|skills| skills.misfit(&task(entry.as_ref()), stance, *it.height_m.as_ref()))
            {
                self.say(Some(entry.span()), message, &help);
            }
        }
        if let Some(task) = entries.get(MOST_TASKS) {
            let message = format!("objective `{}` does more than {MOST_TASKS} things", it.name.as_ref());
            self.say(Some(task.span()), message, "spread them over several objectives");
        }
        entries.iter().map(|it| task(it.as_ref())).collect()
    }

    fn number(&mut self, key: &str, value: &Spanned<f64>, expected: &str, least: f64, most: f64) -> f64 {
        let number = *value.as_ref();
        if !(least..=most).contains(&number) {
            self.say(Some(value.span()), format!("`{key}` is {number}, expected {expected}"), "");
        }
        number
    }

    /// Whether every `after` names another objective, none leads in a circle, and a given order keeps to them.
    pub(super) fn precedence(&mut self, order: Order, entries: &[ObjectiveEntry]) {
        let names: Vec<&str> = entries.iter().map(|it| it.name.as_ref().as_str()).collect();
        // Of two with one name, the first.
        let places: BTreeMap<&str, usize> =
            names.iter().enumerate().rev().map(|(index, name)| (*name, index)).collect();
        let place = |name: &str| places.get(name).copied();
        let later = directly_later(entries.iter().map(|it| it.after.iter().filter_map(|it| place(it.as_ref()))));
        for (index, entry) in entries.iter().enumerate().filter(|(_, it)| !it.after.is_empty()) {
            let comes_later = all_later(&later, index);
            for after in &entry.after {
                // The nearest of all names is not looked for in vain.
                if self.mistakes.is_full() {
                    return;
                }
                let (name, other) = (names[index], after.as_ref().as_str());
                let said = match place(other) {
                    None => Some((format!("there is no objective `{other}`"), did_you_mean(other, &names))),
                    Some(other_index) if other_index == index => {
                        Some((format!("objective `{name}` comes after itself"), String::new()))
                    }
                    Some(other_index) if comes_later[other_index] => {
                        let message = format!("objective `{name}` comes after `{other}`, which comes after `{name}`");
                        Some((message, "take one of them out: none of the circle could be first".into()))
                    }
                    Some(other_index) if order == Order::Given && index < other_index => Some((
                        format!("objective `{name}` comes after `{other}`, which is listed later"),
                        "list it later, or set `order = \"free\"` at the top".into(),
                    )),
                    Some(_) => None,
                };
                if let Some((message, help)) = said {
                    self.say(Some(after.span()), message, &help);
                }
            }
        }
    }
}

/// Which objectives name each of them in their `after`, each once, of those that each names.
fn directly_later(before: impl ExactSizeIterator<Item = impl Iterator<Item = usize>>) -> Vec<Vec<usize>> {
    let mut later = vec![Vec::new(); before.len()];
    for (index, before) in before.enumerate() {
        for other in before {
            if later[other].last() != Some(&index) {
                later[other].push(index);
            }
        }
    }
    later
}

/// Which objectives come after the one at `start`, however many others come between, by those that do so directly.
fn all_later(later: &[Vec<usize>], start: usize) -> Vec<bool> {
    let (mut seen, mut open) = (vec![false; later.len()], vec![start]);
    while let Some(index) = open.pop() {
        for &next in &later[index] {
            if !std::mem::replace(&mut seen[next], true) {
                open.push(next);
            }
        }
    }
    seen
}

#[cfg(test)]
mod tests {
    use super::super::Mission;
    use super::*;
    use crate::file::{Mistakes, Source};
    use crate::testing::check_mistake;

    const GOOD: &str = r#"
name = "round"
order = "free"
[[objective]]
name = "a"
north_m = 0.0
east_m = 500.0
height_m = 0.0
flying = false
dwell_s = 30.0
land_on_target = true
[[objective]]
name = "b"
north_m = 0.0
east_m = 500.0
height_m = 20.0
flying = true
optional = true
worth = 2.5
after = ["a"]
reach_within_s = 600.0
reach_by_utc = "2026-05-01T08:00:00Z"
drop = true
actions = ["MAV_CMD_IMAGE_START_CAPTURE 0 2"]
do = [{ skill = "winch_down", length_m = 12.0 }]
along = [{ skill = "camera", every_m = 5.0 }]
"#;

    fn read(text: &str) -> Result<Mission, Mistakes> {
        Mission::read(&Source { path: "m.toml".into(), text: text.into() })
    }

    #[test]
    fn the_terms_of_an_objective_are_read() {
        let mission = read(GOOD).unwrap();
        assert_eq!(mission.order, Order::Free);
        let landing = Terms { dwell: Duration::from_secs(30), land_on_target: true, ..Terms::default() };
        assert_eq!(mission.objectives[0].terms, landing);
        let expected = Terms {
            worth: Some(2.5),
            after: vec!["a".into()],
            within: Some(Duration::from_secs(600)),
            by_utc_ms: Some(1_777_622_400_000),
            dwell: Duration::ZERO,
            drop: true,
            land_on_target: false,
            actions: vec!["MAV_CMD_IMAGE_START_CAPTURE 0 2".into()],
            tasks: vec![Task { skill: "winch_down".into(), inputs: vec![("length_m".into(), 12.0.into())] }],
            along: vec![Task { skill: "camera".into(), inputs: vec![("every_m".into(), 5.0.into())] }],
        };
        assert_eq!(mission.objectives[1].terms, expected);
        let plain = read(&GOOD.replace("order = \"free\"\n", "")).unwrap();
        assert_eq!(plain.order, Order::Given);
    }

    #[test]
    fn terms_that_make_no_sense_are_told_with_their_place() {
        #[track_caller]
        fn check(find: &str, replace: &str, expected: &str) {
            check_mistake(GOOD, find, replace, read, expected);
        }
        check("worth = 2.5\n", "", "m.toml:18:12: optional objective `b` has no `worth`");
        check("optional = true\n", "", "m.toml:18:9: `worth` is given, and objective `b` is required");
        check("2.5", "nan", "m.toml:19:9: `worth` is NaN, expected a number from 0 to 1000000");
        check("30.0", "-1.0", "m.toml:10:11: `dwell_s` is -1, expected seconds from 0 to 86400");
        check("600.0", "1e9", "m.toml:21:18: `reach_within_s` is 1000000000, expected seconds from 0 to 86400");
        check(
            "height_m = 20.0\nflying = true",
            "height_m = 0.0\nflying = false",
            "m.toml:23:8: objective `b` is on the ground, and a load is dropped in flight",
        );
        check(
            "drop = true",
            "land_on_target = true",
            "m.toml:23:18: objective `b` is reached in flight, and `land_on_target` is for a landing",
        );
        for action in ["", "\\u001b[2J", "Käse 1", &"1 ".repeat(150)] {
            check(
                "MAV_CMD_IMAGE_START_CAPTURE 0 2",
                action,
                "m.toml:24:12: an action of objective `b` is not a command with its numbers",
            );
        }
        check("2026-05-01T08:00:00Z", "soon", "m.toml:22:16: found `soon`, expected a UTC date and time");
        check("\"free\"", "\"any\"", "m.toml:3:9: unknown variant `any`");
        check("[\"a\"]", "[\"c\"]", "m.toml:20:10: there is no objective `c`");
        check("[\"a\"]", "[\"b\"]", "m.toml:20:10: objective `b` comes after itself");
        check(
            "dwell_s = 30.0",
            "after = [\"b\"]",
            "m.toml:10:10: objective `a` comes after `b`, which comes after `a`",
        );
        let given = GOOD.replace("order = \"free\"\n", "").replace("after = [\"a\"]\n", "");
        check_mistake(
            &given,
            "dwell_s = 30.0",
            "after = [\"b\"]",
            read,
            "m.toml:9:10: objective `a` comes after `b`, which is listed later",
        );
    }

    #[test]
    fn an_identity_covers_the_terms_and_the_order() {
        let mission = read(GOOD).unwrap();
        for (found, replaced) in [
            ("30.0", "31.0"),
            ("2.5", "2.6"),
            ("[\"a\"]", "[]"),
            ("600.0", "601.0"),
            ("08:00:00Z", "09:00:00Z"),
            ("\"free\"", "\"given\""),
            ("optional = true\nworth = 2.5\n", ""),
            ("drop = true", "drop = false"),
            ("target = true", "target = false"),
            ("CAPTURE 0 2", "CAPTURE 0 3"),
            ("length_m = 12.0", "length_m = 13.0"),
            ("every_m = 5.0", "every_m = 6.0"),
        ] {
            let other = read(&GOOD.replacen(found, replaced, 1)).unwrap();
            assert_ne!(other.identity(), mission.identity(), "{found}");
        }
    }
}
