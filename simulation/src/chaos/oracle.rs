//! What there is against a flight: a pure function of its observations.

use std::fmt;

use domain::time::Time;
use kittiwake_proto::v1::MissionOutcome;
use witness::Breach;
use witness::modes::ModeStorm;
use witness::setpoints::StaleSetpoint;
use witness::truth;

use super::ending::Ending;
use super::script::Script;
use crate::bounds::Excursion;

/// Decisions that are reported with a finding.
const BEFORE: usize = 10;

/// A decision and when.
pub type Decision = (Time, String);

/// What was seen of a flight.
#[derive(Debug, Clone)]
pub struct Evidence {
    /// How it ended.
    pub ending: Ending,
    /// When it was looked at last.
    pub until: Time,
    /// What the witness saw.
    pub breaches: Vec<Breach>,
    /// The first change of the commanded mode without a cause.
    pub mode_storm: Option<ModeStorm>,
    /// What was outside of the bounds of height and energy.
    pub excursions: Vec<Excursion>,
    /// Setpoints that were too old.
    pub stale: Vec<StaleSetpoint>,
    /// Requests that a process has left without a reply: process, service, how often.
    pub unanswered: Vec<(&'static str, &'static str, u64)>,
    /// A panic, in its own words.
    pub panic: Option<String>,
    /// Every decision, in order.
    pub decisions: Vec<Decision>,
}

/// What a flight must keep to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rule {
    /// Never in an area without a permission, and out in time.
    Airspace,
    /// No takeoff after the end, or in answer to a flag.
    Takeoff,
    /// Never higher than is allowed.
    Height,
    /// Never on below the energy reserve with nothing that responds.
    Energy,
    /// A vehicle in the air has somebody who responds.
    Response,
    /// No more changes of the mode than causes explain.
    Modes,
    /// No flight after a setpoint that is too old.
    Setpoint,
    /// Every request is answered.
    Reply,
    /// Every flight ends: the mission done, landed at a listed place, down with a reason, or holding with a reason.
    End,
    /// No process panics.
    Panic,
    /// One over the truth, which the simulator shows.
    Truth(truth::Rule),
}

/// Something against a flight.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Of the flight.
    pub seed: u64,
    /// Which rule it breaks.
    pub rule: Rule,
    /// When.
    pub at: Time,
    /// The process that broke it, where one did.
    pub process: Option<&'static str>,
    /// What happened.
    pub what: String,
    /// The last decisions before.
    pub before: Vec<Decision>,
}

/// What there is against a flight of `script`.
pub fn judge(script: &Script, seen: &Evidence) -> Vec<Finding> {
    let mut findings = Vec::new();
    let mut find = |rule: Rule, at: Time, process: Option<&'static str>, what: String| {
        let earlier = seen.decisions.partition_point(|(decided, _)| *decided <= at);
        let before = seen.decisions[earlier.saturating_sub(BEFORE)..earlier].to_vec();
        findings.push(Finding { seed: script.seed, rule, at, process, what, before });
    };
    if let Some(panic) = &seen.panic {
        // The flight's outcome is not known.
        find(Rule::Panic, seen.until, None, format!("a process panicked: {panic}"));
        return findings;
    }
    for breach in seen.breaches.iter().filter(|it| is_judged(script, rule(it))) {
        find(rule(breach), breach.at(), None, breach.what());
    }
    for excursion in &seen.excursions {
        let rule = match excursion {
            Excursion::Height { .. } if !script.knows_its_place() => continue,
            Excursion::Height { .. } => Rule::Height,
            Excursion::Energy { .. } => Rule::Energy,
        };
        find(rule, excursion.at(), None, excursion.what());
    }
    if let Some(ModeStorm { at, changes, causes }) = seen.mode_storm {
        let what = format!("the mode was commanded to change {changes} times for {causes} causes");
        find(Rule::Modes, at, Some("mcm"), what);
    }
    for StaleSetpoint { at, age } in seen.stale.iter().filter(|_| script.tells_its_mode()) {
        let what = format!("the vehicle flew offboard after a setpoint {:.1} s old", age.as_secs_f64());
        find(Rule::Setpoint, *at, Some("vehicle-sim"), what);
    }
    for (process, service, count) in &seen.unanswered {
        let what = format!("{count} requests to {service} were left without a reply");
        find(Rule::Reply, seen.until, Some(*process), what);
    }
    if let Some(what) = not_ended(script, &seen.ending) {
        find(Rule::End, seen.until, None, format!("{what}: {}", seen.ending));
    }
    findings.sort_by_key(|it| (it.at, it.rule));
    findings
}

/// Whether it counts in this flight: a vehicle that does not know where it is, or is blown away, does not choose where it flies.
fn is_judged(script: &Script, rule: Rule) -> bool {
    match rule {
        Rule::Response | Rule::Truth(truth::Rule::Progress | truth::Rule::Flapping) => true,
        // Wind is what is judged there.
        Rule::Truth(truth::Rule::Reserve) => script.knows_its_place_in_wind() && script.flies_its_speed(),
        _ => script.knows_its_place(),
    }
}

fn rule(breach: &Breach) -> Rule {
    match breach {
        Breach::Truth { rule, .. } => Rule::Truth(*rule),
        Breach::Entered { .. } | Breach::Stayed { .. } | Breach::Unlisted { .. } => Rule::Airspace,
        Breach::TookOff { .. } => Rule::Takeoff,
        // The one who flies the vehicle responds.
        Breach::NoResponder { .. } | Breach::Fought { .. } | Breach::EndedFailsafe { .. } => Rule::Response,
    }
}

/// What is wrong with the end, if anything is.
fn not_ended(script: &Script, ending: &Ending) -> Option<&'static str> {
    match ending {
        Ending::Over { outcome: MissionOutcome::Crash, .. } => {
            script.knows_its_place().then_some("the vehicle crashed")
        }
        Ending::Over { outcome: MissionOutcome::Success, place: None, .. } => {
            script.knows_its_place().then_some("the mission is done, and the vehicle stands at no listed place")
        }
        Ending::Over { reason, place: None, .. } if reason.is_empty() => {
            Some("the vehicle came down elsewhere without a reason")
        }
        Ending::Over { .. } => None,
        Ending::Waits(_) if script.empties_battery() => None,
        Ending::Waits(_) | Ending::Holds(_) => {
            script.settles.then_some("all trouble had ended, and the mission is not over")
        }
        Ending::Adrift { .. } => Some("it neither landed nor holds for a reason"),
    }
}

/// One word.
impl fmt::Display for Rule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = match self {
            Rule::Truth(rule) => format!("{rule:?}"),
            rule => format!("{rule:?}"),
        };
        f.write_str(&word.to_lowercase())
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let by = self.process.map_or(String::new(), |it| format!(" ({it})"));
        write!(f, "seed {}, {:.1} s{by}: {}", self.seed, self.at.as_secs_f64(), self.what)
    }
}

#[cfg(test)]
mod tests;
