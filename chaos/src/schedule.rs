//! What goes wrong in a run and when: drawn from its seed, so that the seed repeats it.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::RangeInclusive;
use std::time::Duration;

use control_tower::policy::Policy;
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::trouble::ranges::{
    APART_MS, DARK_MS, DELAY_MS, FLOOD_HZ, FLOOD_MS, FULL_MS, LINK_MS, LOOP_DEATHS, MOST_DEATHS, NARROW_BITS_S, OFF_MS,
    STEP_MS, STOP_MS, STORM_MS, STRANGERS, TWO_ROUTERS_WEIGHTS, WEIGHTS,
};
use crate::trouble::{Garbling, Kind, Layout, Machine, Order, Trouble, Victim, Ways};

/// Mission seconds after the start within which troubles begin: the reference mission takes about three minutes.
const WITHIN_S: f64 = 170.0;
/// Number of troubles in a run.
const TROUBLES: RangeInclusive<usize> = 1..=4;
/// Draws of a trouble that would kill a process too often, before the run goes without it.
const DRAWS: u32 = 20;

/// The plan of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Schedule {
    /// What it was drawn from.
    pub seed: u64,
    /// What stands between the processes.
    pub layout: Layout,
    /// How the control tower answers.
    pub permissions: Policy,
    /// Troubles in order, each with the mission time after the start at which it begins.
    pub troubles: Vec<(Duration, Trouble)>,
}

impl Schedule {
    /// Draws it. What is not possible on a machine is drawn all the same, so that a seed is one story everywhere.
    pub fn of(seed: u64) -> Schedule {
        // Fixed for all times and platforms, unlike `StdRng`: a seed in a report stays the same run.
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        // The launcher's systems are what most people start first; the other one has more that can go wrong.
        let layouts = [Layout::OneRouter, Layout::Composed, Layout::TwoRouters, Layout::TwoRouters];
        let layout = *layouts.choose(&mut chance).unwrap_or(&Layout::OneRouter);
        // A tower that denies keeps the vehicle on the ground or at the border for good: there is less to see.
        let permissions = *[Policy::Grant, Policy::Grant, Policy::Delay].choose(&mut chance).unwrap_or(&Policy::Grant);
        let mut moments: Vec<f64> =
            (0..chance.random_range(TROUBLES)).map(|_| chance.random_range(0.0..WITHIN_S)).collect();
        moments.sort_by(f64::total_cmp);
        let mut deaths: BTreeMap<Victim, u32> = BTreeMap::new();
        let mut troubles = Vec::new();
        for moment in moments {
            let drawn = (0..DRAWS).map(|_| draw(&mut chance, layout)).find(|it| bearable(it, &deaths));
            let Some(trouble) = drawn else { continue };
            trouble.deaths().into_iter().for_each(|(victim, count)| *deaths.entry(victim).or_default() += count);
            troubles.push((Duration::from_secs_f64(moment), trouble));
        }
        Schedule { seed, layout, permissions, troubles }
    }

    /// For how much wall time the aircraft's computer is without power in all: nobody on board does anything meanwhile.
    pub fn companion_off(&self) -> Duration {
        let off = |it: &Trouble| if it.kind() == Kind::CompanionOff { it.lasts() } else { Duration::ZERO };
        self.troubles.iter().map(|it| off(&it.1)).sum()
    }
}

/// Whether no process dies so often that the launcher gives up.
fn bearable(trouble: &Trouble, deaths: &BTreeMap<Victim, u32>) -> bool {
    trouble.deaths().iter().all(|(victim, count)| deaths.get(victim).unwrap_or(&0) + count <= MOST_DEATHS)
}

fn draw(chance: &mut ChaCha8Rng, layout: Layout) -> Trouble {
    let of_link = if layout == Layout::TwoRouters { TWO_ROUTERS_WEIGHTS } else { &[] };
    let weights: Vec<&(Kind, u32)> = WEIGHTS.iter().chain(of_link).collect();
    let kind = weights.choose_weighted(chance, |it| it.1).map_or(Kind::Kill, |it| it.0);
    let victim = |chance: &mut ChaCha8Rng| *Victim::of(layout).choose(chance).unwrap_or(&Victim::Mcm);
    match kind {
        Kind::Kill => Trouble::Kill(victim(chance)),
        Kind::Stop => Trouble::Stop(victim(chance), spread(chance, STOP_MS)),
        Kind::DoubleKill => {
            let first = victim(chance);
            let others: Vec<Victim> = Victim::of(layout).iter().copied().filter(|it| *it != first).collect();
            let second = *others.choose(chance).unwrap_or(&Victim::Router);
            Trouble::DoubleKill(first, second, uniform(chance, APART_MS))
        }
        Kind::CrashLoop => Trouble::CrashLoop(victim(chance), chance.random_range(LOOP_DEATHS)),
        Kind::PowerLoss => Trouble::PowerLoss(uniform(chance, DARK_MS)),
        Kind::CompanionOff => Trouble::CompanionOff(spread(chance, OFF_MS)),
        Kind::FullDisk => Trouble::FullDisk(uniform(chance, FULL_MS)),
        Kind::GarbledState => {
            let victim = *Victim::with_state(layout).choose(chance).unwrap_or(&Victim::Mcm);
            let ways = [Garbling::Flipped, Garbling::Cut, Garbling::Emptied];
            Trouble::GarbledState(victim, *ways.choose(chance).unwrap_or(&Garbling::Cut))
        }
        Kind::Strangers => Trouble::Strangers(chance.random_range(STRANGERS)),
        Kind::Flood => Trouble::Flood(chance.random_range(FLOOD_HZ), uniform(chance, FLOOD_MS)),
        Kind::Storm => Trouble::Storm(chance.random(), uniform(chance, STORM_MS)),
        Kind::ClockStep => {
            let machines: &[Machine] = match layout {
                Layout::OneRouter | Layout::Composed => &[Machine::Both],
                Layout::TwoRouters => &[Machine::Aircraft, Machine::Ground, Machine::Both],
            };
            let machine = *machines.choose(chance).unwrap_or(&Machine::Both);
            let step_ms = by_magnitude(chance, STEP_MS) as i64;
            Trouble::ClockStep(machine, if chance.random() { step_ms } else { -step_ms })
        }
        Kind::Cut => {
            let ways = *[Ways::Both, Ways::Down, Ways::Up].choose(chance).unwrap_or(&Ways::Both);
            Trouble::Cut(ways, spread(chance, LINK_MS), chance.random_ratio(1, 3).then(|| order(chance)))
        }
        Kind::Slow => Trouble::Slow(spread(chance, DELAY_MS), spread(chance, LINK_MS)),
        Kind::Narrow => {
            let bits_per_s = by_magnitude(chance, NARROW_BITS_S);
            Trouble::Narrow(bits_per_s, spread(chance, LINK_MS))
        }
        Kind::Ordered => Trouble::Ordered(order(chance)),
        Kind::Revocation => Trouble::Revocation,
    }
}

fn order(chance: &mut ChaCha8Rng) -> Order {
    *[Order::Abort, Order::Return].choose(chance).unwrap_or(&Order::Abort)
}

fn uniform(chance: &mut ChaCha8Rng, range_ms: RangeInclusive<u64>) -> Duration {
    Duration::from_millis(chance.random_range(range_ms))
}

fn spread(chance: &mut ChaCha8Rng, range_ms: RangeInclusive<u64>) -> Duration {
    Duration::from_millis(by_magnitude(chance, range_ms))
}

/// Small ones as often as large ones, by order of magnitude.
fn by_magnitude(chance: &mut ChaCha8Rng, range: RangeInclusive<u64>) -> u64 {
    let (low, high) = ((*range.start() as f64).ln(), (*range.end() as f64).ln());
    chance.random_range(low..=high).exp() as u64
}

impl fmt::Display for Schedule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line = |(at, trouble): &(Duration, Trouble)| format!("{trouble} at {:.0} s", at.as_secs_f64());
        let troubles: Vec<String> = self.troubles.iter().map(line).collect();
        let layout = match self.layout {
            Layout::OneRouter => "one router",
            Layout::Composed => "composed",
            Layout::TwoRouters => "two routers",
        };
        write!(f, "{layout}: {}", troubles.join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_seed_is_always_the_same_story(seed: u64) {
            prop_assert_eq!(Schedule::of(seed), Schedule::of(seed));
        }

        #[test]
        fn troubles_are_in_order_and_no_process_dies_too_often(seed: u64) {
            let it = Schedule::of(seed);
            prop_assert!(!it.troubles.is_empty() && it.troubles.is_sorted_by_key(|it| it.0));
            let needs_two = |it: &Trouble| TWO_ROUTERS_WEIGHTS.iter().any(|(kind, _)| *kind == it.kind());
            prop_assert!(it.layout == Layout::TwoRouters || !it.troubles.iter().any(|it| needs_two(&it.1)), "{}", it);
            for victim in Victim::ALL {
                let deaths = it.troubles.iter().flat_map(|it| it.1.deaths()).filter(|it| it.0 == victim);
                prop_assert!(deaths.map(|it| it.1).sum::<u32>() <= MOST_DEATHS, "{}", it);
            }
        }
    }

    #[test]
    fn every_trouble_befalls_every_process_within_a_campaign() {
        let drawn: Vec<Trouble> = (0..300).flat_map(|seed| Schedule::of(seed).troubles).map(|it| it.1).collect();
        for (kind, _) in WEIGHTS.iter().chain(TWO_ROUTERS_WEIGHTS) {
            assert!(drawn.iter().any(|it| it.kind() == *kind), "{kind:?} is never drawn");
        }
        for victim in Victim::ALL {
            assert!(drawn.contains(&Trouble::Kill(victim)), "{victim} is never killed");
            assert!(
                drawn.iter().any(|it| matches!(it, Trouble::Stop(whom, _) if *whom == victim)),
                "{victim} never stops"
            );
        }
    }

    #[test]
    fn a_run_is_told_in_one_line() {
        let troubles = vec![
            (Duration::from_secs(12), Trouble::DoubleKill(Victim::Mcm, Victim::Router, Duration::from_millis(300))),
            (Duration::from_secs(40), Trouble::GarbledState(Victim::Planner, Garbling::Cut)),
        ];
        let it = Schedule { seed: 1, layout: Layout::TwoRouters, permissions: Policy::Grant, troubles };
        let told = "two routers: kill mcm, and router 0.3 s later at 12 s; kill planner, its state cut in half at 40 s";
        assert_eq!(it.to_string(), told);
    }
}
