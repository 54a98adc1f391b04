//! Random missions with random trouble at random times: no area is entered without a valid permission, nothing takes
//! off after the mission, and every mission ends with a report.

use std::path::Path;
use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::Decision;
use simulation::{Machine, Setup, Simulation};

/// Trouble begins within this number of seconds, and all trouble that can end has ended by then.
const TROUBLE_S: u64 = 400;
/// Every mission flown here is over by then, with time for each hold and back-off.
const LIMIT: Duration = Duration::from_secs(3000);

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
const FAULTS: [(&str, &[&str], bool); 15] = [
    ("reject_acks", &["1"], true),
    ("reject_acks", &["5"], true),
    ("swallow_acks", &["1"], true),
    ("swallow_acks", &["4"], true),
    ("freeze", &["vehicle_status"], true),
    ("drop", &["vehicle_land_detected"], true),
    ("drop", &["battery_status"], true),
    ("drop", &["vehicle_status"], true),
    ("battery", &["0.2"], true),
    ("blocked_landing", &["on"], true),
    ("link_loss", &["20"], true),
    ("freeze", &["vehicle_local_position"], false),
    ("drop", &["vehicle_local_position"], false),
    ("gnss_loss", &["on"], false),
    ("wind", &["6", "6", "2"], false),
];

/// SplitMix64: a seed makes a flight.
struct Dice(u64);

impl Dice {
    fn below(&mut self, limit: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (mixed ^ (mixed >> 31)) % limit
    }

    fn one_of<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len() as u64) as usize]
    }
}

fn check(seed: u64, machine: Machine) {
    let mut dice = Dice(seed);
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config");
    let (mission, areas) = dice.one_of(&MISSIONS);
    let permissions = dice.one_of(&POLICIES);
    let path = config.join("missions").join(format!("{mission}.toml"));
    let mut simulation =
        Simulation::new(&Setup { config: &config, mission: Some(&path), permissions, seed, machine }).unwrap();
    let mut script = vec![format!("seed {seed}: {mission}, {permissions}")];
    let mut times: Vec<u64> = (0..dice.below(5)).map(|_| dice.below(TROUBLE_S * 10)).collect();
    times.sort_unstable();
    let (mut knows_its_place, mut now) = (true, 0);
    let mut report = None;
    for at in times {
        report = report.or(simulation.fly(Duration::from_millis((at - now) * 100)));
        now = at;
        let what = match dice.below(3) {
            0 => {
                let (fault, arguments, harmless) = dice.one_of(&FAULTS);
                knows_its_place &= harmless;
                simulation.inject_fault(fault, arguments);
                format!("{fault} {arguments:?}")
            }
            1 if !areas.is_empty() => {
                let area = dice.one_of(areas);
                let decision = dice.one_of(&[Decision::Grant, Decision::Deny, Decision::Revoke]);
                simulation.decide(area, decision);
                format!("{decision:?} {area}")
            }
            _ => {
                let flag = dice.one_of(&FLAGS);
                simulation.inject_flag(flag);
                flag.to_owned()
            }
        };
        script.push(format!("{:.1} {what}", at as f64 / 10.0));
    }
    report = report.or(simulation.fly(Duration::from_secs(30)));
    simulation.inject_fault("clear", &[]);
    FLAGS.iter().for_each(|it| simulation.lower_flag(it));
    report = report.or(simulation.fly(LIMIT));
    // Fly on for a while, to see what must not happen after the end.
    simulation.fly_until("nothing is said so", Duration::from_secs(60));
    let told = || format!("{}\n{}", script.join("\n"), simulation.decision_log());
    assert!(report.is_some(), "no report: {}", told());
    let breaches = simulation.breaches();
    assert!(!knows_its_place || breaches.is_empty(), "{breaches:?}: {}", told());
    assert!(simulation.unanswered().is_empty(), "{:?}: {}", simulation.unanswered(), told());
}

#[test]
fn random_flights_end_with_a_report_and_without_a_breach() {
    // Three of the seeds once returned home straight through an area.
    (0..20).chain([22, 81, 195]).for_each(|seed| check(seed, Machine::Ideal));
}

#[test]
fn the_same_on_a_machine_with_too_much_to_do() {
    let worst = Duration::from_millis(100);
    (0..20).for_each(|seed| check(seed, Machine::Busy { seed, worst }));
}
