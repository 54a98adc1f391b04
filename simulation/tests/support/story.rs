//! A whole flight as a story: until something is decided, then to its end.

#![expect(unreachable_pub, reason = "no other crate uses a test: here `pub` means outside of the module")]

use std::borrow::BorrowMut;
use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::MissionOutcome;
use simulation::{Memory, Simulation};

use super::simulation;

/// Every flight of these stories is over by then.
pub const LIMIT: Duration = Duration::from_secs(2400);

/// This number of seconds.
pub const fn s(seconds: u64) -> Duration {
    Duration::from_secs(seconds)
}

/// The reference mission, when this was decided.
#[track_caller]
pub fn when(decided: &str) -> Simulation<'static> {
    when_flown(simulation(None, Policy::Grant), decided)
}

/// This flight, when this was decided.
#[track_caller]
pub fn when_flown(mut simulation: Simulation<'static>, decided: &str) -> Simulation<'static> {
    assert!(simulation.fly_until(decided, LIMIT), "{}", simulation.decision_log());
    simulation
}

/// Kills a process, which is there again with its memory after this time.
pub fn kill(simulation: &mut Simulation<'_>, process: &str, time: Duration) {
    simulation.restart(process, time, Memory::Restored);
}

/// Flies to the end of the mission: the vehicle is on the ground, nothing forbidden has happened, and these parts were decided in
/// this order.
#[track_caller]
pub fn ends<'a>(mut simulation: impl BorrowMut<Simulation<'a>>, outcome: MissionOutcome, expected: &[&str]) {
    let simulation = simulation.borrow_mut();
    let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
    simulation.pass(s(30));
    let log = simulation.decision_log();
    assert_eq!(report.outcome(), outcome, "{log}");
    assert!(simulation.is_on_ground(), "{log}");
    assert_eq!(simulation.breaches(), [], "{log}");
    let mut lines = log.lines();
    for part in expected {
        assert!(lines.any(|it| it.contains(part)), "`{part}` is missing or too early in:\n{log}");
    }
}
