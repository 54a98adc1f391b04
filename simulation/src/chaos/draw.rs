//! Draws a script from a seed. The same seed is the same script for as long as these tables are as they are: a report names the version.

use std::path::{Path, PathBuf};
use std::time::Duration;

use control_tower::policy::Policy;
use domain::quantity::Positive;
use kittiwake_proto::v1::operator_command::Verb;
use kittiwake_proto::v1::{self, Decision};

use super::dice::Dice;
use super::random_mission::{Drawn, random_mission};
use super::script::{Choice, Script};
use super::trouble::Trouble;
use crate::{Disturbance, Machine, Memory};

/// Trouble begins within this time.
const TROUBLE_S: u64 = 400;
/// Greatest number of troubles, and one.
const TROUBLES: u64 = 5;
/// The longest that a busy machine lets anything wait.
const WORST: Duration = Duration::from_millis(100);
const POLICIES: [Policy; 5] = [Policy::Grant, Policy::Delay, Policy::Deny, Policy::Random, Policy::Silent];
/// Seconds for which a grant holds where the mission is drawn, too: shorter than it takes, long enough, and as shipped.
const GRANTS_S: [f64; 4] = [45.0, 90.0, 180.0, 900.0];
/// Flags that are raised, and lowered in the end.
pub const FLAGS: [&str; 14] = [
    "obstacle",
    "operator_pause",
    "operator_return",
    "operator_land",
    "battery_low",
    "transition_failed",
    "energy_short",
    "drone_near",
    "tower_lost",
    "path_deviated",
    "gust_at_landing",
    "memory_unusable",
    "no_plan",
    "vibration_high",
];
/// Faults with what they are given, each as likely as the others. `clear` ends all before it.
const FAULTS: [(&str, &[&str]); 64] = [
    ("clear", &[]),
    ("clear", &[]),
    ("reject_acks", &["1"]),
    ("reject_acks", &["6"]),
    ("swallow_acks", &["1"]),
    ("swallow_acks", &["4"]),
    ("freeze", &["vehicle_status"]),
    ("freeze", &["vehicle_attitude"]),
    ("freeze", &["vehicle_local_position"]),
    ("freeze", &["vehicle_global_position"]),
    ("freeze", &["vehicle_land_detected"]),
    ("freeze", &["battery_status"]),
    ("freeze", &["wind"]),
    ("drop", &["vehicle_status"]),
    ("drop", &["vehicle_attitude"]),
    ("drop", &["vehicle_local_position"]),
    ("drop", &["vehicle_land_detected"]),
    ("drop", &["battery_status"]),
    ("drop", &["wind"]),
    ("land_detector", &["landed"]),
    ("land_detector", &["flying"]),
    ("battery", &["0.5"]),
    ("battery", &["0.3"]),
    ("battery", &["0.2"]),
    ("battery", &["0.09"]),
    ("battery", &["0.045"]),
    ("battery_temperature", &["70"]),
    ("drain", &["1.6"]),
    ("drain", &["4"]),
    ("blocked_landing", &["on"]),
    ("blocked_landing", &["off"]),
    ("gripper_stuck", &["on"]),
    ("link_loss", &["20"]),
    ("link_loss", &["150"]),
    ("gnss_loss", &["on"]),
    ("gnss_loss", &["off"]),
    ("estimator_drift", &["0.5"]),
    ("estimator_invalid", &["on"]),
    ("position_jump", &["0", "-12"]),
    ("position_jump", &["6", "0"]),
    ("position_jump", &["0", "0", "140"]),
    ("heading_error", &["90"]),
    ("frame_jump", &["3", "-40", "2"]),
    ("steering_error", &["30", "0"]),
    ("slow_flight", &["3"]),
    ("motor_failure", &["1"]),
    ("wind", &["6", "6", "2"]),
    ("wind", &["0", "-12"]),
    ("wind", &["0", "13.7"]),
    ("wind", &["-15", "0"]),
    ("wind", &["0", "0"]),
    ("vibration", &["35"]),
    ("vibration", &["70"]),
    ("wind", &["4", "-5", "1"]),
    ("wind", &["-3", "4"]),
    ("not_ready", &["compass"]),
    ("pilot_takes_over", &[]),
    ("pilot_takes_over", &["hold"]),
    ("pilot_takes_over", &["land"]),
    ("autopilot_failsafe", &["hold"]),
    ("autopilot_failsafe", &["return"]),
    ("autopilot_failsafe", &["land"]),
    ("autopilot_failsafe", &["off"]),
    ("restart_autopilot", &["holds"]),
];
/// Other traffic, as faults.
const TRAFFIC: [(&str, &[&str]); 18] = [
    // Flies past.
    ("intruder", &["250", "250", "12", "-10", "0", "uncrewed"]),
    ("intruder", &["120", "400", "0", "-4", "0", "vessel"]),
    ("intruder", &["2000", "200", "20", "-40", "0", "crewed"]),
    ("intruder", &["0", "900", "15", "0", "-3", "crewed"]),
    // Stands: over the way, and behind it.
    ("intruder", &["20", "300", "20", "0", "0", "crewed"]),
    ("intruder", &["20", "1000", "20", "0", "0", "crewed"]),
    ("intruder", &["0", "250", "20", "0", "0", "uncrewed"]),
    ("intruder", &["0", "200", "0", "0", "0", "vessel"]),
    // Parks at home, and lies there.
    ("intruder", &["8", "-8", "0", "0", "0", "crewed"]),
    ("intruder", &["-15", "10", "0", "0", "0", "uncrewed"]),
    ("intruder", &["10", "15", "0", "0", "0", "vessel"]),
    // Comes home low, and crosses the way.
    ("intruder", &["-1500", "0", "30", "25", "0", "crewed"]),
    ("intruder", &["1200", "350", "40", "-20", "0", "crewed"]),
    ("head_on", &["2000", "30", "crewed"]),
    ("head_on", &["2500", "50", "crewed"]),
    ("head_on", &["1500", "20", "uncrewed"]),
    ("circling", &["0", "0", "60", "400", "20", "crewed"]),
    ("circling", &["0", "300", "40", "900", "30", "crewed"]),
];
/// Winds at the start of a drawn mission: as planned for, and beyond it, up to more than the vehicle's airspeed.
const WINDS: [&[&str]; 8] = [
    &["4", "0", "1"],
    &["0", "-5"],
    &["-5", "5", "1"],
    &["0", "7"],
    &["8", "4"],
    &["0", "-11", "2"],
    &["12", "0"],
    &["0", "16"],
];
/// Of a hundred drawn missions this many have one.
const WINDY: u64 = 30;
/// Processes that may hang. What the vehicle does without an autopilot is tested elsewhere.
const PROCESSES: [&str; 6] = ["planner", "skill-manager", "mcm", "monitor", "control-tower", "gateway"];
/// A tower that is silent for as long as it takes to fly there and back.
const SILENT_TOWER: Duration = Duration::from_secs(300);
/// Milliseconds by which the clocks are set: a correction, a minute, an hour, each way.
const CLOCKS_MS: [i64; 6] = [-3_600_000, -60_000, -1_500, 1_500, 60_000, 3_600_000];

/// Processes that may be killed.
const KILLED: [&str; 5] = ["planner", "skill-manager", "mcm", "monitor", "control-tower"];
/// Milliseconds until one that was killed is there again: what its supervisor needs after a first death, after some, and at most.
const DEAD_MS: [u64; 3] = [300, 1000, 3500];

/// A mission that exists, and the areas about which the control tower may decide by hand.
#[derive(Debug, Clone)]
pub struct Existing {
    /// Which.
    pub mission: Choice,
    /// Names of areas.
    pub areas: Vec<String>,
}

/// The missions that are shipped in the folder of the configuration.
pub fn shipped(config: &Path) -> Vec<Existing> {
    const SHIPPED: [(&str, &[&str]); 4] = [
        ("reference", &["A", "B"]),
        ("harbour", &["basin", "fairway", "terminal"]),
        ("keep_out", &[]),
        ("altitude_band", &[]),
    ];
    let path = |name: &str| -> PathBuf { config.join("missions").join(format!("{name}.toml")) };
    let existing = |(name, areas): &(&str, &[&str])| Existing {
        mission: Choice::File(path(name)),
        areas: areas.iter().map(|it| (*it).to_owned()).collect(),
    };
    SHIPPED.iter().map(existing).collect()
}

/// One of `missions`, with trouble.
///
/// # Panics
/// If there is no mission.
pub fn existing(seed: u64, missions: &[Existing], machine: Machine) -> Script {
    let mut dice = Dice(seed);
    let Existing { mission, areas } = &missions[dice.below(missions.len() as u64) as usize];
    let permissions = dice.one_of(&POLICIES);
    let troubles = troubles(&mut dice, &Subject { areas, places: &[], bare: "" });
    Script::new(seed, mission.clone(), permissions, machine, troubles)
}

/// A mission that nobody designed over its own ground, with windows, and a tower whose grants may be short; with trouble.
pub fn random(seed: u64, machine: Machine) -> Script {
    let mut dice = Dice(!seed);
    let drawn = random_mission(&mut dice);
    let permissions = dice.one_of(&POLICIES);
    let grant_valid_s = Positive::try_from(dice.one_of(&GRANTS_S)).ok();
    let mut troubles = troubles(&mut dice, &Subject::of(&drawn));
    if dice.sometimes(WINDY) {
        troubles.insert(0, (Duration::ZERO, fault("wind", dice.one_of(&WINDS))));
    }
    let (mission, ground) = (Choice::Drawn(drawn.text), drawn.ground);
    Script { ground, ..Script { grant_valid_s, ..Script::new(seed, mission, permissions, machine, troubles) } }
}

/// A machine with too much to do.
pub fn busy(seed: u64) -> Machine {
    Machine::Busy { seed, worst: WORST }
}

/// What troubles are about.
struct Subject<'a> {
    areas: &'a [String],
    /// Where it may land, north, east and height.
    places: &'a [[i64; 3]],
    /// The mission without its areas; empty where it is not drawn.
    bare: &'a str,
}

impl Subject<'_> {
    fn of(drawn: &Drawn) -> Subject<'_> {
        Subject { areas: &drawn.areas, places: &drawn.places, bare: &drawn.bare }
    }
}

fn troubles(dice: &mut Dice, subject: &Subject<'_>) -> Vec<(Duration, Trouble)> {
    let mut times: Vec<u64> = (0..dice.below(TROUBLES)).map(|_| dice.below(TROUBLE_S * 10)).collect();
    times.sort_unstable();
    times.into_iter().map(|tenths| (Duration::from_millis(tenths * 100), trouble(dice, subject))).collect()
}

fn trouble(dice: &mut Dice, subject: &Subject<'_>) -> Trouble {
    let areas = subject.areas;
    match dice.below(14) {
        13 => {
            let (name, args) = dice.one_of(&TRAFFIC);
            fault(name, args)
        }
        0..=3 => {
            let (name, args) = dice.one_of(&FAULTS);
            fault(name, args)
        }
        4 if dice.sometimes(20) => Trouble::Hang { process: "control-tower".to_owned(), time: SILENT_TOWER },
        4 => {
            let (process, seconds) = (dice.one_of(&PROCESSES), dice.one_of(&[1, 4, 20]));
            Trouble::Hang { process: process.to_owned(), time: Duration::from_secs(seconds) }
        }
        5 => Trouble::Order(order(dice, subject)),
        6 if dice.sometimes(30) => Trouble::Clock(dice.one_of(&CLOCKS_MS)),
        7 if !areas.is_empty() => {
            let area = areas[dice.below(areas.len() as u64) as usize].clone();
            let decision = dice.one_of(&[Decision::Grant, Decision::Deny, Decision::Revoke]);
            let valid_for_s = dice.one_of(&[None, Some(20.0), Some(60.0), Some(150.0)]);
            Trouble::Decide { area, decision, valid_for_s: valid_for_s.filter(|_| decision == Decision::Grant) }
        }
        9 | 10 => {
            let (process, time) = (dice.one_of(&KILLED).to_owned(), Duration::from_millis(dice.one_of(&DEAD_MS)));
            let memory = if dice.sometimes(25) { Memory::Lost } else { Memory::Restored };
            Trouble::Kill { process, time, memory }
        }
        11 => disturbance(dice),
        12 if !subject.bare.is_empty() => upload(dice, subject),
        _ => Trouble::Flag(dice.one_of(&FLAGS).to_owned()),
    }
}

fn fault(name: &str, args: &[&str]) -> Trouble {
    Trouble::Fault { name: name.to_owned(), args: args.iter().map(|it| (*it).to_owned()).collect() }
}

/// The mission without its areas, or with one area in their place.
fn upload(dice: &mut Dice, subject: &Subject<'_>) -> Trouble {
    let (south, west) = (dice.between(-150, 100), dice.between(30, 500));
    let (north, east) = (south + dice.between(50, 250), west + dice.between(50, 200));
    let corners = format!("[[{south}, {west}], [{north}, {west}], [{north}, {east}], [{south}, {east}]]");
    let area = format!("[[area]]\nname = \"late\"\nkind = \"keep-out\"\ncorners_m = {corners}\n");
    let (bare, with_area) = (subject.bare, dice.sometimes(50));
    Trouble::Upload(if with_area { format!("{bare}{area}") } else { bare.to_owned() })
}

fn disturbance(dice: &mut Dice) -> Trouble {
    let (lost, twice) = (dice.one_of(&[0.0, 0.01, 0.05, 0.2]), dice.one_of(&[0.0, 0.1]));
    let late = Duration::from_millis(dice.one_of(&[0, 20, 100, 300]));
    let time = Duration::from_secs(dice.one_of(&[5, 20, 60]));
    Trouble::Disturb { disturbance: Disturbance { seed: dice.below(1 << 32), lost, twice, late }, time }
}

fn order(dice: &mut Dice, subject: &Subject<'_>) -> Verb {
    let overrides = dice.sometimes(25);
    let anywhere = [dice.between(-100, 100), dice.between(0, 500), 0];
    let [north, east, height] = match subject.places {
        places if !places.is_empty() && dice.sometimes(50) => dice.one_of(places),
        _ => anywhere,
    };
    let position = v1::Ned { north_m: north as f64, east_m: east as f64, down_m: -height as f64 };
    match dice.below(7) {
        0 => Verb::Pause(v1::PauseMission { overrides }),
        1 => Verb::Resume(v1::ResumeMission {}),
        2 => Verb::Abort(v1::AbortMission { overrides }),
        3 => Verb::Return(v1::ReturnHome { overrides }),
        4 => Verb::LandAt(v1::LandAt { position: Some(position), overrides }),
        5 => Verb::Replan(v1::ReplanMission {}),
        _ => Verb::Start(v1::StartMission {}),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_is_a_script_and_its_troubles_are_in_order() {
        let mission = Existing { mission: Choice::Configured, areas: vec!["A".into()] };
        let draw = |seed| existing(seed, std::slice::from_ref(&mission), Machine::Ideal);
        for seed in 0..200 {
            let (script, random) = (draw(seed), random(seed, Machine::Ideal));
            assert_eq!(script.troubles, draw(seed).troubles);
            for script in [script, random] {
                assert!(script.troubles.len() <= TROUBLES as usize);
                assert!(script.troubles.is_sorted_by_key(|(at, _)| *at), "seed {seed}");
                assert!(script.troubles.iter().all(|(at, _)| *at < Duration::from_secs(TROUBLE_S)));
            }
        }
        assert!((0..200).any(|seed| draw(seed).troubles != draw(seed + 1).troubles));
    }

    #[test]
    fn every_fault_that_is_drawn_is_one_that_the_simulator_takes() {
        for (name, args) in FAULTS.into_iter().chain(TRAFFIC).chain(WINDS.map(|it| ("wind", it))) {
            let args: Vec<String> = args.iter().map(|it| (*it).to_owned()).collect();
            assert_eq!(vehicle_sim::faults::check(name, &args), Ok(()), "{name}");
        }
    }
}
