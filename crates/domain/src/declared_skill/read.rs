//! A declaration's file, read and checked.

use std::collections::BTreeMap;
use std::num::{NonZeroU8, NonZeroU32};
use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;

use super::input::{Input, InputKind, MOST_INPUTS, TEXTS, corners, is_text, value_in, with};
use super::{
    DeclaredSkill, HIGHEST_M, LONGEST_LEG_S, LOWEST_M, MOTION, NAMES, RESERVED, ROOM_M, USUAL_HEIGHT_M, is_built_in,
    is_name, usual,
};
use crate::contingency::expression::estimate::Estimate;
use crate::contingency::expression::{Expression, Problem, Verdict};
use crate::control_character::is_control;
use crate::file::{Mistakes, Source, did_you_mean};
use crate::payload_command::{PAYLOAD_COMMANDS, Param, PayloadCommand};
use crate::quantity::Number;
use crate::task::{Stance, Value};

/// Most seconds that another skill waits for an interrupted one: an emergency cannot wait longer. (ENG)
const LONGEST_INTERRUPT_S: f64 = 10.0;

/// Parameters of a command of MAVLink.
const MOST_PARAMS: usize = 7;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    version: NonZeroU32,
    summary: Spanned<String>,
    precondition: Option<Spanned<String>>,
    invariant: Option<Spanned<String>>,
    postcondition: Option<Spanned<String>>,
    #[serde(default)]
    vehicle: Stance,
    #[serde(default)]
    takes: Vec<Spanned<String>>,
    seconds: Option<Spanned<EstimateEntry>>,
    power_w: Option<Spanned<EstimateEntry>>,
    limit_s: Option<Spanned<EstimateEntry>>,
    interrupt_s: Option<Spanned<Number<0, 86_400>>>,
    tries: Option<Spanned<NonZeroU8>>,
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
    #[serde(default)]
    done: Done,
}

/// What shows that the autopilot does what it was told.
#[derive(Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Done {
    #[default]
    Acknowledged,
    Picture,
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
    least: Option<Spanned<f64>>,
    most: Option<Spanned<f64>>,
    /// It is a text.
    #[serde(default)]
    text: bool,
    /// One of these.
    #[serde(default)]
    choices: Vec<Spanned<String>>,
    usual: Option<Spanned<Value>>,
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
        let kind = match (it.text || !it.choices.is_empty(), &it.least, &it.most) {
            (true, None, None) => {
                for choice in it.choices.iter().filter(|it| !is_text(it.as_ref())) {
                    self.say(Some(choice.span()), format!("{:?} cannot be chosen", choice.as_ref()), TEXTS);
                }
                InputKind::Text(it.choices.iter().map(|it| it.as_ref().clone()).collect())
            }
            (false, Some(least), Some(most)) => {
                let (most_span, least, most) = (most.span(), *least.as_ref(), *most.as_ref());
                if !(least.is_finite() && most.is_finite() && least <= most) {
                    let message = format!("`most` is {most}, expected no less than `least`, which is {least}");
                    self.say(Some(most_span), message, "");
                }
                InputKind::Number { least, most }
            }
            _ => {
                let message = format!("input `{}` is neither a number nor a text", name.as_ref());
                self.say(Some(name.span()), message, "give `least` and `most`, or `text = true`, or `choices = [..]`");
                InputKind::Text(Vec::new())
            }
        };
        let input = Input { name: name.as_ref().clone(), kind, usual: it.usual.as_ref().map(|it| it.as_ref().clone()) };
        if let Some((usual, expected)) = it.usual.as_ref().and_then(|it| Some((it, input.unfit(it.as_ref())?))) {
            self.say(Some(usual.span()), format!("`usual` is {}, expected {expected}", usual.as_ref()), "");
        }
        input
    }

    /// What `key` comes to, `usual` without it: from 0 to a day for the least and the greatest inputs.
    fn estimate(&mut self, key: &str, it: Option<&Spanned<EstimateEntry>>, usual: f64, inputs: &[Input]) -> Estimate {
        let is_number = |it: &&Input| matches!(it.kind, InputKind::Number { .. });
        let names: Vec<&str> = inputs.iter().filter(is_number).map(|it| it.name.as_str()).collect();
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
        if MOST_INPUTS < inputs.len() {
            return estimate;
        }
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

    fn summary(&mut self, text: &Spanned<String>) -> String {
        if text.as_ref().trim().is_empty() || text.as_ref().chars().any(is_control) {
            self.say(
                Some(text.span()),
                "`summary` is empty, or has a control character",
                "say in a sentence what the skill does",
            );
        }
        text.as_ref().clone()
    }

    fn takes(&mut self, entries: &[Spanned<String>]) -> Vec<String> {
        for entry in entries {
            if entry.as_ref() == MOTION {
                let help = "take it out: `vehicle` says what the vehicle does meanwhile, and the mission moves it";
                self.say(Some(entry.span()), format!("no declared skill takes `{MOTION}`"), help);
            } else if !is_name(entry.as_ref()) {
                self.say(Some(entry.span()), format!("{:?} cannot name a payload", entry.as_ref()), NAMES);
            }
        }
        entries.iter().map(|it| it.as_ref().clone()).collect()
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
        let command = command.map_or(0, |(_, number)| *number);
        PayloadCommand { command, params, cancel, takes_pictures: it.done == Done::Picture }
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
            ParamEntry::Number(number) => {
                if f64::from(f32::MAX) < number.abs() || number.is_nan() {
                    self.say(Some(it.span()), format!("a command cannot carry the number {number}"), "");
                }
                Param::Number(*number)
            }
            ParamEntry::Input(name) => {
                let is_number = |it: &&Input| matches!(it.kind, InputKind::Number { .. });
                let names: Vec<&str> = inputs.iter().filter(is_number).map(|it| it.name.as_str()).collect();
                if !names.contains(&name.as_str()) {
                    let message = format!("there is no input `{name}` that is a number");
                    self.say(Some(it.span()), message, &did_you_mean(name, &names));
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
        let mut skill = DeclaredSkill {
            name,
            version: file.version.get(),
            summary: check.summary(&file.summary),
            precondition: check.condition(file.precondition.as_ref()),
            invariant: check.condition(file.invariant.as_ref()),
            postcondition: check.condition(file.postcondition.as_ref()),
            stance,
            takes: check.takes(&file.takes),
            seconds: check.estimate("seconds", file.seconds.as_ref(), 0.0, &inputs),
            power_w: check.estimate("power_w", file.power_w.as_ref(), 0.0, &inputs),
            limit_s: check.estimate("limit_s", file.limit_s.as_ref(), LONGEST_LEG_S, &inputs),
            inputs,
            heights_m: Vec::new(),
            interrupt_s,
            tries: file.tries.as_ref().map_or(1, |it| u32::from(it.as_ref().get())),
            succeeds_as,
            fails_as: outcomes(Meaning::Failure),
            payload_command,
        };
        skill.heights_m = skill.find_heights_m();
        let too_long = corners(&skill.inputs).into_iter().find_map(|it| {
            let (seconds, limit_s) = (skill.seconds.value(&value_in(&it)), skill.limit_s.value(&value_in(&it)));
            (limit_s <= 0.0 || limit_s < seconds)
                .then(|| format!("`limit_s` is {limit_s}{}, and the skill takes {seconds} s", with(&it)))
        });
        if let Some((limit, message)) = file.limit_s.as_ref().zip(too_long) {
            check.say(Some(limit.span()), message, "raise it: a skill that is as slow as declared has not failed");
        }
        match (skill.usable_at_m(), &skill.postcondition) {
            (None, _) => {
                let unmet = skill.unmet_at(if stance == Stance::Stands { 0.0 } else { USUAL_HEIGHT_M }, ROOM_M);
                let of_invariant = skill.precondition.is_none() || unmet.is_some() && unmet == skill.invariant.as_ref();
                let span = if of_invariant { &file.invariant } else { &file.precondition }.as_ref().map(Spanned::span);
                let (message, help) = match stance {
                    Stance::Stands => {
                        ("it does not hold while a vehicle stands on the ground".to_owned(), String::new())
                    }
                    Stance::Hovers | Stance::Flies => (
                        format!("precondition and invariant hold at no height at which a vehicle {stance}"),
                        format!("tried from {LOWEST_M} to {HIGHEST_M} m, with {ROOM_M} m of room above and below"),
                    ),
                };
                check.say(span, message, &help);
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
}
