//! What holds for any sequence of samples and injections.

use std::collections::BTreeSet;

use domain::time::Pace;
use kittiwake_proto::topics::{Message, Topic};
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
        "{ fact = 'below', value = 'battery-remaining', threshold = 0.4, clear = 0.6, for_s = 0.0, during = 'always' }",
    ),
    (
        "accuracy",
        "{ fact = 'above', value = 'horizontal-accuracy', threshold = 6.0, clear = 4.0, for_s = 0.2, during = 'flying' }",
    ),
    ("gnss", "{ fact = 'reported', condition = 'gnss-lost', for_s = 0.1, during = 'armed' }"),
    ("battery_stale", "{ fact = 'stale', source = 'battery', after_s = 0.3, during = 'always' }"),
    ("position_stale", "{ fact = 'stale', source = 'local-position', after_s = 0.3, during = 'armed' }"),
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

/// Takes the step. An event of the injector is put in its place among those of the monitor.
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
        Step::Inject { flag, raised } => {
            let (name, source) = (flag.to_string(), "injector".to_string());
            let event = v1::FlagEvent { name, raised: *raised, source, ..Default::default() };
            rig.said.push((rig.now(), event.clone().into()));
            rig.hear([event.into()]);
        }
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
    fn the_introspection_lists_what_was_raised_and_not_cleared(
        steps in prop::collection::vec(step(), 1..60),
        speed in prop::sample::select(vec![1.0, 20.0]),
    ) {
        let mut rig = Rig::with(&table(RULES), Pace::new(speed).unwrap());
        for step in &steps {
            take(&mut rig, step);
        }
        let known = RULES.iter().map(|(flag, _)| *flag).chain(["transition_failed"]).collect::<BTreeSet<_>>();
        // Source and name of every flag that is up.
        let mut up = BTreeSet::<(String, String)>::new();
        for (at, message) in &rig.said {
            match message {
                Message::FlagEvent(it) => {
                    let key = (it.source.clone(), it.name.clone());
                    let changed = if it.raised { up.insert(key) } else { up.remove(&key) };
                    prop_assert!(changed || it.source == "injector", "two events for one change of {} at {at:?}", it.name);
                    prop_assert!(!it.reason.is_empty() || it.source == "injector");
                }
                Message::Introspection(it) => {
                    let listed: Vec<_> = it.flags.iter().map(|it| it.name.as_str()).collect();
                    let expected: BTreeSet<_> =
                        up.iter().map(|(_, name)| name.as_str()).filter(|it| known.contains(it)).collect();
                    prop_assert_eq!(listed.iter().copied().collect::<BTreeSet<_>>(), expected, "at {:?}", at);
                    prop_assert_eq!(listed.len(), listed.iter().collect::<BTreeSet<_>>().len());
                }
                other => prop_assert!(false, "{other:?}"),
            }
        }
    }
}
