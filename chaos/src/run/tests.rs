//! Runs that end before they are over.

use super::*;
use crate::trouble::Order;
use kittiwake::run::run_file::RunFolder;
use kittiwake_proto::v1;

const LOST: &str = "chaos: the power is lost";

/// A flight whose oracle has found a crash, of a system with this program; it has been up or not.
fn flight<'a>(setup: &'a Arc<Setup>, interrupted: &'a AtomicBool, has_been_up: bool) -> Flight<'a> {
    let (sender, heard) = sync_channel(QUEUE);
    let mut oracle = Oracle::new(Pace::REAL_TIME, Duration::from_secs(8), Vec::new());
    oracle.over(v1::MissionOutcome::Crash);
    Flight {
        setup,
        pace: Pace::REAL_TIME,
        interrupted,
        heard,
        sender,
        system: None,
        taps: None,
        scene: None,
        start: has_been_up.then(Instant::now),
        settled_from: Time::ZERO,
        troubles: VecDeque::new(),
        true_time: TrueTime::default(),
        oracle,
        losses: Losses::default(),
        story: vec![(1.0, LOST.to_owned())],
        last_order: None,
        is_flooded: false,
    }
}

fn concluded(flight: Flight, end: Result<String, String>) -> Result<Run, String> {
    flight.conclude(end, Schedule::of(1), Duration::from_secs(1))
}

#[test]
fn a_system_that_does_not_come_back_is_a_violation_and_what_was_found_before_is_kept() {
    #[track_caller]
    fn check(has_been_up: bool, end: Result<String, String>, expected: Result<&[Violation], &str>) {
        let folder = RunFolder::create("run-test").unwrap();
        let (setup, interrupted) = (Arc::new(Setup::made_up("/bin/false", &folder.0)), AtomicBool::new(false));
        let run = concluded(flight(&setup, &interrupted, has_been_up), end);
        if let Ok(run) = &run {
            assert_eq!(run.story[0].1, LOST);
            assert!(!run.is_interrupted);
        }
        let found = run.as_ref().map(|it| it.violations.as_slice()).map_err(String::as_str);
        assert_eq!(found, expected);
    }
    let silent = || Err("the gateway does not listen".to_owned());
    let not_kept_up = Violation::NotKeptUp("the gateway does not listen".into());
    check(true, silent(), Ok(&[Violation::Crashed, not_kept_up]));
    check(true, Ok("achieved".into()), Ok(&[Violation::Crashed]));
    check(false, silent(), Err("the gateway does not listen"));
}

#[test]
fn what_an_interrupted_run_has_found_is_told_and_its_end_is_no_violation() {
    let folder = RunFolder::create("run-test").unwrap();
    let (setup, interrupted) = (Arc::new(Setup::made_up("/bin/false", &folder.0)), AtomicBool::new(true));
    for end in [Err("interrupted".to_owned()), Ok("exit code 130".to_owned())] {
        let run = concluded(flight(&setup, &interrupted, true), end).unwrap();
        assert_eq!((run.is_interrupted, run.outcome.as_str()), (true, "interrupted"));
        assert_eq!(run.violations, [Violation::Crashed]);
    }
}

#[test]
fn a_system_that_cannot_be_started_after_a_loss_of_power_is_a_violation() {
    for layout in [Layout::OneRouter, Layout::TwoRouters] {
        let folder = RunFolder::create("run-test").unwrap();
        let setup = Arc::new(Setup { layout, ..Setup::made_up("/nowhere/kittiwake", &folder.0) });
        let interrupted = AtomicBool::new(false);
        let mut flight = flight(&setup, &interrupted, true);
        let end = flight.lose_power(Duration::ZERO).and_then(|()| flight.fly());
        let run = concluded(flight, end).unwrap();
        let last = run.violations.last().map(ToString::to_string).unwrap_or_default();
        assert!(last.contains("not kept up: /nowhere/kittiwake"), "{layout:?}: {:?}", run.violations);
        assert_eq!(run.violations[0], Violation::Crashed);
    }
}

#[test]
fn an_order_whose_acceptance_is_heard_in_the_dark_counts_afterwards() {
    let folder = RunFolder::create("run-test").unwrap();
    let (setup, interrupted) = (Arc::new(Setup::made_up("/bin/false", &folder.0)), AtomicBool::new(false));
    let mut flight = flight(&setup, &interrupted, true);
    let accepted = Heard::Ordered { order: Order::Abort, accepted: true, said: "lands here".into() };
    flight.sender.send(accepted).unwrap();
    flight.lose_power(Duration::from_millis(1)).unwrap();
    let takes_off: [Message; 4] = [
        v1::VehicleLocalPosition { position: Some(v1::Ned::default()), ..Default::default() }.into(),
        v1::VehicleStatus { armed: true, ..Default::default() }.into(),
        v1::VehicleLandDetected { landed: false, ..Default::default() }.into(),
        v1::VehicleLocalPosition {
            position: Some(v1::Ned { down_m: -5.0, ..Default::default() }),
            ..Default::default()
        }
        .into(),
    ];
    let later = Now { time: flight.now().time + Duration::from_secs(60), utc_ms: 0 };
    takes_off.iter().for_each(|it| flight.oracle.hears(later, it));
    let expected = Violation::TookOffAfter { order: Order::Abort, at: later.time };
    assert_eq!(flight.oracle.violations(), [Violation::Crashed, expected]);
}
