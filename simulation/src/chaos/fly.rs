//! Flies a script.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::Duration;

use domain::file::{Mistakes, Source};
use domain::mission::Mission;
use domain::time::Time;
use kittiwake_proto::topics::Service;
use kittiwake_proto::v1::operator_command::Verb;
use kittiwake_proto::v1::{self, DecisionRecord};
use witness::truth::Figures;

use super::draw::FLAGS;
use super::ending::Ending;
use super::hash::LogHash;
use super::oracle::{Decision, Evidence, Finding, judge};
use super::script::{Choice, Script};
use super::trouble::Trouble;
use crate::recording::{Entry, Header, Tape};
use crate::{Changes, Setup, Simulation};

/// From the last trouble until all ends that can end.
const SETTLES_AFTER: Duration = Duration::from_secs(30);
/// The same where there is other traffic, which comes from far away.
const TRAFFIC_PASSES_AFTER: Duration = Duration::from_secs(120);
/// From the last trouble until a mission that can end is over, with time for each hold and pause before another try.
const LIMIT: Duration = Duration::from_secs(3600);
/// After this an operator looks whether a flag that was lowered by hand is still up.
const LOOKS_AGAIN_AFTER: Duration = Duration::from_secs(10);
/// A while longer, for what must not happen after the end.
const AFTER: Duration = Duration::from_secs(60);

/// A script that was flown.
#[derive(Debug, Clone)]
pub struct Flight {
    /// What was flown.
    pub script: Script,
    /// How it ended.
    pub ending: Ending,
    /// What there is against it, in order.
    pub findings: Vec<Finding>,
    /// Of what was decided and when.
    pub hash: LogHash,
    /// Virtual time.
    pub flown: Duration,
    /// Every decision, in order.
    pub decisions: Vec<Decision>,
    /// What breaks no rule, and is counted.
    pub figures: Figures,
}

/// Flies it, with this configuration.
///
/// # Errors
/// Every mistake in the files.
pub fn fly(script: &Script, config: &Path) -> Result<Flight, Mistakes> {
    fly_with(script, config, None)
}

/// The same, recorded.
///
/// # Errors
/// Every mistake in the files.
pub fn fly_recorded(script: &Script, config: &Path) -> Result<(Flight, Header, Vec<Entry>), Mistakes> {
    let tape = Tape::default();
    let (path, text) = match &script.mission {
        Choice::Configured => (None, None),
        Choice::File(path) => (Some(path.as_path()), None),
        Choice::Drawn(text) => (None, Some(text.clone())),
    };
    let Script { seed, permissions, machine, .. } = *script;
    let header = Simulation::header(&Setup { config, mission: path, permissions, seed, machine }, text)?;
    let flight = fly_with(script, config, Some(tape.clone()))?;
    Ok((flight, header, tape.take_all()))
}

fn fly_with(script: &Script, config: &Path, tape: Option<Tape>) -> Result<Flight, Mistakes> {
    Ok(judged(script, simulation(script, config, tape)?))
}

/// Flies it in this simulation, which is that of its mission.
pub(crate) fn judged(script: &Script, mut simulation: Simulation<'_>) -> Flight {
    // A panic is a finding of this flight, not the end of the others.
    let panic = catch_unwind(AssertUnwindSafe(|| perform(&mut simulation, script))).err().map(|it| words(&*it));
    let records = simulation.decisions();
    let hash = LogHash::of(records.iter().map(|(at, it)| (*at, it.topic.as_str(), it.text.as_str())));
    let line = |(at, DecisionRecord { topic, text, .. }): (Time, DecisionRecord)| (at, format!("{topic}: {text}"));
    let key = |((process, service), count): (&(&'static str, Service), &u64)| (*process, service.key(), *count);
    let evidence = Evidence {
        ending: Ending::of(&simulation),
        until: simulation.now(),
        breaches: simulation.all_breaches(),
        mode_storm: simulation.mode_storm(),
        excursions: simulation.excursions(),
        stale: simulation.stale_setpoints(),
        unanswered: simulation.unanswered().iter().map(key).collect(),
        panic,
        decisions: records.into_iter().map(line).collect(),
    };
    let findings = judge(script, &evidence);
    let (flown, Evidence { ending, decisions, .. }) = (simulation.now().since_start(), evidence);
    let figures = simulation.figures();
    Flight { script: script.clone(), ending, findings, hash, flown, decisions, figures }
}

impl Flight {
    /// What happened and what was decided, by time.
    pub fn story(&self) -> Vec<(Duration, String)> {
        let troubles = self.script.troubles.iter().map(|(at, trouble)| (*at, format!("trouble: {trouble}")));
        let decisions = self.decisions.iter().map(|(at, text)| (at.since_start(), text.clone()));
        let mut story: Vec<_> = troubles.chain(decisions).collect();
        // What happens at one moment comes before what is decided then: the sort is stable.
        story.sort_by_key(|(at, _)| *at);
        story
    }
}

fn simulation(script: &Script, config: &Path, tape: Option<Tape>) -> Result<Simulation<'static>, Mistakes> {
    let (path, mission) = match &script.mission {
        Choice::Configured => (None, None),
        Choice::File(path) => (Some(path.as_path()), None),
        Choice::Drawn(text) => {
            let source = Source { path: "the drawn mission".into(), text: text.clone() };
            (None, Some(Mission::read(&source)?))
        }
    };
    let Script { seed, permissions, machine, grant_valid_s, .. } = *script;
    let setup = Setup { config, mission: path, permissions, seed, machine };
    let ground = match &mission {
        Some(_) => script.ground.clone(),
        None => Simulation::ground(&setup)?,
    };
    Simulation::changed(&setup, Changes { mission, grant_valid_s, tape, ground, ..Changes::default() })
}

fn perform(simulation: &mut Simulation<'_>, script: &Script) {
    for (at, trouble) in &script.troubles {
        simulation.pass(Time::after(*at) - simulation.now());
        befall(simulation, trouble);
    }
    if script.settles {
        settle(simulation, script);
    }
    fly_to_the_end(simulation, script);
    simulation.pass(AFTER);
}

/// A lowering that the bus lost, or that came while its receiver was dead, is repeated by an operator who sees the flag
/// still up: nothing on board takes down what was raised by hand.
fn fly_to_the_end(simulation: &mut Simulation<'_>, script: &Script) {
    let end = simulation.now() + LIMIT;
    while simulation.report().is_none() && simulation.now() < end {
        simulation.fly(LOOKS_AGAIN_AFTER.min(end - simulation.now()));
        if script.settles {
            let still_up: Vec<_> = raised_by_hand(script).filter(|it| simulation.is_up(it)).collect();
            still_up.iter().for_each(|it| simulation.lower_flag(it));
        }
    }
}

fn befall(simulation: &mut Simulation<'_>, trouble: &Trouble) {
    match trouble {
        Trouble::Fault { name, args } => {
            let args: Vec<&str> = args.iter().map(String::as_str).collect();
            simulation.inject_fault(name, &args);
        }
        Trouble::Flag(name) => simulation.inject_flag(name),
        Trouble::Order(verb) => simulation.order(verb.clone()),
        Trouble::Decide { area, decision, valid_for_s } => simulation.decide_for(area, *decision, *valid_for_s),
        Trouble::Hang { process, time } => simulation.freeze(process, *time),
        Trouble::Kill { process, time, memory } => simulation.restart(process, *time, *memory),
        Trouble::Disturb { disturbance, time } => simulation.disturb(*disturbance, *time),
        Trouble::Clock(by_ms) => simulation.set_clock(*by_ms),
        Trouble::Upload(text) => {
            let text = v1::MissionText { text: text.clone(), ..Default::default() };
            simulation.ask(v1::mission_request::Request::Upload(text));
        }
    }
}

/// All trouble ends that can end.
fn settle(simulation: &mut Simulation<'_>, script: &Script) {
    simulation.pass(if script.has_traffic() { TRAFFIC_PASSES_AFTER } else { SETTLES_AFTER });
    simulation.inject_fault("clear", &[]);
    raised_by_hand(script).for_each(|it| simulation.lower_flag(it));
    // What a process has forgotten, an operator accepts as forgotten.
    simulation.accept_loss();
    if simulation.report().is_none() && simulation.is_on_ground() {
        simulation.order(Verb::Start(v1::StartMission {}));
    }
    // A vehicle that has landed unplanned, or was paused, goes on when an operator says so.
    simulation.order(Verb::Resume(v1::ResumeMission {}));
}

/// The flags that are lowered by hand in the end: those that are drawn, and those that the script raises besides.
fn raised_by_hand(script: &Script) -> impl Iterator<Item = &str> {
    let of_script = script.troubles.iter().filter_map(|(_, trouble)| match trouble {
        Trouble::Flag(name) if !FLAGS.contains(&name.as_str()) => Some(name.as_str()),
        _ => None,
    });
    FLAGS.iter().copied().chain(of_script)
}

/// What a panic says.
fn words(panic: &(dyn Any + Send)) -> String {
    let said = panic.downcast_ref::<&str>().map(|it| (*it).to_owned());
    said.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "it says nothing".to_owned())
}
