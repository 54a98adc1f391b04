//! What is printed about simulated flights.

use std::collections::BTreeMap;
use std::time::Duration;

use serde_json::{Value, json};
use simulation::chaos::fly::Flight;
use simulation::chaos::hash::LogHash;
use simulation::chaos::oracle::Finding;
use simulation::chaos::script::Choice;

use super::args::SimulateArgs;
use super::times_real_time;

/// One line about a flight.
pub fn run(flight: &Flight) -> String {
    let verdict = if flight.findings.is_empty() { "ok" } else { "BREACH" };
    let (seed, flown_s) = (flight.script.seed, flight.flown.as_secs_f64());
    let (ending, script, hash) = (&flight.ending, &flight.script, flight.hash);
    format!("seed {seed}  {verdict}  {ending}  [{script}]  {flown_s:.0} s flown  sha256 {hash}")
}

/// What happened and what was decided.
pub fn story(flight: &Flight) -> String {
    let line = |(at, what): (Duration, String)| format!("{:9.2} s  {what}", at.as_secs_f64());
    flight.story().into_iter().map(line).collect::<Vec<_>>().join("\n")
}

/// The story of a flight with a breach, and everything that there is against it, each with the decisions before.
pub fn breach(flight: &Flight) -> String {
    let mut parts = vec![run(flight)];
    if let Choice::Drawn(text) = &flight.script.mission {
        parts.push(text.trim_end().to_owned());
        parts.push(flight.script.ground.to_string());
    }
    parts.push(story(flight));
    parts.extend(flight.findings.iter().map(finding));
    parts.join("\n")
}

/// The same, with the command that flies it again.
pub fn breached(flight: &Flight, args: &SimulateArgs) -> String {
    format!("{}\nagain: {}\n", breach(flight), args.again(flight.script.seed))
}

fn finding(finding: &Finding) -> String {
    let decided = finding.before.iter().map(|(at, text)| format!("\n    {:9.2} s  {text}", at.as_secs_f64()));
    format!("breach: {finding}; decided before:{}", decided.collect::<String>())
}

/// How many flights ended how, how fast they were flown, and the hash over all of them.
pub fn summary(flights: &[Flight], wall: Duration) -> String {
    let breached = flights.iter().filter(|it| !it.findings.is_empty()).count();
    let hours = flights.iter().map(|it| it.flown).sum::<Duration>().as_secs_f64() / 3600.0;
    let mut endings: BTreeMap<&str, usize> = BTreeMap::new();
    flights.iter().for_each(|it| *endings.entry(it.ending.kind()).or_default() += 1);
    let endings: String = endings.iter().map(|(kind, count)| format!("\n{count:7}  {kind}")).collect();
    format!(
        "{} runs, {breached} with a breach, {hours:.2} h flown in {:.1} s: {:.0} x real time{endings}\n\
         counted: {}\nsha256 of all decision logs: {}",
        flights.len(),
        wall.as_secs_f64(),
        times_real_time(flights, wall),
        figures(flights),
        LogHash::of_all(flights.iter().map(|it| it.hash)),
    )
}

/// What breaks no rule.
fn figures(flights: &[Flight]) -> String {
    let figures = || flights.iter().map(|it| it.figures);
    let well_clear: u32 = figures().map(|it| it.well_clear_lost).sum();
    let hold_s = figures().map(|it| it.longest_hold_s).fold(0.0, f64::max);
    let lowest = figures().filter_map(|it| it.lowest_landing).min_by(f64::total_cmp);
    let lowest =
        lowest.map_or_else(|| "no landing".to_owned(), |it| format!("landed with {:.0} % at least", it * 100.0));
    format!("{well_clear} crewed aircraft nearer than well clear, {hold_s:.0} s in one place at most, {lowest}")
}

/// The whole report, for programs.
pub fn json(flights: &[Flight], wall: Duration) -> Value {
    let told = |at_s: f64, text: &str| json!({ "atS": at_s, "text": text });
    let finding = |it: &Finding| {
        let before: Vec<Value> = it.before.iter().map(|(at, text)| told(at.as_secs_f64(), text)).collect();
        let rule = it.rule.to_string();
        json!({ "atS": it.at.as_secs_f64(), "rule": rule, "process": it.process, "what": it.what, "decisions": before })
    };
    let run = |it: &Flight| {
        let troubles = it.script.troubles.iter().map(|(at, trouble)| told(at.as_secs_f64(), &trouble.to_string()));
        json!({
            "seed": it.script.seed,
            "setup": it.script.to_string(),
            "troubles": troubles.collect::<Vec<_>>(),
            "ending": it.ending.to_string(),
            "flownS": it.flown.as_secs_f64(),
            "sha256": it.hash.to_string(),
            "breaches": it.findings.iter().map(finding).collect::<Vec<_>>(),
        })
    };
    json!({
        "runs": flights.iter().map(run).collect::<Vec<_>>(),
        "sha256": LogHash::of_all(flights.iter().map(|it| it.hash)).to_string(),
        "flownS": flights.iter().map(|it| it.flown).sum::<Duration>().as_secs_f64(),
        "wallS": wall.as_secs_f64(),
        "timesRealTime": times_real_time(flights, wall),
    })
}
