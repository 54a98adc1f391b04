//! Ends a process whose loop is stuck, for a supervisor that starts again only what has ended, as a container engine does.
//!
//! A thread of its own looks several times within the limit whether the loop has turned since. It ends the process by `abort`, as the
//! watchdog of systemd does, since any other end could wait for what is stuck.
//!
//! A process that was stopped, frozen or left without a processor is not stuck: this thread was held up as well then, and counts from the
//! beginning. So it cannot end a process that stays frozen.

#![expect(clippy::disallowed_methods, reason = "waiting for a hung process takes the wall clock")]

use std::ops::RangeInclusive;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use bus::Stop;

use crate::outcome::Outcome;
use crate::output;

/// In the environment, as the settings of other supervisors are: the limit in seconds. Without it nothing is ended.
const VARIABLE: &str = "KITTIWAKE_END_IF_STUCK_S";
const LIMITS_S: RangeInclusive<u64> = 1..=600;
/// A process waits for its router and its disk before its first turn; `TimeoutStartSec` of the unit of systemd is the same.
const START_LIMIT: Duration = Duration::from_secs(30);
/// Besides the time for which it waits for its router: for its disk, and until it knows that it is the only one.
const BESIDE_ROUTER: Duration = Duration::from_secs(15);
/// After its last turn it closes what it has, each with a limit of its own. No limit of a turn holds for that.
const END_LIMIT: Duration = Duration::from_secs(30);
/// Number of looks within the limit.
const LOOKS: u32 = 4;

/// Why a process cannot start.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// The environment sets no limit that makes sense.
    #[error("{VARIABLE}: found `{0}`, expected whole seconds, {start} to {end}", start = LIMITS_S.start(), end = LIMITS_S.end())]
    Limit(String),
    /// The operating system has no thread.
    #[error("the operating system refuses a thread: {0}")]
    Thread(#[from] std::io::Error),
}

impl Failure {
    /// Whether it helps to try again.
    pub fn outcome(&self) -> Outcome {
        match self {
            Failure::Limit(_) => Outcome::BadInput,
            Failure::Thread(_) => Outcome::NotKeptUp,
        }
    }
}

/// The number of turns that the loop of this process has completed, and what counts before the first and after the last.
#[derive(Debug, Clone, Default)]
pub struct Turns(Arc<Counted>);

#[derive(Debug, Default)]
struct Counted {
    turns: AtomicU64,
    /// For how long this process waits for its router, in milliseconds.
    waits_for_router_ms: AtomicU64,
    is_ending: AtomicBool,
}

/// What can be seen of a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Before its first turn.
    Start,
    /// The number of turns it has completed.
    Turning(u64),
    /// After its last one.
    End,
}

impl Turns {
    /// Of the process `name`, which is ended once they do not go on, if the environment wants that.
    ///
    /// # Errors
    /// If the limit makes no sense, or there is no thread.
    pub fn that_must_go_on(name: &'static str) -> Result<Turns, Failure> {
        let turns = Turns::default();
        if let Some(limit) = limit(std::env::var_os(VARIABLE).map(|it| it.to_string_lossy().into_owned()))? {
            let counted = turns.clone();
            std::thread::Builder::new().name("stuck".into()).spawn(move || end_once_stuck(name, limit, &counted))?;
        }
        Ok(turns)
    }

    /// The loop has completed another one.
    pub fn add_one(&self) {
        self.0.turns.fetch_add(1, Ordering::Relaxed);
    }

    /// The process waits for its router up to `limit`, and may.
    pub fn wait_for_router(&self, limit: Duration) {
        let limit_ms = u64::try_from(limit.as_millis()).unwrap_or(u64::MAX);
        self.0.waits_for_router_ms.store(limit_ms, Ordering::Relaxed);
    }

    /// They end with the loop of `stop`.
    pub fn end_with(&self, stop: &Stop) {
        let counted = self.0.clone();
        stop.on_end(move || counted.is_ending.store(true, Ordering::Relaxed));
    }

    pub(super) fn count(&self) -> u64 {
        self.0.turns.load(Ordering::Relaxed)
    }

    fn phase(&self) -> Phase {
        match self.count() {
            _ if self.0.is_ending.load(Ordering::Relaxed) => Phase::End,
            0 => Phase::Start,
            count => Phase::Turning(count),
        }
    }

    fn start_limit(&self) -> Duration {
        start_limit(Duration::from_millis(self.0.waits_for_router_ms.load(Ordering::Relaxed)))
    }
}

/// Of a process that waits this long for its router.
fn start_limit(waits_for_router: Duration) -> Duration {
    START_LIMIT.max(waits_for_router.saturating_add(BESIDE_ROUTER))
}

/// An empty value counts as unset.
fn limit(variable: Option<String>) -> Result<Option<Duration>, Failure> {
    let Some(text) = variable.filter(|it| !it.is_empty()) else { return Ok(None) };
    match text.parse() {
        Ok(seconds) if LIMITS_S.contains(&seconds) => Ok(Some(Duration::from_secs(seconds))),
        _ => Err(Failure::Limit(text)),
    }
}

fn end_once_stuck(name: &str, limit: Duration, turns: &Turns) {
    let mut patience = Patience::new(limit, Instant::now());
    loop {
        std::thread::sleep(limit / LOOKS);
        if let Some(why) = patience.exhausted(Instant::now(), turns.phase(), turns.start_limit()) {
            output::error_line(format_args!("{name}: {why}: it ends itself, to be started again"));
            output::finish();
            std::process::abort();
        }
    }
}

/// Decides from looks at a loop whether it is stuck. Its clock must not run on while the machine sleeps.
struct Patience {
    limit: Duration,
    /// What was seen.
    phase: Phase,
    /// When it was first seen, or since when this has not been held up.
    since: Instant,
    last_look: Instant,
}

impl Patience {
    fn new(limit: Duration, now: Instant) -> Patience {
        Patience { limit, phase: Phase::Start, since: now, last_look: now }
    }

    /// Looks at a loop that may take `start_limit` to its first turn; returns why its time is over, if so.
    fn exhausted(&mut self, now: Instant, phase: Phase, start_limit: Duration) -> Option<String> {
        let was_held_up = self.last_look + 2 * (self.limit / LOOKS) < now;
        self.last_look = now;
        if was_held_up || phase != self.phase {
            (self.phase, self.since) = (phase, now);
        }
        let (what, limit) = match phase {
            Phase::Start => ("is not up after", self.limit.max(start_limit)),
            Phase::Turning(_) => ("its loop has been stuck for", self.limit),
            Phase::End => ("has not ended after", self.limit.max(END_LIMIT)),
        };
        (limit <= now.saturating_duration_since(self.since)).then(|| format!("{what} {limit:?}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::process::ExitStatusExt;
    use std::process::Command;

    /// Looks with a limit of four seconds, each a time in milliseconds and the turns that are seen then; when patience is exhausted.
    #[track_caller]
    fn check(looks: impl IntoIterator<Item = (u64, u64)>, expected: Option<(u64, &str)>) {
        let phase = |turns| if turns == 0 { Phase::Start } else { Phase::Turning(turns) };
        check_phases(looks.into_iter().map(|(at, turns)| (at, phase(turns))), Duration::ZERO, expected);
    }

    /// The same with a process that waits this long for its router.
    #[track_caller]
    fn check_phases(
        looks: impl IntoIterator<Item = (u64, Phase)>,
        waits_for_router: Duration,
        expected: Option<(u64, &str)>,
    ) {
        let start = Instant::now();
        let mut patience = Patience::new(Duration::from_secs(4), start);
        let mut look =
            |at, phase| patience.exhausted(start + Duration::from_millis(at), phase, start_limit(waits_for_router));
        let mut exhausted = looks.into_iter().filter_map(|(at, phase)| Some((at, look(at, phase)?)));
        assert_eq!(exhausted.next(), expected.map(|(at, why)| (at, why.to_owned())));
    }

    /// A look each second from `from` to `to`, at a loop that does not turn.
    fn stuck_at(turns: u64, from: u64, to: u64) -> impl Iterator<Item = (u64, u64)> {
        (from..=to).map(move |second| (1000 * second, turns))
    }

    const STUCK: &str = "its loop has been stuck for 4s";

    #[test]
    fn a_loop_that_turns_is_never_stuck() {
        check((0..1000).map(|second| (1000 * second, 1 + second)), None);
        // Three looks see the same turns, as when one takes nearly as long as it may.
        check((0..1000).map(|second| (1000 * second, 1 + second / 4)), None);
    }

    #[test]
    fn a_loop_that_does_not_turn_for_the_limit_is_stuck() {
        check(stuck_at(7, 1, 60), Some((5000, STUCK)));
        check(stuck_at(7, 1, 4).chain(stuck_at(8, 5, 60)), Some((9000, STUCK)));
        // A little late each time, as on a busy machine.
        check((1..60).map(|look| (1900 * look, 7)), Some((1900 * 4, STUCK)));
    }

    #[test]
    fn a_process_that_was_stopped_is_not_stuck_unless_it_is_so_afterwards() {
        let stopped = |from, to| stuck_at(7, 1, 4).chain(stuck_at(7, from, from)).chain(stuck_at(8, from + 1, to));
        check(stopped(3600, 3602), None);
        check(stopped(3600, 3660), Some((3_605_000, STUCK)));
        // One that is stopped again and again, and has no time for a turn in between.
        check((1..1000).map(|look| (2001 * look, 7)), None);
    }

    #[test]
    fn a_process_has_more_time_until_its_first_turn() {
        check(stuck_at(0, 1, 29), None);
        check(stuck_at(0, 1, 60), Some((30_000, "is not up after 30s")));
        check(stuck_at(0, 1, 25).chain(stuck_at(1, 26, 60)), Some((30_000, STUCK)));
    }

    #[test]
    fn a_process_may_wait_for_its_router_for_as_long_as_it_is_configured_to() {
        let waits = |to| (1..=to).map(|second| (1000 * second, Phase::Start));
        check_phases(waits(60), Duration::from_secs(10), Some((30_000, "is not up after 30s")));
        check_phases(waits(614), Duration::from_secs(600), None);
        check_phases(waits(700), Duration::from_secs(600), Some((615_000, "is not up after 615s")));
        let turns = Turns::default();
        assert_eq!(turns.start_limit(), START_LIMIT, "before the configuration is read");
        turns.wait_for_router(Duration::from_secs(600));
        assert_eq!(turns.start_limit(), Duration::from_secs(615));
    }

    #[test]
    fn what_is_closed_after_the_last_turn_is_not_held_to_the_limit_of_a_turn() {
        let ends = |to| {
            let turns = stuck_at(7, 1, 4).map(|(at, turns)| (at, Phase::Turning(turns)));
            turns.chain((5..=to).map(|second| (1000 * second, Phase::End)))
        };
        check_phases(ends(34), Duration::ZERO, None);
        check_phases(ends(60), Duration::ZERO, Some((35_000, "has not ended after 30s")));
    }

    #[test]
    fn the_end_begins_when_it_is_asked_for() {
        let (turns, stop) = (Turns::default(), Stop::new());
        turns.end_with(&stop);
        assert_eq!(turns.phase(), Phase::Start);
        turns.add_one();
        assert_eq!(turns.phase(), Phase::Turning(1));
        stop.stop();
        assert_eq!(turns.phase(), Phase::End);
        let late = Turns::default();
        late.end_with(&stop);
        assert_eq!(late.phase(), Phase::End);
    }

    #[test]
    fn a_limit_is_whole_seconds_and_none_is_none() {
        #[track_caller]
        fn check(variable: Option<&str>, expected: Result<Option<u64>, &str>) {
            let found = limit(variable.map(str::to_owned)).map(|it| it.map(|limit| limit.as_secs()));
            assert_eq!(found.map_err(|it| it.to_string()), expected.map_err(str::to_owned));
        }
        check(None, Ok(None));
        check(Some(""), Ok(None));
        check(Some("3"), Ok(Some(3)));
        check(Some("0"), Err("KITTIWAKE_END_IF_STUCK_S: found `0`, expected whole seconds, 1 to 600"));
        check(Some("3s"), Err("KITTIWAKE_END_IF_STUCK_S: found `3s`, expected whole seconds, 1 to 600"));
    }

    /// The process of the test below; without the variable there is nothing to do.
    #[test]
    fn a_loop_with_one_turn() {
        if std::env::var_os(VARIABLE).is_some() {
            Turns::that_must_go_on("mcm").unwrap().add_one();
            loop {
                std::thread::park();
            }
        }
    }

    #[test]
    fn a_process_that_is_stuck_ends_and_says_why() {
        let mut child = Command::new(std::env::current_exe().unwrap());
        child.args(["--exact", "run::stuck::tests::a_loop_with_one_turn", "--nocapture"]).env(VARIABLE, "1");
        let output = child.output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.signal(), Some(nix::libc::SIGABRT), "{said}");
        assert!(said.contains("mcm: its loop has been stuck for 1s: it ends itself, to be started again"), "{said}");
    }

    #[test]
    fn every_container_that_is_started_again_ends_itself_when_it_is_stuck() {
        for file in [
            include_str!("../../deploy/compose.yaml"),
            include_str!("../../deploy/compose.px4.yaml"),
            include_str!("../../deploy/compose.mavlink.yaml"),
        ] {
            let started_again = file.matches("restart: unless-stopped").count();
            let set = file.matches(&format!("environment: {{ {VARIABLE}: \"3\" }}")).count();
            assert_eq!((started_again, file.matches("environment:").count()), (set, set));
            assert_eq!(set, 1);
        }
    }
}
