//! Declared skills: what an integrator's own process can do, as `config/skills/NAME.toml` says. docs/skills.md has every key.
//!
//! The planner needs the inputs, the time and the energy; the monitor reads the conditions; the skill manager gets the limits with
//! each goal. None of them knows what the skill does.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::contingency::expression::estimate::Estimate;
use crate::contingency::expression::{Expression, Verdict};
use crate::contingency::snapshot::{Field, Snapshot};
use crate::file::{Mistake, Mistakes, Source, did_you_mean};
use crate::geometry::Ned;
use crate::mission::Objective;
use crate::payload_command::PayloadCommand;
use crate::task::{Stance, Task, TaskGoal, Value};

mod input;
mod read;

use input::{Input, InputKind, value_in, with};

/// In flight, conditions must hold this far above and below the height of a task too, in metres: an autopilot comes no nearer to a height.
/// (ENG: 0.4 m after a descent in the simulator, half a metre with ArduPilot.)
pub const ROOM_M: f64 = 0.5;
/// Where a task needs another height than its objective, multiples of this are tried, with as much room; then of half, with half the room.
const WIDE_M: f64 = 2.0 * ROOM_M;
/// The lowest height that is tried, in metres. (ENG: lower an autopilot may take hovering for a landing.)
const LOWEST_M: f64 = 2.0;
/// The highest one, as high as a vehicle flies. (The planner's `highest_m`.)
const HIGHEST_M: f64 = 120.0;
/// The height that is asked for where no mission says one.
const USUAL_HEIGHT_M: f64 = 10.0;
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
    /// The payloads that no other skill uses meanwhile, by names of their own.
    takes: Vec<String>,
    inputs: Vec<Input>,
    seconds: Estimate,
    power_w: Estimate,
    limit_s: Estimate,
    interrupt_s: f64,
    /// How often it is tried at one place before the objective is given up.
    pub tries: u32,
    /// Where it can be used, above the take-off point.
    heights_m: Vec<f64>,
    succeeds_as: Vec<String>,
    fails_as: Vec<String>,
    /// The command for an autopilot that carries the skill out itself; `None`: a process does.
    pub payload_command: Option<PayloadCommand>,
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
            if path.extension().is_some_and(|it| it.eq_ignore_ascii_case("toml")) {
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
            let twice = || Some((self.taken_twice(&terms.along)?.1, String::new()));
            let misfit = tasks.into_iter().find_map(|(it, stance)| self.misfit(it, stance, height_m));
            let (message, help) = misfit.or_else(twice)?;
            let help = if help.is_empty() { help } else { format!(": {help}") };
            Some(format!("objective `{}`: {message}{help}", objective.name))
        })
    }

    /// Of tasks along one leg, the first that takes what one before it takes: its index, and a sentence.
    pub fn taken_twice(&self, along: &[Task]) -> Option<(usize, String)> {
        let mut taken: BTreeMap<&str, &str> = BTreeMap::new();
        along.iter().enumerate().find_map(|(index, task)| {
            let skill = self.get(&task.skill)?;
            skill.needs_alone().find_map(|it| {
                let other = taken.insert(it, &skill.name)?;
                Some((index, format!("`along` names `{other}` and `{}`, and both take `{it}`", skill.name)))
            })
        })
    }

    /// Why a task cannot be done by any of these while the vehicle does that at this height, and how to mend that; `None` if it can. One that
    /// hovers goes to the height that the task asks for.
    pub fn misfit(&self, task: &Task, stance: Stance, height_m: f64) -> Option<(String, String)> {
        let Some(skill) = self.get(&task.skill) else {
            let names: Vec<&str> = self.0.iter().map(|it| it.name.as_str()).collect();
            return Some((format!("there is no declared skill `{}`", task.skill), did_you_mean(&task.skill, &names)));
        };
        skill.misfit(task, stance, height_m)
    }

    /// At which height a task of an objective at `height_m` is done: there, or as near to that as its conditions allow. `None` if it cannot be
    /// done.
    pub fn height_m(&self, task: &Task, stance: Stance, height_m: f64) -> Option<f64> {
        self.get(&task.skill).filter(|it| it.misfit(task, stance, height_m).is_none())?.height_near_m(height_m)
    }
}

impl DeclaredSkill {
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
            let name = &input.name;
            match input.of(task) {
                None => {
                    Some((format!("skill `{skill}` needs `{name}`"), format!("add `{name}`, {}", input.expected())))
                }
                Some(value) => {
                    let expected = input.unfit(&value)?;
                    Some((format!("`{name}` of skill `{skill}` is {value}, expected {expected}"), String::new()))
                }
            }
        });
        bad_input.or_else(|| self.bad_estimate(task)).or_else(|| self.bad_height(height_m))
    }

    /// Its numbers by their names; the greatest of one that the task does not say.
    fn values(&self, task: &Task) -> Vec<(String, f64)> {
        let value = |it: &Input| match it.kind {
            InputKind::Number { most, .. } => {
                Some((it.name.clone(), it.of(task).and_then(|it| it.number()).unwrap_or(most)))
            }
            InputKind::Text(_) => None,
        };
        self.inputs.iter().filter_map(value).collect()
    }

    /// The extremes were tried when it was read; between them it may be anything.
    fn bad_estimate(&self, task: &Task) -> Option<(String, String)> {
        let values = self.values(task);
        let of = |it: &Estimate| it.value(&value_in(&values));
        let fits = |it: &f64| (0.0..=LONGEST_LEG_S).contains(it);
        let (seconds, limit_s) = (of(&self.seconds), of(&self.limit_s));
        let is_good = [seconds, limit_s, of(&self.power_w)].iter().all(fits) && 0.0 < limit_s && seconds <= limit_s;
        (!is_good).then(|| {
            let (name, power_w, with) = (&self.name, of(&self.power_w), with(&values));
            let message =
                format!("skill `{name}` takes {seconds} s, has failed after {limit_s} s, takes {power_w} W{with}");
            let help = format!("`limit_s` is above 0 and no less than `seconds`, and nothing above {LONGEST_LEG_S}");
            (message, help)
        })
    }

    /// A leg is flown at its height, and the ground is where it is.
    fn bad_height(&self, height_m: f64) -> Option<(String, String)> {
        let unmet = self.unmet_at(height_m, ROOM_M).filter(|_| self.stance != Stance::Hovers)?;
        let message = format!("skill `{}` is used at {height_m} m, and asks for `{}`", self.name, unmet.text());
        let help = match self.stance {
            Stance::Stands => String::new(),
            _ => format!("set `height_m` of the objective so that this holds, and {ROOM_M} m above and below"),
        };
        Some((message, help))
    }

    /// The task with this as its `every_m`, if the skill has such an input and the task leaves it out.
    pub fn with_every_m(&self, mut task: Task, every_m: f64) -> Task {
        const NAME: &str = "every_m";
        let is_given = task.inputs.iter().any(|(name, _)| name == NAME);
        if !is_given && self.inputs.iter().any(|it| it.name == NAME) {
            task.inputs.push((NAME.to_owned(), every_m.into()));
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

    /// A height at which it can be used while all is well, in metres.
    pub fn usable_at_m(&self) -> Option<f64> {
        self.height_near_m(if self.stance == Stance::Stands { 0.0 } else { USUAL_HEIGHT_M })
    }

    /// This height, or the nearest one at which it can be used.
    fn height_near_m(&self, height_m: f64) -> Option<f64> {
        let apart_m = |it: &f64| (it - height_m).abs();
        let nearest = || self.heights_m.iter().copied().min_by(|a, b| apart_m(a).total_cmp(&apart_m(b)));
        if self.unmet_at(height_m, ROOM_M).is_none() { Some(height_m) } else { nearest() }
    }

    /// The heights at which it can be used in flight.
    fn find_heights_m(&self) -> Vec<f64> {
        let with_room = |room_m: f64| {
            let heights_m = (0..).map(|it| LOWEST_M + f64::from(it) * room_m).take_while(|it| *it <= HIGHEST_M);
            heights_m.filter(|it| self.unmet_at(*it, room_m).is_none()).collect::<Vec<_>>()
        };
        if self.stance == Stance::Stands {
            return Vec::new();
        }
        Some(with_room(WIDE_M)).filter(|it| !it.is_empty()).unwrap_or_else(|| with_room(ROOM_M))
    }

    /// The condition that does not hold there, or as much above or below.
    fn unmet_at(&self, height_m: f64, room_m: f64) -> Option<&Expression> {
        let room_m = if self.stance == Stance::Stands { 0.0 } else { room_m };
        let usual = [-room_m, 0.0, room_m].map(|it| usual(self.stance, height_m + it));
        let mut conditions = [&self.precondition, &self.invariant].into_iter().flatten();
        conditions.find(|it| usual.iter().any(|usual| it.verdict(usual) == Verdict::DoesNotHold))
    }

    /// A task with these inputs, for the others their usual value, or the least or first one.
    pub fn example(&self, inputs: &[(String, Value)]) -> Task {
        let given = |name: &str| inputs.iter().find(|(it, _)| it == name).map(|(_, value)| value.clone());
        let other = |it: &Input| it.usual.clone().unwrap_or_else(|| it.first());
        let known = self.inputs.iter().map(|it| (it.name.clone(), given(&it.name).unwrap_or_else(|| other(it))));
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
        let motion = (self.stance != Stance::Flies).then_some(MOTION);
        let takes: Vec<&str> = motion.into_iter().chain(self.takes.iter().map(String::as_str)).collect();
        let takes = if takes.is_empty() { String::new() } else { format!("; takes {}", takes.join(", ")) };
        let stance = format!("while the vehicle {}{takes}", self.stance);
        let ends = format!("ends as {}", outcomes.collect::<Vec<_>>().join(", "));
        std::iter::once(stance).chain(inputs).chain(conditions).chain([limits, ends]).collect()
    }

    /// What it shares with no skill that runs beside it: its process, its command, its payloads.
    fn needs_alone(&self) -> impl Iterator<Item = &str> {
        let command = self.payload_command.as_ref().map(PayloadCommand::name);
        std::iter::once(self.name.as_str()).chain(command).chain(self.takes.iter().map(String::as_str))
    }

    /// Each of its outcomes, and whether it is a success.
    pub fn outcomes(&self) -> impl Iterator<Item = (&str, bool)> {
        self.succeeds_as.iter().map(|it| (it.as_str(), true)).chain(self.fails_as.iter().map(|it| (it.as_str(), false)))
    }
}

/// The fields that are known before a flight: what the vehicle does, and at which height. The others are judged in flight.
fn usual(stance: Stance, height_m: f64) -> Snapshot {
    let mut usual = Snapshot::UNKNOWN;
    usual.set(Field::Height, Some(height_m));
    usual.set_truth(Field::Flying, Some(stance != Stance::Stands));
    match stance {
        Stance::Hovers => {
            usual.set_truth(Field::Armed, Some(true));
            usual.set(Field::GroundSpeed, Some(0.0));
            usual.set_choice(Field::Mode, "loiter");
            usual.set_choice(Field::IntendedMode, "loiter");
        }
        Stance::Flies => usual.set_truth(Field::Armed, Some(true)),
        // After a landing an autopilot disarms some time, and its mode means nothing.
        Stance::Stands => usual.set(Field::GroundSpeed, Some(0.0)),
    }
    usual
}

/// The outcome of a task that was ended by an order: no declaration has it.
pub const CANCELLED: &str = "cancelled";

pub(crate) const NAMES: &str =
    "a name has up to 40 of a-z, 0-9 and _, begins with a letter, and has no meaning of its own (docs/skills.md)";

/// The outcomes of tasks that did not end by themselves: no declaration has them.
const RESERVED: [&str; 4] = [CANCELLED, "error", "refused", "unanswered"];
/// A skill that every vehicle has.
#[derive(Debug)]
pub struct BuiltIn {
    /// Its name; no declaration has it.
    pub name: &'static str,
    /// What it does, for people.
    pub summary: &'static str,
    /// What the vehicle does meanwhile.
    pub stance: Stance,
    /// What no other skill uses meanwhile.
    pub takes: &'static str,
}

/// All of them.
pub const BUILT_IN: [BuiltIn; 5] = [
    BuiltIn {
        name: "takeoff",
        summary: "Arms if necessary and climbs straight up",
        stance: Stance::Flies,
        takes: MOTION,
    },
    BuiltIn {
        name: "land",
        summary: "Lands where the vehicle is, or on a target that its sensor sees there (`land_on_target = true`)",
        stance: Stance::Flies,
        takes: MOTION,
    },
    BuiltIn { name: "stop", summary: "Comes to rest and hovers", stance: Stance::Hovers, takes: MOTION },
    BuiltIn {
        name: "offboard",
        summary: "Flies straight to a place by setpoints, or at a velocity",
        stance: Stance::Flies,
        takes: MOTION,
    },
    BuiltIn {
        name: "release",
        summary: "Opens the gripper, hovering over a place (`drop = true`)",
        stance: Stance::Hovers,
        takes: "motion, gripper",
    },
];

/// What a skill takes that moves the vehicle, or needs it to stay.
const MOTION: &str = "motion";

fn is_built_in(name: &str) -> bool {
    // The kind of all declared skills is `task`.
    name == "task" || BUILT_IN.iter().any(|it| it.name == name)
}

pub(crate) fn is_name(name: &str) -> bool {
    let rest = |it: char| it.is_ascii_lowercase() || it.is_ascii_digit() || it == '_';
    name.starts_with(|it: char| it.is_ascii_lowercase()) && name.len() <= LONGEST_NAME && name.chars().all(rest)
}

#[cfg(test)]
mod tests;
