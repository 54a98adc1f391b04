//! Random missions with random trouble at random times: whatever happens, the witness sees no breach, and there is a
//! report in the end, with the vehicle on the ground.
//!
//! `KITTIWAKE_SEEDS=1000` flies that number of each instead of the few that every run of the tests flies;
//! `KITTIWAKE_SEEDS=798..799` flies one again.

use std::path::PathBuf;
use std::sync::LazyLock;
use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::operator_command::Verb;
use kittiwake_proto::v1::{self, Decision};
use simulation::{Machine, Setup, Simulation};

use crate::support::dice::Dice;
use crate::support::random_mission::random_mission;
use crate::support::{config, config_with, mission_file};

/// Trouble begins within this time, and all of it that can end has ended by then.
const TROUBLE_S: u64 = 400;
/// Every mission flown here is over by then, with time for each hold and back-off.
const LIMIT: Duration = Duration::from_secs(3600);

const MISSIONS: [(&str, &[&str]); 4] = [
    ("reference", &["A", "B"]),
    ("harbour", &["basin", "fairway", "terminal"]),
    ("keep_out", &[]),
    ("altitude_band", &[]),
];
const POLICIES: [Policy; 5] = [Policy::Grant, Policy::Delay, Policy::Deny, Policy::Random, Policy::Silent];
const FLAGS: [&str; 6] =
    ["obstacle", "operator_pause", "operator_return", "operator_land", "battery_low", "transition_failed"];
/// Faults, and whether the vehicle still knows where it is and can fly there.
const FAULTS: [(&str, &[&str], bool); 19] = [
    ("reject_acks", &["1"], true),
    ("reject_acks", &["6"], true),
    ("swallow_acks", &["1"], true),
    ("swallow_acks", &["4"], true),
    ("freeze", &["vehicle_status"], true),
    ("drop", &["vehicle_land_detected"], true),
    ("freeze", &["vehicle_land_detected"], true),
    ("land_detector", &["landed"], true),
    ("land_detector", &["flying"], true),
    ("drop", &["battery_status"], true),
    ("drop", &["vehicle_status"], true),
    ("battery", &["0.2"], true),
    ("battery", &["0.09"], true),
    ("blocked_landing", &["on"], true),
    ("link_loss", &["20"], true),
    ("freeze", &["vehicle_local_position"], false),
    ("drop", &["vehicle_local_position"], false),
    ("gnss_loss", &["on"], false),
    ("wind", &["6", "6", "2"], false),
];

/// Processes that may hang. What the simulator and the ground do without is tested elsewhere.
const PROCESSES: [&str; 4] = ["planner", "skill-manager", "mcm", "monitor"];

/// How long a grant is valid, in seconds, and a configuration that says so. Made once: tests run side by side.
static SHORT_GRANTS: LazyLock<[(&str, PathBuf); 4]> = LazyLock::new(|| {
    ["45.0", "90.0", "180.0", "900.0"]
        .map(|grant| (grant, config_with(&format!("grants-of-{grant}"), &[("grant_valid_s", grant)])))
});

/// A flight, and what happened in it so far.
struct Flight {
    simulation: Simulation<'static>,
    dice: Dice,
    areas: Vec<String>,
    knows_its_place: bool,
    script: Vec<String>,
}

impl Drop for Flight {
    /// A flight that panics tells its story, too.
    fn drop(&mut self) {
        if std::thread::panicking() {
            println!("{}\n{}", self.script.join("\n"), self.simulation.decision_log());
        }
    }
}

impl Flight {
    /// One of the shipped missions.
    fn shipped(seed: u64, machine: Machine) -> Flight {
        let mut dice = Dice(seed);
        let config = config();
        let (mission, areas) = dice.one_of(&MISSIONS);
        let permissions = dice.one_of(&POLICIES);
        let path = config.join("missions").join(format!("{mission}.toml"));
        let setup = Setup { config: &config, mission: Some(&path), permissions, seed, machine };
        let areas = areas.iter().map(|it| (*it).to_owned()).collect();
        let script = vec![format!("seed {seed}: {mission}, {permissions}")];
        Flight { simulation: Simulation::new(&setup).unwrap(), dice, areas, knows_its_place: true, script }
    }

    /// A mission that nobody designed, with windows, and a tower whose grants are short.
    fn random(seed: u64, machine: Machine) -> Flight {
        let mut dice = Dice(!seed);
        let (text, areas) = random_mission(&mut dice);
        let machine_name = if matches!(machine, Machine::Ideal) { "ideal" } else { "busy" };
        let path = mission_file(&format!("random-{machine_name}-{seed}"), &text);
        let permissions = dice.one_of(&POLICIES);
        let (grant, config) = &SHORT_GRANTS[dice.below(4) as usize];
        let setup = Setup { config, mission: Some(&path), permissions, seed, machine };
        let script = vec![format!("seed {seed}: {permissions}, grants of {grant} s\n{text}")];
        Flight { simulation: Simulation::new(&setup).unwrap(), dice, areas, knows_its_place: true, script }
    }

    fn trouble(&mut self) -> String {
        let Flight { simulation, dice, areas, .. } = self;
        match dice.below(5) {
            4 => {
                let (process, seconds) = (dice.one_of(&PROCESSES), dice.one_of(&[1, 4, 20]));
                simulation.freeze(process, Duration::from_secs(seconds));
                format!("{process} hangs for {seconds} s")
            }
            0 => {
                let (fault, arguments, harmless) = dice.one_of(&FAULTS);
                self.knows_its_place &= harmless;
                simulation.inject_fault(fault, arguments);
                format!("{fault} {arguments:?}")
            }
            1 if !areas.is_empty() => {
                let area = areas[dice.below(areas.len() as u64) as usize].clone();
                let decision = dice.one_of(&[Decision::Grant, Decision::Deny, Decision::Revoke]);
                let valid_for_s = dice.one_of(&[None, Some(20.0), Some(60.0), Some(150.0)]);
                simulation.decide_for(&area, decision, valid_for_s.filter(|_| decision == Decision::Grant));
                format!("{decision:?} {area} for {valid_for_s:?} s")
            }
            2 => {
                let verb = order(dice);
                let ordered = format!("{verb:?}");
                simulation.order(verb);
                ordered
            }
            _ => {
                let flag = dice.one_of(&FLAGS);
                simulation.inject_flag(flag);
                flag.to_owned()
            }
        }
    }

    /// Flies to the end; what went wrong.
    fn fly(mut self) -> Option<String> {
        let mut times: Vec<u64> = (0..self.dice.below(5)).map(|_| self.dice.below(TROUBLE_S * 10)).collect();
        times.sort_unstable();
        let mut now = 0;
        for at in times {
            self.simulation.pass(Duration::from_millis((at - now) * 100));
            now = at;
            let what = self.trouble();
            self.script.push(format!("{:.1} {what}", at as f64 / 10.0));
        }
        self.simulation.pass(Duration::from_secs(30));
        self.simulation.inject_fault("clear", &[]);
        FLAGS.iter().for_each(|it| self.simulation.lower_flag(it));
        // A vehicle that has landed unplanned, or was paused, goes on when an operator says so.
        self.simulation.order(Verb::Resume(v1::ResumeMission {}));
        let report = self.simulation.fly(LIMIT);
        // A while longer, for what must not happen after the end.
        self.simulation.pass(Duration::from_secs(60));
        let breaches = self.simulation.breaches();
        let unanswered = self.simulation.unanswered();
        let wrong = match report {
            None => "no report".to_owned(),
            Some(_) if !self.simulation.is_on_ground() => "still in the air".to_owned(),
            Some(_) if self.knows_its_place && !breaches.is_empty() => format!("{breaches:?}"),
            Some(_) if !unanswered.is_empty() => format!("{unanswered:?}"),
            Some(_) => return None,
        };
        Some(format!("{wrong}: {}\n{}", self.script.join("\n"), self.simulation.decision_log()))
    }
}

fn order(dice: &mut Dice) -> Verb {
    let overrides = dice.sometimes(25);
    let position =
        v1::Ned { north_m: dice.between(-100, 100) as f64, east_m: dice.between(0, 500) as f64, down_m: 0.0 };
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

/// Flies the seeds that the environment asks for, or the first `few`.
fn check(few: u64, flight: impl Fn(u64) -> Flight) {
    let seeds = match std::env::var("KITTIWAKE_SEEDS") {
        Ok(asked) => seeds(&asked).expect("KITTIWAKE_SEEDS is a number of seeds, or a range of them such as 798..799"),
        Err(_) => 0..few,
    };
    let flown = seeds.end - seeds.start;
    let wrong: Vec<String> = seeds.filter_map(|seed| flight(seed).fly()).collect();
    assert!(wrong.is_empty(), "{} of {flown} flights went wrong:\n\n{}", wrong.len(), wrong.join("\n\n"));
}

fn seeds(asked: &str) -> Option<std::ops::Range<u64>> {
    let (from, to) = asked.split_once("..").unwrap_or(("0", asked));
    Some(from.parse().ok()?..to.parse().ok()?)
}

/// A machine with too much to do.
fn busy(seed: u64) -> Machine {
    Machine::Busy { seed, worst: Duration::from_millis(100) }
}

#[test]
fn whatever_happens_the_vehicle_keeps_the_rules_and_the_mission_ends() {
    check(20, |seed| Flight::shipped(seed, Machine::Ideal));
}

#[test]
fn the_same_on_a_machine_with_too_much_to_do() {
    check(20, |seed| Flight::shipped(seed, busy(seed)));
}

#[test]
fn missions_that_nobody_designed_keep_the_rules_and_end() {
    check(40, |seed| Flight::random(seed, Machine::Ideal));
}

#[test]
fn missions_that_nobody_designed_on_a_machine_with_too_much_to_do() {
    check(20, |seed| Flight::random(seed, busy(seed)));
}
