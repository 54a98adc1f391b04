//! Random missions with random trouble at random times: whatever happens, the oracle has nothing against the flight, and there is a
//! report in the end, with the vehicle on the ground.
//!
//! `KITTIWAKE_SEEDS=1000` flies that number of each instead of the sample that every run of the tests flies;
//! `KITTIWAKE_SEEDS=798..799` flies one again. So does `kittiwake simulate --chaos`, without a build of the tests.

use std::time::Duration;

use control_tower::policy::Policy;
use simulation::Machine;
use simulation::chaos::draw::{busy, existing, random, shipped};
use simulation::chaos::fly::{Flight, fly};
use simulation::chaos::hash::LogHash;
use simulation::chaos::script::{Choice, Script};
use simulation::chaos::trouble::Trouble;

use crate::stories::support::{config, seeds};

/// Flies the seeds that the environment asks for, or a sample of the first `few`.
fn check(few: u64, draw: impl Fn(u64) -> Script) {
    let seeds = seeds(few);
    let flown = seeds.len();
    let wrong: Vec<String> =
        seeds.into_iter().filter_map(|seed| wrong(&fly(&draw(seed), &config()).unwrap())).collect();
    assert!(wrong.is_empty(), "{} of {flown} flights went wrong:\n\n{}", wrong.len(), wrong.join("\n\n"));
}

/// What there is against a flight, with its story; `None` if there is nothing.
fn wrong(flight: &Flight) -> Option<String> {
    let lines = flight.story().into_iter().map(|(at, what)| format!("{:7.2}  {what}", at.as_secs_f64()));
    let story = lines.collect::<Vec<_>>().join("\n");
    let findings: Vec<String> = flight.findings.iter().map(ToString::to_string).collect();
    let mission = if let Choice::Drawn(text) = &flight.script.mission { text.as_str() } else { "" };
    (!findings.is_empty()).then(|| format!("{}\n{}\n{mission}{story}", findings.join("\n"), flight.script))
}

#[test]
fn whatever_happens_the_vehicle_keeps_the_rules_and_the_mission_ends() {
    check(20, |seed| existing(seed, &shipped(&config()), Machine::Ideal));
}

#[test]
fn the_same_on_a_machine_with_too_much_to_do() {
    check(20, |seed| existing(seed, &shipped(&config()), busy(seed)));
}

#[test]
fn missions_that_nobody_designed_keep_the_rules_and_end() {
    check(40, |seed| random(seed, Machine::Ideal));
}

#[test]
fn missions_that_nobody_designed_on_a_machine_with_too_much_to_do() {
    check(20, |seed| random(seed, busy(seed)));
}

#[test]
fn nobody_ends_a_failsafe_of_the_autopilot_without_an_order_whatever_else_happens() {
    check(20, |seed| with_failsafe(random(seed, if seed % 2 == 0 { Machine::Ideal } else { busy(seed) })));
}

/// The same flight, in which the autopilot once holds, returns or lands by itself, most often for a while.
fn with_failsafe(script: Script) -> Script {
    let number = |of: u64| (script.seed / of) as usize;
    let mode = ["hold", "hold", "return", "land"][number(4) % 4];
    let fault = |args: [&str; 2]| Trouble::Fault {
        name: "autopilot_failsafe".into(),
        args: args.into_iter().filter(|it| !it.is_empty()).map(str::to_owned).collect(),
    };
    let begins = Duration::from_secs(10 + script.seed * 37 % 290);
    let lasts = [2, 8, 40, 200, 2000][number(1) % 5];
    let mut troubles = script.troubles.clone();
    troubles.push((begins, fault([mode, "geofence"])));
    troubles.push((begins + Duration::from_secs(lasts), fault(["off", ""])));
    troubles.sort_by_key(|(at, _)| *at);
    script.with(troubles)
}

/// The reference mission, with these troubles.
fn reference(seed: u64, troubles: Vec<(Duration, Trouble)>) -> Flight {
    let script = Script::new(seed, Choice::Configured, Policy::Grant, busy(seed), troubles);
    fly(&script, &config()).unwrap()
}

#[test]
fn a_landing_that_is_ordered_without_a_place_on_the_way_home_is_one_at_a_listed_place() {
    let mission = "name = \"look\"\n\
        [[objective]]\nname = \"there\"\nnorth_m = 100\neast_m = 200\nheight_m = 15\nflying = true\n";
    for flag in ["operator_land", "operator_abort"] {
        let mission = Choice::Drawn(mission.to_owned());
        let troubles = vec![(Duration::from_secs(50), Trouble::Flag(flag.into()))];
        let script = Script { mission, ..reference(1, Vec::new()).script }.with(troubles);
        let flight = fly(&script, &config()).unwrap();
        let story = flight.story();
        assert!(story.iter().any(|(_, it)| it.starts_with(&format!("contingency: `{flag}`: land"))), "{story:?}");
        assert_eq!(wrong(&flight), None, "{flag}");
    }
}

/// A flight of the reference mission with this traffic.
#[track_caller]
fn meets(at_s: u64, name: &str, args: &[&str]) -> Flight {
    let args = args.iter().map(|it| (*it).to_owned()).collect();
    let appears = (Duration::from_secs(at_s), Trouble::Fault { name: name.into(), args });
    let script = Script::new(1, Choice::Configured, Policy::Grant, Machine::Ideal, vec![appears]);
    let flight = fly(&script, &config()).unwrap();
    assert_eq!(wrong(&flight), None, "{name}: {:?}", flight.story());
    flight
}

fn count(flight: &Flight, what: &str) -> usize {
    flight.decisions.iter().filter(|(_, it)| it.contains(what)).count()
}

#[test]
fn what_comes_head_on_is_passed_well_aside() {
    for at_s in [25, 45] {
        let flight = meets(at_s, "head_on", &["2000", "30", "crewed"]);
        assert_eq!(count(&flight, "flag `traffic_near` raised"), 1, "{:?}", flight.story());
        assert_eq!(count(&flight, "out of the way, to"), 1, "{:?}", flight.story());
    }
}

#[test]
fn what_stands_is_flown_round_and_no_place_to_land_at() {
    // Over the way, under way, and where the mission ends.
    for (at_s, args) in [(5, ["20", "250", "20", "0", "0", "uncrewed"]), (40, ["0", "500", "0", "0", "0", "vessel"])] {
        let flight = meets(at_s, "intruder", &args);
        assert!(count(&flight, "_near` raised") <= 1, "{:?}", flight.story());
        assert!(1 <= count(&flight, "nothing enters the"), "{:?}", flight.story());
    }
}

#[test]
fn nothing_takes_off_into_the_way_of_what_comes() {
    // At 25 m/s from 1500 m away: it has passed after a minute.
    let flight = meets(0, "intruder", &["-1500", "0", "30", "25", "0", "crewed"]);
    let at = |what: &str| flight.decisions.iter().find(|(_, it)| it.contains(what)).map(|(at, _)| at.as_secs_f64());
    let (over, off) = (at("`traffic_near` is over"), at("step 1 succeeded"));
    assert!(over.is_some() && over < off, "{over:?} {off:?}: {:?}", flight.story());
}

#[test]
fn a_seed_is_one_flight_to_the_bit_and_another_seed_is_another() {
    let (first, again, other) = (reference(3, Vec::new()), reference(3, Vec::new()), reference(4, Vec::new()));
    assert_eq!((first.hash, &first.decisions, first.flown), (again.hash, &again.decisions, again.flown));
    assert_ne!(first.hash, other.hash);
    assert_eq!(LogHash::of_all([first.hash, other.hash]), LogHash::of_all([again.hash, other.hash]));
}

#[test]
fn the_story_of_a_flight_tells_troubles_and_decisions_by_time() {
    let obstacle = (Duration::from_secs(40), Trouble::Flag("obstacle".into()));
    let flight = reference(1, vec![obstacle]);
    let story = flight.story();
    assert!(story.is_sorted_by_key(|(at, _)| *at));
    let trouble = story.iter().position(|(_, what)| what == "trouble: flag obstacle").expect("it is in the story");
    let (_, answer) =
        story[trouble..].iter().find(|(_, what)| what.starts_with("contingency: ")).expect("it is answered");
    assert!(answer.contains("obstacle"), "{answer}");
    assert_eq!(wrong(&flight), None);
}
