//! What holds for any sequence of samples and injections.

use std::collections::BTreeSet;

use domain::time::Pace;
use kittiwake_proto::topics::Topic;
use kittiwake_proto::v1;
use proptest::prelude::*;

use crate::stories::rig::{Rig, s, table};

#[derive(Debug, Clone)]
enum Step {
    Battery(f64),
    Accuracy(f64),
    Status { armed: bool, failures: Vec<i32> },
    Landed(bool),
    Inject { flag: &'static str, raised: bool },
    Wait(u64),
    Stall(u64),
    Fly(u32),
    Freeze(bool),
}

const RULES: &[(&str, &str)] = &[
    (
        "energy",
        "when = 'known(battery.charge_percent) and battery.charge_percent < 40 %'\nclear_when = 'battery.charge_percent >= 60 %'",
    ),
    (
        "accuracy",
        "when = 'known(position.horizontal_deviation_m) and position.horizontal_deviation_m > 6 m'\nclear_when = 'position.horizontal_deviation_m <= 4 m'\nfor_s = 0.2\nduring = 'flying'",
    ),
    ("gnss", "when = 'known(gnss.lost) and gnss.lost'\nfor_s = 0.1\nduring = 'armed'"),
    ("battery_stale", "when = 'battery.silent_s >= 0.3 s'"),
    ("position_stale", "when = 'position.silent_s >= 0.3 s'\nduring = 'armed'"),
];

fn step() -> impl Strategy<Value = Step> {
    let flag = prop::sample::select(vec!["energy", "battery_stale", "transition_failed", "made_up"]);
    prop_oneof![
        prop_oneof![0.0..=1.0, Just(f64::NAN), Just(-1.0)].prop_map(Step::Battery),
        prop_oneof![0.0..10.0, Just(f64::INFINITY)].prop_map(Step::Accuracy),
        (any::<bool>(), prop::collection::vec(0..9, 0..3))
            .prop_map(|(armed, failures)| Step::Status { armed, failures }),
        any::<bool>().prop_map(Step::Landed),
        (flag, any::<bool>()).prop_map(|(flag, raised)| Step::Inject { flag, raised }),
        (0_u64..600).prop_map(Step::Wait),
        (0_u64..600).prop_map(Step::Stall),
        (1_u32..120).prop_map(Step::Fly),
        any::<bool>().prop_map(Step::Freeze),
    ]
}

fn take(rig: &mut Rig, step: &Step) {
    let vehicle = &mut rig.vehicle;
    match step {
        Step::Battery(remaining) => {
            let battery = v1::BatteryStatus { remaining: *remaining, ..vehicle.battery };
            rig.hear([battery.into()]);
        }
        Step::Accuracy(eph_m) => {
            vehicle.local_position.eph_m = *eph_m;
            let local_position = vehicle.local_position;
            rig.hear([local_position.into()]);
        }
        Step::Status { armed, failures } => {
            vehicle.status = v1::VehicleStatus { armed: *armed, failures: failures.clone(), ..vehicle.status.clone() };
            let status = vehicle.status.clone();
            rig.hear([status.into()]);
        }
        Step::Landed(landed) => {
            vehicle.land_detected.landed = *landed;
            let land_detected = vehicle.land_detected;
            rig.hear([land_detected.into()]);
        }
        Step::Inject { flag, raised } => rig.inject(flag, *raised),
        Step::Wait(ms) => rig.wait(s(*ms as f64 / 1000.0)),
        Step::Stall(ms) => rig.stall(s(*ms as f64 / 1000.0)),
        Step::Fly(samples) => rig.fly(f64::from(*samples) / 100.0),
        Step::Freeze(frozen) => {
            vehicle.frozen = if *frozen { vec![Topic::VehicleLocalPosition, Topic::BatteryStatus] } else { vec![] };
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_change_of_the_list_is_published_at_once_and_no_flag_is_listed_twice(
        steps in prop::collection::vec(step(), 1..60),
        speed in prop::sample::select(vec![1.0, 20.0]),
    ) {
        let mut rig = Rig::with(&table(RULES), Pace::new(speed).unwrap());
        for step in &steps {
            take(&mut rig, step);
        }
        let known = RULES.iter().map(|(flag, _)| *flag).chain(["transition_failed"]).collect::<BTreeSet<_>>();
        let mut before = BTreeSet::new();
        for (at, it) in rig.introspections() {
            let listed: BTreeSet<_> = it.flags.iter().map(|it| (it.name.clone(), it.rise)).collect();
            prop_assert_eq!(it.flags.len(), it.flags.iter().map(|it| &it.name).collect::<BTreeSet<_>>().len());
            prop_assert!(it.flags.iter().all(|it| known.contains(it.name.as_str()) && !it.reason.is_empty()));
            prop_assert!(it.undecided_flags.iter().all(|name| it.flags.iter().all(|flag| flag.name != *name)));
            // An injection is published although it may change nothing.
            prop_assert!(listed == before || it.flags_changed, "{listed:?} after {before:?} at {at:?}");
            before = listed;
        }
    }

    #[test]
    fn a_flag_that_has_risen_is_listed_for_a_tenth_of_a_second(
        charges in prop::collection::vec((0.0..=1.0, 0_u64..40), 1..60),
    ) {
        let mut rig = Rig::with(&table(&RULES[..1]), Pace::REAL_TIME);
        for (remaining, wait_ms) in charges {
            let battery = v1::BatteryStatus { remaining, ..rig.vehicle.battery };
            rig.hear([battery.into()]);
            rig.wait(s(wait_ms as f64 / 1000.0));
        }
        let mut rose = None;
        for change in rig.changes() {
            if change.raised.is_some() {
                rose = Some(change.at);
            } else if let Some(rose) = rose.take() {
                prop_assert!(s(0.1) <= change.at - rose);
            }
        }
    }
}
