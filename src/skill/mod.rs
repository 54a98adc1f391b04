//! `kittiwake skill`: the declared skills, and an examination of a process that carries one out.

mod exam;
mod examiner;

use std::path::PathBuf;

use clap::{Args, Subcommand};
use domain::aircraft::Aircraft;
use domain::declared_skill::{BUILT_IN, DeclaredSkills};
use domain::energy::Wind;
use domain::file::did_you_mean;
use domain::task::Value;

use crate::check_inputs;
use crate::cli::TargetArgs;
use crate::outcome::Outcome;
use crate::output;
use crate::settings::{Settings, default_config};
use crate::target::Target;
use exam::Author;

/// For `kittiwake skill`.
#[derive(Debug, Args)]
pub struct SkillArgs {
    #[command(subcommand)]
    pub command: SkillCommand,
}

/// What to do with skills.
#[derive(Debug, Subcommand)]
pub enum SkillCommand {
    /// List the skills that every vehicle has, and those that are declared
    List {
        /// The configuration file, which names the folder of the declarations
        #[arg(long, value_name = "FILE", default_value_os_t = default_config())]
        config: PathBuf,
    },
    /// Examine a process that carries out a declared skill: order its tasks, cancel them, order twice; nothing flies
    Test(TestArgs),
}

/// For `kittiwake skill test`.
#[derive(Debug, Args)]
#[command(
    after_help = "Start a router first: kittiwake run router. Then the process with the locator it prints, or let it be started here:\n  \
                  kittiwake skill test winch_down --connect LOCATOR -- python3 winch.py --connect LOCATOR\n\
                        Exit code 0 if it passes everything, 1 if not"
)]
pub struct TestArgs {
    /// The declared skill
    #[arg(value_name = "NAME")]
    pub name: String,
    /// An input, such as `length_m=5` or `side=left`; without it its usual value, or the least or first one
    #[arg(long = "input", value_name = "NAME=VALUE", value_parser = read_input)]
    pub inputs: Vec<(String, Value)>,
    #[command(flatten)]
    pub target: TargetArgs,
    /// The command that starts the process, after `--`: it is started here, and its restart is examined too
    #[arg(value_name = "COMMAND", last = true)]
    pub author: Vec<String>,
}

fn read_input(text: &str) -> Result<(String, Value), String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE, such as length_m=5")?;
    let value = value.parse().map_or_else(|_| Value::Text(value.to_owned()), Value::Number);
    Ok((name.to_owned(), value))
}

/// Does what the arguments say.
pub fn skill(args: &SkillArgs) -> Outcome {
    match &args.command {
        SkillCommand::List { config } => match check_inputs::read_or_tell(&Settings::of_file(config)) {
            Ok(inputs) => list(&inputs.skills, &inputs.config.aircraft()),
            Err(outcome) => outcome,
        },
        SkillCommand::Test(args) => test(args),
    }
}

fn read(config: PathBuf) -> Result<DeclaredSkills, Outcome> {
    check_inputs::read_or_tell(&Settings::of_file(&config)).map(|it| it.skills)
}

fn list(skills: &DeclaredSkills, aircraft: &Aircraft) -> Outcome {
    let width = skills.all().iter().map(|it| it.name.len()).max().unwrap_or_default().max(16);
    for skill in BUILT_IN {
        output::line(format_args!("{:width$} built in    {}", skill.name, skill.summary));
        output::line(format_args!("{:3$} while the vehicle {}; takes {}", "", skill.stance, skill.takes, width + 12));
        output::line(format_args!("{:2$} {}", "", costs(skill.name, aircraft), width + 12));
    }
    for skill in skills.all() {
        output::line(format_args!("{:width$} version {:3} {}", skill.name, skill.version, skill.summary));
        for line in skill.in_words() {
            output::line(format_args!("{:1$} {line}", "", width + 12));
        }
    }
    Outcome::Success
}

/// What a skill that every vehicle has costs in still air, by the configuration.
fn costs(name: &str, aircraft: &Aircraft) -> String {
    let flight = &aircraft.flight;
    let (over_ground_m_s, up_m_s) = match name {
        "takeoff" => (0.0, flight.climb_m_s.get()),
        "land" => (0.0, -flight.descent_m_s.get()),
        "offboard" => (flight.cruise_m_s.get(), 0.0),
        _ => (0.0, 0.0),
    };
    let power = format!("{:.0} W in all", aircraft.energy.flight_w((over_ground_m_s, 0.0), up_m_s, Wind::CALM));
    let speed_m_s = over_ground_m_s.max(up_m_s.abs());
    if speed_m_s == 0.0 { power } else { format!("{:.2} s for each metre; {power}", 1.0 / speed_m_s) }
}

fn test(args: &TestArgs) -> Outcome {
    let target = match Target::find(&args.target) {
        Ok(target) => target,
        Err(cause) => {
            output::error_line(cause);
            return Outcome::Unavailable;
        }
    };
    let config = target.config.clone().unwrap_or_else(default_config);
    let skills = match read(config) {
        Ok(skills) => skills,
        Err(outcome) => return outcome,
    };
    let Some(skill) = skills.get(&args.name) else {
        let names: Vec<&str> = skills.all().iter().map(|it| it.name.as_str()).collect();
        output::error_line(format_args!("no declared skill `{}`: {}", args.name, did_you_mean(&args.name, &names)));
        return Outcome::BadInput;
    };
    let task = skill.example(&args.inputs);
    if let Some((message, help)) = skills.misfit(&task, skill.stance, skill.usable_at_m().unwrap_or_default()) {
        output::error_line(format_args!("{message}\n  help: {help}"));
        return Outcome::BadInput;
    }
    let author = match (!args.author.is_empty()).then(|| Author::start(&args.author)).transpose() {
        Ok(author) => author,
        Err(cause) => {
            output::error_line(cause);
            return Outcome::Unavailable;
        }
    };
    let told = exam::examine(skill, &task, (&target.connect, &target.vehicle), author, |result| {
        let mark = if result.passed { "pass" } else { "FAIL" };
        output::line(format_args!("{mark}  {:50} {}", result.case, result.seen));
    });
    match told {
        Ok(true) => Outcome::Success,
        Ok(false) => Outcome::Breached,
        Err(cause) => {
            output::error_line(cause);
            Outcome::Unavailable
        }
    }
}
