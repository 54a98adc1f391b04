//! Flights in which faults raise the flags, not a hand: each fault alone, at three moments, and a part of the pairs. Over water, with a
//! place to land at on a pier, and a home inside an area.
//!
//! They are judged as drawn flights are ([`crate::chaos::oracle`]). Besides, a row that is about the fault's hazard must be raised, and no
//! flag may rise again and again.

use std::collections::BTreeMap;
use std::time::Duration;

use control_tower::policy::Policy;
use domain::contingency::hazard::Hazard;
use domain::contingency::{Contingencies, Phase};
use domain::file::{Mistakes, Source};
use domain::mission::Mission;
use vehicle_sim::ground::{Ground, Patch, Surface};

use super::hazards::is_about;
use crate::chaos::fly::{Flight, judged};
use crate::chaos::script::{Choice, Script};
use crate::chaos::trouble::Trouble;
use crate::{Machine, Memory, System};

const MISSION: &str = "name = \"coast\"
[[objective]]\nname = \"there\"\nnorth_m = 0\neast_m = 260\nheight_m = 25\nflying = true\ndwell_s = 20
[[objective]]\nname = \"back\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false
[[site]]\nname = \"pier\"\nkind = \"landing\"\nnorth_m = 70\neast_m = 160\nheight_m = 8
[[area]]\nname = \"harbour\"\nkind = \"permission\"\ncorners_m = [[-50, -50], [50, -50], [50, 40], [-50, 40]]
[[area]]\nname = \"bay\"\nkind = \"no-landing\"\ncorners_m = [[-500, 60], [500, 60], [500, 700], [-500, 700]]
holes_m = [[[45, 135], [95, 135], [95, 185], [45, 185]]]\n";

/// The ground of that mission.
fn ground() -> Ground {
    let bay = Patch { north_m: [-500.0, 500.0], east_m: [60.0, 700.0], height_m: 0.0, surface: Surface::Water };
    let pier = Patch { north_m: [45.0, 95.0], east_m: [135.0, 185.0], height_m: 8.0, surface: Surface::Land };
    Ground { patches: vec![bay, pier], ..Ground::default() }
}

/// Before the takeoff, over the water, on the way back.
const MOMENTS_S: [u64; 3] = [1, 28, 55];
/// The one for pairs, and by how much the second fault comes later.
const OVER_WATER_S: u64 = MOMENTS_S[1];
const GAP_S: u64 = 6;
/// Of the pairs every one of this number: a prime, so that each fault comes first and second.
const ONE_OF: usize = 13;
/// In a hurry.
const ONE_OF_QUICK: usize = 211;
/// A flag may rise for each of two faults, and once more when one of them ends.
const RISES: usize = 3;
/// Before the takeoff, which is tried up to eight times: each try arms the vehicle, and what counts while armed rises again. (A row that
/// counts always rises once: `attitude_stale` does not yet.)
const RISES_ON_GROUND: usize = 8;

/// A flight with faults.
#[derive(Debug, Clone)]
pub struct Case {
    /// In words.
    pub name: String,
    /// What the first fault shows, where a flag must rise for it.
    hazard: Option<&'static Hazard>,
    script: Script,
}

/// A flight with faults, flown.
#[derive(Debug, Clone)]
pub struct Flown {
    /// In words.
    pub name: String,
    /// What there is against it, each with the row that responded.
    pub faults: Vec<String>,
    /// What happened and what was decided.
    pub story: Vec<String>,
    /// Virtual time.
    pub flown: Duration,
}

/// The faults, each with the hazard that it is.
fn troubles() -> Vec<(&'static str, Trouble)> {
    let fault = |hazard, name: &str, args: &[&str]| {
        let args = args.iter().map(|it| (*it).to_owned()).collect();
        (hazard, Trouble::Fault { name: name.to_owned(), args })
    };
    let hang = |hazard, process: &str, seconds| {
        (hazard, Trouble::Hang { process: process.to_owned(), time: Duration::from_secs(seconds) })
    };
    let kill = |hazard, process: &str| {
        let (process, time) = (process.to_owned(), Duration::from_millis(3500));
        (hazard, Trouble::Kill { process, time, memory: Memory::Lost })
    };
    vec![
        fault("battery-low", "battery", &["0.2"]),
        fault("battery-nearly-empty", "battery", &["0.085"]),
        fault("battery-empty", "battery", &["0.045"]),
        fault("battery-faulty", "battery_fault", &[]),
        fault("battery-hot", "battery_temperature", &["75"]),
        fault("battery-silent", "drop", &["battery_status"]),
        fault("consumption-high", "drain", &["2.5"]),
        fault("position-invalid", "estimator_invalid", &["on"]),
        fault("satellites-lost", "gnss_loss", &["on"]),
        fault("position-silent", "drop", &["vehicle_local_position"]),
        fault("position-silent", "freeze", &["vehicle_local_position"]),
        fault("attitude-silent", "drop", &["vehicle_attitude"]),
        fault("position-jumped", "position_jump", &["0", "-20"]),
        fault("heading-wrong", "heading_error", &["90"]),
        fault("off-its-path", "steering_error", &["40", "0"]),
        fault("frame-moved", "frame_jump", &["3", "-40", "0"]),
        fault("motor-failed", "motor_failure", &["1"]),
        fault("vibration-extreme", "vibration", &["70"]),
        fault("vibration-high", "vibration", &["40"]),
        fault("autopilot-holds", "autopilot_failsafe", &["hold"]),
        fault("autopilot-returns", "autopilot_failsafe", &["return"]),
        fault("autopilot-lands", "autopilot_failsafe", &["land"]),
        fault("autopilot-silent", "drop", &["vehicle_status"]),
        fault("land-detector-wrong", "land_detector", &["landed"]),
        fault("somebody-else-flies", "pilot_takes_over", &["hold"]),
        fault("aircraft-near", "intruder", &["600", "150", "25", "-20", "0", "crewed"]),
        fault("drone-near", "intruder", &["250", "150", "25", "-10", "0", "uncrewed"]),
        fault("vessel-near", "intruder", &["60", "260", "0", "-3", "0", "vessel"]),
        fault("wind-too-strong", "wind", &["0", "17"]),
        hang("link-lost", "gateway", 25),
        hang("tower-silent", "control-tower", 25),
        hang("monitor-dead", "monitor", 5),
        hang("skill-manager-dead", "skill-manager", 5),
        kill("skill-manager-dead", "skill-manager"),
        kill("monitor-dead", "monitor"),
        ("clock-jumped", Trouble::Clock(60_000)),
    ]
}

/// The flights: all faults alone, and a part of the pairs.
pub fn cases(is_quick: bool) -> Vec<Case> {
    let troubles = troubles();
    let seconds = Duration::from_secs;
    let case = |name: String, hazard: Option<&'static str>, troubles: Vec<(Duration, Trouble)>| {
        let mission = Choice::Drawn(MISSION.to_owned());
        let script = Script::new(1, mission, Policy::Grant, Machine::Ideal, troubles);
        Case { name, hazard: hazard.and_then(Hazard::named), script: Script { ground: ground(), ..script } }
    };
    let mut cases = Vec::new();
    for (hazard, trouble) in &troubles {
        for at_s in MOMENTS_S.into_iter().filter(|it| !is_quick || *it == OVER_WATER_S) {
            let hazard = (at_s == OVER_WATER_S).then_some(*hazard);
            cases.push(case(format!("{trouble} after {at_s} s"), hazard, vec![(seconds(at_s), trouble.clone())]));
        }
    }
    let pairs = troubles.iter().flat_map(|first| troubles.iter().map(move |second| (first, second)));
    let chosen = pairs.enumerate().filter(|(at, _)| at % if is_quick { ONE_OF_QUICK } else { ONE_OF } == 0);
    for (_, ((_, first), (_, second))) in chosen {
        let later_s = OVER_WATER_S + GAP_S;
        let both = vec![(seconds(OVER_WATER_S), first.clone()), (seconds(later_s), second.clone())];
        cases.push(case(format!("{first} after {OVER_WATER_S} s, {second} after {later_s} s"), None, both));
    }
    cases
}

/// Flies them, `jobs` at a time, `done` after each; in their order.
///
/// # Errors
/// Mistakes in the files, if they were changed meanwhile.
pub fn fly_all(
    config: &std::path::Path,
    cases: &[Case],
    jobs: usize,
    done: impl Fn() + Sync,
) -> Result<Vec<Flown>, Mistakes> {
    super::each(config, cases, jobs, |system, case| {
        let flown = fly(system, case)?;
        done();
        Ok(flown)
    })
}

fn fly(system: &System, case: &Case) -> Result<Flown, Mistakes> {
    let mission = Mission::read(&Source { path: "the coast of the proof".into(), text: MISSION.to_owned() })?;
    let flight = judged(&case.script, system.over(mission, case.script.seed, ground())?);
    let line = |(at, text): (Duration, String)| format!("{:6.1} s  {text}", at.as_secs_f64());
    let story = flight.story().into_iter().map(line).collect();
    Ok(Flown { name: case.name.clone(), faults: faults(system.table(), case, &flight), story, flown: flight.flown })
}

/// What there is against a flight.
fn faults(table: &Contingencies, case: &Case, flight: &Flight) -> Vec<String> {
    let mut faults: Vec<String> = Vec::new();
    for finding in &flight.findings {
        // The last row that was answered before it.
        let answered = |text: &String| table.rows().iter().find(|it| text.contains(&format!("`{}`: ", it.flag)));
        let row = finding.before.iter().rev().find_map(|(_, text)| answered(text));
        let by = row.map_or_else(|| "no row responds".to_owned(), |it| format!("`{}` responds", it.flag));
        faults.push(format!("{}; {by}", finding.what));
    }
    let mut rises: BTreeMap<&str, usize> = BTreeMap::new();
    for row in table.rows() {
        let raised = format!("flag `{}` raised", row.flag);
        rises.insert(&row.flag, flight.decisions.iter().filter(|(_, text)| text.contains(&raised)).count());
    }
    let is_before_takeoff = case.script.troubles.iter().any(|(at, _)| at.as_secs() == MOMENTS_S[0]);
    let most = if is_before_takeoff { RISES_ON_GROUND } else { RISES };
    for (flag, times) in rises.iter().filter(|(_, times)| most < **times) {
        faults.push(format!("`{flag}` rises {times} times"));
    }
    if let Some(hazard) = case.hazard {
        let about: Vec<&str> =
            table.rows().iter().filter(|it| is_about(it, hazard)).map(|it| it.flag.as_str()).collect();
        let is_waived = table.waivers().iter().any(|it| it.hazard == hazard && it.phases.contains(&Phase::Cruise));
        if !is_waived && about.iter().all(|flag| rises.get(flag).is_none_or(|times| *times == 0)) {
            let rows = about.iter().map(|it| format!("`{it}`")).collect::<Vec<_>>().join(", ");
            faults.push(format!("no flag rises for hazard `{}`, of {rows}", hazard.name));
        }
    }
    faults
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_is_one_that_the_simulator_takes_and_shows_a_hazard() {
        for (hazard, trouble) in troubles() {
            assert!(Hazard::named(hazard).is_some(), "{hazard}");
            if let Trouble::Fault { name, args } = trouble {
                assert_eq!(vehicle_sim::faults::check(&name, &args), Ok(()), "{name}");
            }
        }
    }

    #[test]
    fn the_flights_in_a_hurry_have_nothing_against_the_shipped_table() {
        let config = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../config");
        let flown = fly_all(&config, &cases(true), 2, || {}).unwrap();
        let told = |it: &Flown| format!("{}: {:#?}\n{}", it.name, it.faults, it.story.join("\n"));
        let faulty: Vec<String> = flown.iter().filter(|it| !it.faults.is_empty()).map(told).collect();
        assert!(faulty.is_empty(), "{} of {}:\n{}", faulty.len(), flown.len(), faulty.join("\n\n"));
    }
}
