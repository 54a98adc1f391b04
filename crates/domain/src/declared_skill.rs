//! Declared skills: what an integrator's own process can do, as `config/skills/NAME.toml` says. docs/skills.md has every key.
//!
//! The planner needs the inputs, the time and the energy; the monitor reads the conditions; the skill manager gets the limits with
//! each goal. None of them knows what the skill does.

use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;
use std::path::Path;

use serde::Deserialize;
use toml::Spanned;

use crate::contingency::expression::estimate::Estimate;
use crate::contingency::expression::{Expression, Problem, Verdict};
use crate::contingency::hazard::reach::well;
use crate::contingency::snapshot::{Field, Snapshot};
use crate::file::{Mistake, Mistakes, Source, did_you_mean};
use crate::geometry::Ned;
use crate::mission::Objective;
use crate::payload_command::{PAYLOAD_COMMANDS, Param, PayloadCommand};
use crate::quantity::Number;
use crate::task::{Stance, Task, TaskGoal};

/// Most seconds that another skill waits for an interrupted one: an emergency cannot wait longer. (ENG)
const LONGEST_INTERRUPT_S: f64 = 10.0;
/// Conditions are tried at these heights, in metres.
const HEIGHTS_M: [f64; 8] = [10.0, 5.0, 3.0, 15.0, 20.0, 30.0, 50.0, 80.0];
/// The least and the greatest of all inputs are tried together.
const MOST_INPUTS: usize = 8;
/// Parameters of a command of MAVLink.
const MOST_PARAMS: usize = 7;
/// Most tasks at one place.
pub const MOST_TASKS: usize = 50;
const LONGEST_NAME: usize = 40;
/// A task along a leg has failed if it runs for longer, in seconds: no flight takes a day. Also the greatest estimate.
const LONGEST_LEG_S: f64 = 86_400.0;

/// All declared skills, in the order of their names.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DeclaredSkills(Vec<DeclaredSkill>);

/// The declaration of one skill.
#[derive(Debug, Clone, PartialEq)]
pub struct DeclaredSkill {
    /// The name of its file.
    pub name: String,
    /// Counts the declaration's versions. A process says which one it was written for.
    pub version: u32,
    /// One sentence for people.
    pub summary: String,
    /// Must hold before it begins; `None`: nothing must.
    pub precondition: Option<Expression>,
    /// Must hold while it runs.
    pub invariant: Option<Expression>,
    /// Must hold once it has succeeded.
    pub postcondition: Option<Expression>,
    /// What the vehicle does meanwhile.
    pub stance: Stance,
    inputs: Vec<Input>,
    seconds: Estimate,
    power_w: Estimate,
    limit_s: Estimate,
    interrupt_s: f64,
    /// How often it is tried at one place before the objective is given up.
    pub tries: u32,
    succeeds_as: Vec<String>,
    fails_as: Vec<String>,
    /// The command for an autopilot that carries the skill out itself; `None`: a process does.
    pub payload_command: Option<PayloadCommand>,
}

#[derive(Debug, Clone, PartialEq)]
struct Input {
    name: String,
    least: f64,
    most: f64,
    /// Its value where a mission leaves it out.
    usual: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    version: Number<1, 1_000_000>,
    summary: String,
    precondition: Option<Spanned<String>>,
    invariant: Option<Spanned<String>>,
    postcondition: Option<Spanned<String>>,
    #[serde(default)]
    vehicle: Stance,
    seconds: Option<Spanned<EstimateEntry>>,
    power_w: Option<Spanned<EstimateEntry>>,
    limit_s: Option<Spanned<EstimateEntry>>,
    interrupt_s: Option<Spanned<Number<0, 86_400>>>,
    tries: Option<Spanned<Number<1, 20>>>,
    #[serde(default)]
    input: BTreeMap<Spanned<String>, InputEntry>,
    outcome: Spanned<BTreeMap<Spanned<String>, Meaning>>,
    mavlink: Option<MavlinkEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MavlinkEntry {
    command: Spanned<String>,
    params: Spanned<Vec<Spanned<ParamEntry>>>,
    cancel: Option<Spanned<Vec<Spanned<ParamEntry>>>>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum ParamEntry {
    Number(f64),
    Input(String),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct InputEntry {
    least: Spanned<f64>,
    most: Spanned<f64>,
    usual: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a number, or a text that calculates one from inputs")]
enum EstimateEntry {
    Number(f64),
    Text(String),
}

/// What an outcome means for the objective.
#[derive(Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Meaning {
    Success,
    Failure,
}

impl DeclaredSkills {
    /// Reads every `*.toml` of a folder.
    ///
    /// # Errors
    /// The mistakes in all of them, each with its place.
    pub fn read(folder: &Path) -> Result<DeclaredSkills, Mistakes> {
        let (mut skills, mut mistakes) = (Vec::new(), Mistakes::default());
        for source in DeclaredSkills::sources(folder)? {
            match DeclaredSkill::read(&source) {
                Ok(skill) => skills.push(skill),
                Err(found) => found.0.into_iter().for_each(|it| mistakes.push(it)),
            }
        }
        skills.sort_by(|a, b| a.name.cmp(&b.name));
        mistakes.or(DeclaredSkills(skills))
    }

    /// The files of a folder, in the order of their names.
    ///
    /// # Errors
    /// If the folder or one of its files cannot be read.
    pub fn sources(folder: &Path) -> Result<Vec<Source>, Mistakes> {
        let unreadable = |cause: std::io::Error| {
            let message = format!("cannot be read: {cause}");
            let help = "`skills` in the configuration is a folder with a file for each declared skill".into();
            Mistakes(vec![Mistake { path: folder.to_owned(), place: None, message, help }])
        };
        let mut paths = Vec::new();
        for entry in fs::read_dir(folder).map_err(unreadable)? {
            let path = entry.map_err(unreadable)?.path();
            if path.extension().is_some_and(|it| it == "toml") {
                paths.push(path);
            }
        }
        paths.sort();
        paths.iter().map(|it| Source::read(it)).collect()
    }

    /// Those of these.
    pub fn of(skills: Vec<DeclaredSkill>) -> DeclaredSkills {
        DeclaredSkills(skills)
    }

    /// Each of them.
    pub fn all(&self) -> &[DeclaredSkill] {
        &self.0
    }

    /// The one of this name.
    pub fn get(&self, name: &str) -> Option<&DeclaredSkill> {
        self.0.iter().find(|it| it.name == name)
    }

    /// The goal that does `task` over a place. One of an undeclared skill cannot succeed; [`DeclaredSkills::misfit`] says why.
    pub fn goal(&self, task: &Task, over: Ned) -> TaskGoal {
        self.get(&task.skill).map_or_else(
            || TaskGoal {
                over,
                stance: Stance::default(),
                task: task.clone(),
                estimate_s: 0.0,
                power_w: 0.0,
                limit_s: 1.0,
                interrupt_s: 0.0,
                succeeds_as: Vec::new(),
            },
            |it| it.goal(task, over),
        )
    }

    /// The same for each task of a mission, the first that cannot be done with its objective.
    pub fn misfit_in<'a>(&self, objectives: impl IntoIterator<Item = &'a Objective>) -> Option<String> {
        objectives.into_iter().find_map(|objective| {
            let terms = &objective.terms;
            let height_m = objective.position.height_m();
            let tasks = terms.tasks.iter().map(|it| (it, Stance::at_place(objective.flying)));
            let tasks = tasks.chain(terms.along.iter().map(|it| (it, Stance::Flies)));
            let (message, help) = tasks.into_iter().find_map(|(it, stance)| self.misfit(it, stance, height_m))?;
            let help = if help.is_empty() { help } else { format!(": {help}") };
            Some(format!("objective `{}`: {message}{help}", objective.name))
        })
    }

    /// Why a task cannot be done by any of these while the vehicle does that at this height, and how to mend that; `None` if it can.
    pub fn misfit(&self, task: &Task, stance: Stance, height_m: f64) -> Option<(String, String)> {
        let Some(skill) = self.get(&task.skill) else {
            let names: Vec<&str> = self.0.iter().map(|it| it.name.as_str()).collect();
            return Some((format!("there is no declared skill `{}`", task.skill), did_you_mean(&task.skill, &names)));
        };
        skill.misfit(task, stance, height_m)
    }
}

impl DeclaredSkill {
    /// Parses and checks a declaration; its name is that of the file.
    ///
    /// # Errors
    /// The mistakes, each with its place.
    pub fn read(source: &Source) -> Result<DeclaredSkill, Mistakes> {
        let file: File = source.parse()?;
        let mut check = Check { source, mistakes: Mistakes::default() };
        let name = source.path.file_stem().map(|it| it.to_string_lossy().into_owned()).unwrap_or_default();
        if !is_name(&name) || is_built_in(&name) {
            check.say(None, format!("the file name `{name}` cannot name a skill"), NAMES);
        }
        let inputs: Vec<Input> = file.input.iter().map(|(name, it)| check.input(name, it)).collect();
        if let Some((name, _)) = file.input.iter().nth(MOST_INPUTS) {
            check.say(Some(name.span()), format!("found {} inputs, expected at most {MOST_INPUTS}", inputs.len()), "");
        }
        let payload_command = file.mavlink.as_ref().map(|it| check.payload_command(it, &inputs));
        let stance = file.vehicle;
        check.times(&file);
        let interrupt_s = check.interrupt(file.interrupt_s.as_ref());
        let outcomes = |wanted: Meaning| {
            let those = file.outcome.as_ref().iter().filter(move |(_, meaning)| **meaning == wanted);
            those.map(|(name, _)| name.as_ref().clone()).collect::<Vec<_>>()
        };
        let succeeds_as = outcomes(Meaning::Success);
        if succeeds_as.is_empty() {
            check.say(Some(file.outcome.span()), "no outcome is a success", "say which one is: `done = \"success\"`");
        }
        for name in
            file.outcome.as_ref().keys().filter(|it| !is_name(it.as_ref()) || RESERVED.contains(&it.as_ref().as_str()))
        {
            check.say(Some(name.span()), format!("`{}` cannot name an outcome", name.as_ref()), NAMES);
        }
        let skill = DeclaredSkill {
            name,
            version: file.version.get() as u32,
            summary: file.summary.clone(),
            precondition: check.condition(file.precondition.as_ref()),
            invariant: check.condition(file.invariant.as_ref()),
            postcondition: check.condition(file.postcondition.as_ref()),
            stance,
            seconds: check.estimate("seconds", file.seconds.as_ref(), 0.0, &inputs),
            power_w: check.estimate("power_w", file.power_w.as_ref(), 0.0, &inputs),
            limit_s: check.estimate("limit_s", file.limit_s.as_ref(), LONGEST_LEG_S, &inputs),
            inputs,
            interrupt_s,
            tries: file.tries.as_ref().map_or(1, |it| it.as_ref().get() as u32),
            succeeds_as,
            fails_as: outcomes(Meaning::Failure),
            payload_command,
        };
        let too_long = corners(&skill.inputs).into_iter().find_map(|it| {
            let (seconds, limit_s) = (skill.seconds.value(&value_in(&it)), skill.limit_s.value(&value_in(&it)));
            (limit_s < seconds).then(|| format!("`limit_s` is {limit_s}{}, and the skill takes {seconds} s", with(&it)))
        });
        if let Some((limit, message)) = file.limit_s.as_ref().zip(too_long) {
            check.say(Some(limit.span()), message, "raise it: a skill that is as slow as declared has not failed");
        }
        match (skill.usable_at_m(), &skill.postcondition) {
            (None, _) => {
                let span = file.precondition.as_ref().or(file.invariant.as_ref()).map(Spanned::span);
                let (message, help) = match stance {
                    Stance::Stands => {
                        ("precondition and invariant do not hold while a vehicle stands on the ground".to_owned(), "")
                    }
                    Stance::Hovers | Stance::Flies => (
                        format!("precondition and invariant hold at no height at which a vehicle {stance}"),
                        "tried at 3 to 80 m, while all is well",
                    ),
                };
                check.say(span, message, help);
            }
            (Some(height_m), Some(it)) if it.verdict(&usual(stance, height_m)) == Verdict::DoesNotHold => {
                let message =
                    format!("the postcondition does not hold where the skill is used, such as at {height_m} m");
                check.say(file.postcondition.as_ref().map(Spanned::span), message, "no task could succeed");
            }
            (Some(_), _) => {}
        }
        check.mistakes.or(skill)
    }

    /// Why it cannot do this task while the vehicle does that, and how to mend that; `None` if it can.
    fn misfit(&self, task: &Task, stance: Stance, height_m: f64) -> Option<(String, String)> {
        if stance != self.stance {
            let help = match self.stance {
                Stance::Hovers => "name it in `do` of an objective with `flying = true`",
                Stance::Flies => "name it in `along`",
                Stance::Stands => "name it in `do` of an objective with `flying = false`",
            };
            let message =
                format!("skill `{}` is used while the vehicle {}, not while it {stance}", self.name, self.stance);
            return Some((message, help.to_owned()));
        }
        let (skill, names) = (&self.name, self.inputs.iter().map(|it| it.name.as_str()).collect::<Vec<_>>());
        if let Some((name, _)) = task.inputs.iter().find(|(name, _)| !names.contains(&name.as_str())) {
            return Some((format!("skill `{skill}` has no input `{name}`"), did_you_mean(name, &names)));
        }
        let bad_input = self.inputs.iter().find_map(|input| {
            let Input { name, least, most, .. } = input;
            match input.of(task) {
                None => {
                    Some((format!("skill `{skill}` needs `{name}`"), format!("add `{name}`, from {least} to {most}")))
                }
                Some(value) if !(*least..=*most).contains(&value) => {
                    Some((format!("`{name}` of skill `{skill}` is {value}, expected {least} to {most}"), String::new()))
                }
                Some(_) => None,
            }
        });
        bad_input.or_else(|| self.bad_estimate(task)).or_else(|| self.bad_height(stance, height_m))
    }

    /// Its inputs by their names; the greatest of one that the task does not say.
    fn values(&self, task: &Task) -> Vec<(String, f64)> {
        self.inputs.iter().map(|it| (it.name.clone(), it.of(task).unwrap_or(it.most))).collect()
    }

    /// The extremes were tried when it was read; between them it may be anything.
    fn bad_estimate(&self, task: &Task) -> Option<(String, String)> {
        let values = self.values(task);
        let of = |it: &Estimate| it.value(&value_in(&values));
        let fits = |it: &f64| (0.0..=LONGEST_LEG_S).contains(it);
        let (seconds, limit_s) = (of(&self.seconds), of(&self.limit_s));
        let is_good = [seconds, limit_s, of(&self.power_w)].iter().all(fits) && seconds <= limit_s;
        (!is_good).then(|| {
            let message = format!(
                "skill `{}` comes to {seconds} s, at most {limit_s} s, and {} W{}",
                self.name,
                of(&self.power_w),
                with(&values)
            );
            (message, "its declaration calculates that".to_owned())
        })
    }

    fn bad_height(&self, stance: Stance, height_m: f64) -> Option<(String, String)> {
        let usual = usual(stance, height_m);
        let fails = |it: &&Expression| it.verdict(&usual) == Verdict::DoesNotHold;
        let unmet = [&self.precondition, &self.invariant].into_iter().flatten().find(fails)?;
        let message = format!("skill `{}` is used at {height_m} m, and asks for `{}`", self.name, unmet.text());
        Some((message, "set `height_m` of the objective so that this holds".to_owned()))
    }

    /// The task with this as its `every_m`, if the skill has such an input and the task leaves it out.
    pub fn with_every_m(&self, mut task: Task, every_m: f64) -> Task {
        const NAME: &str = "every_m";
        let is_given = task.inputs.iter().any(|(name, _)| name == NAME);
        if !is_given && self.inputs.iter().any(|it| it.name == NAME) {
            task.inputs.push((NAME.to_owned(), every_m));
        }
        task
    }

    /// The goal that does `task` over a place; an input that the task leaves out has its usual value.
    pub fn goal(&self, task: &Task, over: Ned) -> TaskGoal {
        let value = |it: &Input| Some((it.name.clone(), it.of(task)?));
        let task = Task { skill: self.name.clone(), inputs: self.inputs.iter().filter_map(value).collect() };
        let values = self.values(&task);
        let of_inputs = |it: &Estimate| it.value(&value_in(&values));
        TaskGoal {
            over,
            stance: self.stance,
            estimate_s: of_inputs(&self.seconds),
            power_w: of_inputs(&self.power_w),
            limit_s: of_inputs(&self.limit_s),
            task,
            interrupt_s: self.interrupt_s,
            succeeds_as: self.succeeds_as.clone(),
        }
    }

    /// The first of some heights at which it can be used while all is well, in metres.
    pub fn usable_at_m(&self) -> Option<f64> {
        let conditions = [&self.precondition, &self.invariant];
        let holds = |height_m: &f64| {
            let usual = usual(self.stance, *height_m);
            conditions.into_iter().flatten().all(|it| it.verdict(&usual) != Verdict::DoesNotHold)
        };
        match self.stance {
            Stance::Stands => Some(0.0).filter(holds),
            Stance::Hovers | Stance::Flies => HEIGHTS_M.into_iter().find(holds),
        }
    }

    /// A task with these inputs, for the others their usual value or the least one.
    pub fn example(&self, inputs: &[(String, f64)]) -> Task {
        let given = |name: &str| inputs.iter().find(|(it, _)| it == name).map(|(_, value)| *value);
        let known = self.inputs.iter().map(|it| (it.name.clone(), given(&it.name).or(it.usual).unwrap_or(it.least)));
        let unknown = inputs.iter().filter(|(name, _)| self.inputs.iter().all(|it| it.name != *name));
        Task { skill: self.name.clone(), inputs: known.chain(unknown.cloned()).collect() }
    }

    /// What it takes, in words, a line for each thing.
    pub fn in_words(&self) -> Vec<String> {
        let inputs = self.inputs.iter().map(Input::in_words);
        let conditions = [
            ("begins if", &self.precondition),
            ("goes on while", &self.invariant),
            ("has succeeded if", &self.postcondition),
        ];
        let conditions =
            conditions.into_iter().filter_map(|(when, it)| Some(format!("{when} {}", it.as_ref()?.text())));
        let outcomes =
            self.outcomes().map(|(name, success)| format!("{name} ({})", if success { "success" } else { "failure" }));
        let power = match self.power_w.text() {
            "0" => String::new(),
            watts => format!("; {watts} W"),
        };
        let limits = match self.stance {
            Stance::Flies => format!("lasts as long as the leg{power}"),
            Stance::Hovers | Stance::Stands => format!(
                "takes {} s, at most {} s; an interruption up to {} s{power}",
                self.seconds.text(),
                self.limit_s.text(),
                self.interrupt_s
            ),
        };
        let stance = format!("while the vehicle {}", self.stance);
        let ends = format!("ends as {}", outcomes.collect::<Vec<_>>().join(", "));
        std::iter::once(stance).chain(inputs).chain(conditions).chain([limits, ends]).collect()
    }

    /// Each of its outcomes, and whether it is a success.
    pub fn outcomes(&self) -> impl Iterator<Item = (&str, bool)> {
        self.succeeds_as.iter().map(|it| (it.as_str(), true)).chain(self.fails_as.iter().map(|it| (it.as_str(), false)))
    }
}

impl Input {
    fn of(&self, task: &Task) -> Option<f64> {
        let given = task.inputs.iter().find(|(name, _)| *name == self.name);
        given.map(|(_, value)| *value).or(self.usual)
    }

    /// `length_m from 2 to 30, usually 5`
    fn in_words(&self) -> String {
        let usual = self.usual.map(|it| format!(", usually {it}")).unwrap_or_default();
        let Input { name, least, most, .. } = self;
        format!("{name} from {least} to {most}{usual}")
    }
}

/// Every set of least and greatest inputs.
fn corners(inputs: &[Input]) -> Vec<Vec<(String, f64)>> {
    let end =
        |set: usize, at: usize, it: &Input| (it.name.clone(), if set >> at & 1 == 0 { it.least } else { it.most });
    let corner = |set| inputs.iter().enumerate().map(|(at, it)| end(set, at, it)).collect();
    (0..1 << inputs.len().min(MOST_INPUTS)).map(corner).collect()
}

/// Looks up a value by its name.
fn value_in(values: &[(String, f64)]) -> impl Fn(&str) -> Option<f64> {
    |name| values.iter().find(|(it, _)| it == name).map(|(_, value)| *value)
}

/// ` with length_m 12`; empty without inputs.
fn with(values: &[(String, f64)]) -> String {
    let values: Vec<String> = values.iter().map(|(name, value)| format!("{name} {value}")).collect();
    if values.is_empty() { String::new() } else { format!(" with {}", values.join(" and ")) }
}

/// The values that conditions read while all is well and the vehicle does this at this height.
fn usual(stance: Stance, height_m: f64) -> Snapshot {
    let mut usual = well(stance != Stance::Stands);
    usual.set(Field::Height, Some(height_m));
    match stance {
        Stance::Hovers => {
            usual.set(Field::GroundSpeed, Some(0.0));
            usual.set_choice(Field::Mode, "loiter");
            usual.set_choice(Field::IntendedMode, "loiter");
        }
        Stance::Flies => {}
        // After a landing an autopilot disarms some time, and its mode means nothing.
        Stance::Stands => {
            [Field::Armed, Field::Mode, Field::IntendedMode].into_iter().for_each(|it| usual.set(it, None));
        }
    }
    usual
}

/// The outcome of a task that was ended by an order: no declaration has it.
pub const CANCELLED: &str = "cancelled";

pub(crate) const NAMES: &str =
    "a name has up to 40 of a-z, 0-9 and _, begins with a letter, and has no meaning of its own (docs/skills.md)";

/// The outcomes of tasks that did not end by themselves: no declaration has them.
const RESERVED: [&str; 4] = [CANCELLED, "error", "refused", "unanswered"];
/// The skills that every vehicle has, each with a sentence for people and what the vehicle does meanwhile.
pub const BUILT_IN: [(&str, &str, Stance); 5] = [
    ("takeoff", "Arms if necessary and climbs straight up", Stance::Flies),
    ("land", "Lands where the vehicle is", Stance::Flies),
    ("stop", "Comes to rest and hovers", Stance::Hovers),
    ("offboard", "Flies straight to a place by setpoints, or at a velocity", Stance::Flies),
    ("release", "Opens the gripper, hovering over a place (`drop = true`)", Stance::Hovers),
];

fn is_built_in(name: &str) -> bool {
    // The kind of all declared skills is `task`.
    name == "task" || BUILT_IN.iter().any(|(it, ..)| *it == name)
}

pub(crate) fn is_name(name: &str) -> bool {
    let rest = |it: char| it.is_ascii_lowercase() || it.is_ascii_digit() || it == '_';
    name.starts_with(|it: char| it.is_ascii_lowercase()) && name.len() <= LONGEST_NAME && name.chars().all(rest)
}

struct Check<'a> {
    source: &'a Source,
    mistakes: Mistakes,
}

impl Check<'_> {
    fn say(&mut self, span: Option<Range<usize>>, message: impl Into<String>, help: &str) {
        self.mistakes.push(self.source.mistake(span, message, help));
    }

    fn input(&mut self, name: &Spanned<String>, it: &InputEntry) -> Input {
        if !is_name(name.as_ref()) || name.as_ref() == "skill" {
            self.say(Some(name.span()), format!("`{}` cannot name an input", name.as_ref()), NAMES);
        }
        let (least, most) = (*it.least.as_ref(), *it.most.as_ref());
        if !(least.is_finite() && most.is_finite() && least <= most) {
            self.say(
                Some(it.most.span()),
                format!("`most` is {most}, expected no less than `least`, which is {least}"),
                "",
            );
        }
        let usual = it.usual.as_ref().map(|it| *it.as_ref());
        if let Some(entry) = it.usual.as_ref().filter(|it| !(least..=most).contains(it.as_ref())) {
            self.say(Some(entry.span()), format!("`usual` is {}, expected {least} to {most}", entry.as_ref()), "");
        }
        Input { name: name.as_ref().clone(), least, most, usual }
    }

    /// What `key` comes to, `usual` without it: from 0 to a day for the least and the greatest inputs.
    fn estimate(&mut self, key: &str, it: Option<&Spanned<EstimateEntry>>, usual: f64, inputs: &[Input]) -> Estimate {
        let names: Vec<&str> = inputs.iter().map(|it| it.name.as_str()).collect();
        let estimate = match it.map(Spanned::as_ref) {
            None => return Estimate::constant(usual),
            Some(EstimateEntry::Number(number)) => Ok(Estimate::constant(*number)),
            Some(EstimateEntry::Text(text)) => Estimate::parse(text, &names),
        };
        let span = it.map(Spanned::span);
        let estimate = match estimate {
            Ok(estimate) => estimate,
            Err(problem) => {
                self.problem(span, problem);
                return Estimate::constant(usual);
            }
        };
        let wrong = corners(inputs).into_iter().find_map(|it| {
            let value = estimate.value(&value_in(&it));
            let fits = (0.0..=LONGEST_LEG_S).contains(&value);
            (!fits).then(|| format!("`{key}` is {value}{}, expected 0 to {LONGEST_LEG_S}", with(&it)))
        });
        if let Some(message) = wrong {
            self.say(span, message, "");
        }
        estimate
    }

    /// A task along a leg lasts as long as that, nothing waits for its end, and the leg is flown once.
    fn times(&mut self, file: &File) {
        if file.vehicle == Stance::Flies {
            let keys = [
                ("seconds", file.seconds.as_ref().map(Spanned::span)),
                ("limit_s", file.limit_s.as_ref().map(Spanned::span)),
                ("interrupt_s", file.interrupt_s.as_ref().map(Spanned::span)),
                ("tries", file.tries.as_ref().map(Spanned::span)),
                ("postcondition", file.postcondition.as_ref().map(Spanned::span)),
            ];
            for (key, span) in keys.into_iter().filter_map(|(key, span)| Some((key, span?))) {
                let message = format!("`{key}` is given, and the skill is used while the vehicle flies");
                self.say(Some(span), message, "take it out: the task begins and ends with the leg");
            }
            return;
        }
        for (key, is_given) in [("seconds", file.seconds.is_some()), ("limit_s", file.limit_s.is_some())] {
            if !is_given {
                let message = format!("`{key}` is missing: the skill is used while the vehicle {}", file.vehicle);
                self.say(None, message, "only `vehicle = \"flies\"` does without it");
            }
        }
    }

    fn interrupt(&mut self, it: Option<&Spanned<Number<0, 86_400>>>) -> f64 {
        let Some(it) = it else { return 0.0 };
        let seconds = it.as_ref().get();
        if LONGEST_INTERRUPT_S < seconds {
            let message = format!("`interrupt_s` is {seconds}, expected at most {LONGEST_INTERRUPT_S}");
            self.say(
                Some(it.span()),
                message,
                "an emergency waits for it: let the process do what takes longer before it ends",
            );
        }
        seconds
    }

    fn payload_command(&mut self, it: &MavlinkEntry, inputs: &[Input]) -> PayloadCommand {
        let name = it.command.as_ref();
        let command = PAYLOAD_COMMANDS.iter().find(|(known, _)| known == name);
        if command.is_none() {
            let known = PAYLOAD_COMMANDS.map(|(name, _)| name);
            let help = format!("{}one of {}", did_you_mean(name, &known), known.join(", "));
            self.say(Some(it.command.span()), format!("`{name}` does not command a payload"), &help);
        }
        let params = self.params(&it.params, inputs);
        let cancel = it.cancel.as_ref().map(|it| self.params(it, inputs));
        PayloadCommand { command: command.map_or(0, |(_, number)| *number), params, cancel }
    }

    fn params(&mut self, entries: &Spanned<Vec<Spanned<ParamEntry>>>, inputs: &[Input]) -> Vec<Param> {
        if MOST_PARAMS < entries.as_ref().len() {
            self.say(
                Some(entries.span()),
                format!("found {} parameters, expected at most {MOST_PARAMS}", entries.as_ref().len()),
                "",
            );
        }
        let param = |it: &Spanned<ParamEntry>| match it.as_ref() {
            ParamEntry::Number(number) => Param::Number(*number),
            ParamEntry::Input(name) => {
                if inputs.iter().all(|it| it.name != *name) {
                    let names: Vec<&str> = inputs.iter().map(|it| it.name.as_str()).collect();
                    self.say(Some(it.span()), format!("there is no input `{name}`"), &did_you_mean(name, &names));
                }
                Param::Input(name.clone())
            }
        };
        entries.as_ref().iter().map(param).collect()
    }

    fn condition(&mut self, it: Option<&Spanned<String>>) -> Option<Expression> {
        let it = it?;
        match Expression::parse(it.as_ref()) {
            Ok(expression) => Some(expression),
            Err(problem) => {
                self.problem(Some(it.span()), problem);
                None
            }
        }
    }

    /// Of a text at `span`.
    fn problem(&mut self, span: Option<Range<usize>>, problem: Problem) {
        // It stands behind its quote.
        let inside = span.map(|it| it.start + 1 + problem.span.start..it.start + 1 + problem.span.end);
        self.say(inside, problem.message, &problem.help);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::check_mistake;

    const GOOD: &str = r#"
version = 1
summary = "Lowers a load on a rope"
precondition = "vehicle.flying and position.height_m < 40 m"
invariant = "motion.ground_speed_m_s < 2 m/s"
seconds = "2 + 2 * length_m"
power_w = 40.0
limit_s = 60.0
interrupt_s = 5.0
[input.length_m]
least = 1.0
most = 20.0
[outcome]
done = "success"
snagged = "failure"
[mavlink]
command = "DO_WINCH"
params = [1, "length_m"]
"#;

    fn read(text: &str) -> Result<DeclaredSkill, Mistakes> {
        DeclaredSkill::read(&Source { path: "winch_down.toml".into(), text: text.into() })
    }

    #[test]
    fn a_declaration_says_what_a_task_takes() {
        let skill = read(GOOD).unwrap();
        let task = Task { skill: "winch_down".into(), inputs: vec![("length_m".into(), 12.0)] };
        let goal = skill.goal(&task, Ned::default());
        assert_eq!((goal.estimate_s, goal.limit_s, goal.interrupt_s, skill.tries), (26.0, 60.0, 5.0, 1));
        assert_eq!(goal.task.to_string(), "winch_down (length_m 12)");
        assert_eq!(skill.outcomes().collect::<Vec<_>>(), [("done", true), ("snagged", false)]);
    }

    #[test]
    fn a_task_that_no_declaration_allows_is_told() {
        #[track_caller]
        fn check(skill: &str, inputs: &[(&str, f64)], expected: Option<&str>) {
            check_at(10.0, skill, inputs, expected);
        }
        #[track_caller]
        fn check_at(height_m: f64, skill: &str, inputs: &[(&str, f64)], expected: Option<&str>) {
            let inputs = inputs.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
            let declared = DeclaredSkills::of(vec![read(GOOD).unwrap()]);
            let found = declared.misfit(&Task { skill: skill.into(), inputs }, Stance::Hovers, height_m);
            assert_eq!(found.map(|(message, _)| message).as_deref(), expected);
        }
        check("winch_down", &[("length_m", 12.0)], None);
        let too_high = "skill `winch_down` is used at 40 m, and asks for `vehicle.flying and position.height_m < 40 m`";
        check_at(40.0, "winch_down", &[("length_m", 12.0)], Some(too_high));
        check("winch_up", &[], Some("there is no declared skill `winch_up`"));
        check("winch_down", &[], Some("skill `winch_down` needs `length_m`"));
        check("winch_down", &[("length_m", 50.0)], Some("`length_m` of skill `winch_down` is 50, expected 1 to 20"));
        check("winch_down", &[("lenght_m", 5.0)], Some("skill `winch_down` has no input `lenght_m`"));
    }

    #[test]
    fn mistakes_are_told_with_their_place() {
        #[track_caller]
        fn check(find: &str, replace: &str, expected: &str) {
            let read = |text: &str| DeclaredSkill::read(&Source { path: "m.toml".into(), text: text.into() });
            check_mistake(GOOD, find, replace, read, expected);
        }
        check("power_w", "power", "m.toml:7:1: unknown field `power`");
        check("< 40 m", "< 2 m", "m.toml:4:16: precondition and invariant hold at no height at which a vehicle hovers");
        let seconds = "seconds = \"2 + 2 * length_m\"";
        let never = "seconds = 2.0\npostcondition = \"not vehicle.flying\"";
        check(seconds, never, "m.toml:7:17: the postcondition does not hold where the skill is used, such as at 10 m");
        check("< 40 m", "< 40 s", "m.toml:4:36: m and s are compared");
        check("vehicle.flying", "vehicle.flies", "m.toml:4:17: ");
        check(
            "limit_s = 60.0",
            "limit_s = 20.0",
            "m.toml:8:11: `limit_s` is 20 with length_m 20, and the skill takes 42 s",
        );
        check("2 * length_m", "2 * lenght_m", "m.toml:6:20: there is no input `lenght_m`");
        check("2 + 2", "9 - 2", "m.toml:6:11: `seconds` is -31 with length_m 20, expected 0 to 86400");
        check(seconds, "seconds = true", "m.toml:6:11: expected a number, or a text that calculates one from inputs");
        check("interrupt_s = 5.0", "interrupt_s = 60.0", "m.toml:9:15: `interrupt_s` is 60, expected at most 10");
        check("most = 20.0", "most = 0.5", "m.toml:12:8: `most` is 0.5, expected no less than `least`, which is 1");
        check("done = \"success\"", "done = \"failure\"", "m.toml:14:1: no outcome is a success");
        check("DO_WINCH", "NAV_LAND", "m.toml:18:11: `NAV_LAND` does not command a payload");
        check("[1, \"length_m\"]", "[1, \"length\"]", "m.toml:19:14: there is no input `length`");
        check("snagged", "error", "m.toml:16:1: `error` cannot name an outcome");
        check("length_m]\nleast", "skill]\nleast", "m.toml:10:8: `skill` cannot name an input");
        check("version = 1", "version = 0", "m.toml:2:11: ");
        check("snagged", "cancelled", "m.toml:16:1: `cancelled` cannot name an outcome");
        check("version = 1", "version = 1\nvehicle = \"swims\"", "m.toml:3:11: unknown variant `swims`");
        check("limit_s = 60.0\n", "", "m.toml: `limit_s` is missing: the skill is used while the vehicle hovers");
        let stands = "version = 1\nvehicle = \"stands\"";
        check("version = 1", stands, "m.toml:5:16: precondition and invariant do not hold while a vehicle stands");
    }

    #[test]
    fn a_skill_along_a_leg_takes_as_long_as_that() {
        #[track_caller]
        fn check(more: &str, expected: &str) {
            let flies = "version = 1\nsummary = \"Films\"\nvehicle = \"flies\"\noutcome = { done = \"success\" }\n";
            check_mistake(flies, "version = 1\n", &format!("version = 1\n{more}\n"), read, expected);
        }
        for (key, value) in [
            ("seconds", "2.0"),
            ("limit_s", "60.0"),
            ("interrupt_s", "5.0"),
            ("tries", "2"),
            ("postcondition", "\"vehicle.flying\""),
        ] {
            let message = format!("`{key}` is given, and the skill is used while the vehicle flies");
            check(&format!("{key} = {value}"), &format!("winch_down.toml:2:{}: {message}", key.len() + 4));
        }
        check(
            "invariant = \"position.height_m < 2 m\"",
            "winch_down.toml:2:13: precondition and invariant hold at no height",
        );
    }
}
