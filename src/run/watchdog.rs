//! Notifications to a supervisor such as systemd: that the process is ready, and that its loop keeps running.
//!
//! The loop itself sends them and no other thread does, so they stop when the loop is stuck. Without a supervisor
//! nothing is sent.

use std::time::{Duration, Instant};

use domain::time::{Now, Time};
use kittiwake_proto::topics::{Service, Topic};
use node::{Effect, Event, Node, Token};
use sd_notify::NotifyState;

use crate::run::notify_socket::NotifySocket;

/// Number of signs of life within the supervisor's limit.
const SIGNS: u32 = 4;

/// Sends the notifications as a loop runs.
pub struct Watchdog {
    /// `None` without a supervisor.
    socket: Option<NotifySocket>,
    /// The longest time between two signs of life; `None` if the supervisor wants none.
    period: Option<Duration>,
    last_sign: Option<Instant>,
}

/// A node whose loop is watched. Its loop turns at least with every heartbeat.
pub struct Watched<'a> {
    node: &'a mut dyn Node,
    watchdog: Watchdog,
}

impl Watchdog {
    /// With the supervisor's settings, from the environment.
    pub fn from_environment() -> Watchdog {
        let socket = NotifySocket::from_environment().unwrap_or_else(|cause| {
            tracing::warn!(%cause, "the supervisor cannot be notified");
            None
        });
        Watchdog { socket, period: sd_notify::watchdog_enabled().map(|it| it / SIGNS), last_sign: None }
    }

    /// The loop has completed a turn.
    #[expect(clippy::disallowed_methods, reason = "the supervisor waits on the wall clock")]
    pub fn turned(&mut self) {
        let is_ready_only_now = self.last_sign.is_none();
        let (Some(sign), Some(socket)) = (self.sign(Instant::now()), &self.socket) else { return };
        match socket.notify(&sign) {
            // There was no room. A sign of life may be left out, but not that the process is ready: the next turn says it.
            Ok(false) if is_ready_only_now => self.last_sign = None,
            Ok(_) => {}
            // A supervisor that has ended cannot be notified.
            Err(cause) => tracing::warn!(%cause, "the supervisor cannot be notified"),
        }
    }

    /// The first turn means that the process is ready.
    fn sign(&mut self, now: Instant) -> Option<NotifyState<'static>> {
        let sign = match (self.last_sign, self.period) {
            (None, _) => NotifyState::Ready,
            (Some(last), Some(period)) if last + period <= now => NotifyState::Watchdog,
            (Some(_), _) => return None,
        };
        self.last_sign = Some(now);
        Some(sign)
    }
}

impl<'a> Watched<'a> {
    /// Watches `node`.
    pub fn new(node: &'a mut dyn Node) -> Watched<'a> {
        Watched { node, watchdog: Watchdog::from_environment() }
    }
}

impl Node for Watched<'_> {
    fn name(&self) -> &'static str {
        self.node.name()
    }

    fn subscriptions(&self) -> &'static [Topic] {
        self.node.subscriptions()
    }

    fn serves(&self) -> &'static [Service] {
        self.node.serves()
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        self.node.on(now, event, effects);
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.node.act(now, effects);
        self.watchdog.turned();
    }

    fn answers_later(&self, token: Token) -> bool {
        self.node.answers_later(token)
    }

    fn deadline(&self) -> Option<Time> {
        self.node.deadline()
    }

    fn is_over(&self) -> bool {
        self.node.is_over()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Turns at these milliseconds; the notification at each: `R`eady, `W`atchdog, or nothing.
    #[track_caller]
    #[expect(clippy::disallowed_methods, reason = "any moment to begin with")]
    fn check(patience_ms: Option<u64>, turns_ms: &[u64], expected: &str) {
        let period = patience_ms.map(|it| Duration::from_millis(it) / SIGNS);
        let mut watchdog = Watchdog { socket: None, period, last_sign: None };
        let start = Instant::now();
        let said = turns_ms.iter().map(|at| match watchdog.sign(start + Duration::from_millis(*at)) {
            Some(NotifyState::Ready) => 'R',
            Some(NotifyState::Watchdog) => 'W',
            Some(_) => '?',
            None => '.',
        });
        assert_eq!(said.collect::<String>(), expected, "patience {patience_ms:?}");
    }

    #[test]
    fn the_first_turn_is_readiness_and_later_ones_are_signs_of_life() {
        check(Some(4000), &[0, 500, 999, 1000, 1500, 2000, 2001], "R..W.W.");
        check(Some(4000), &[0, 9000, 9001], "RW.");
    }

    #[test]
    fn without_a_watchdog_only_readiness_is_notified() {
        check(None, &[0, 1000, 100_000], "R..");
    }

    #[test]
    fn readiness_for_which_there_is_no_room_is_notified_later() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("notify");
        let supervisor = std::os::unix::net::UnixDatagram::bind(&path).unwrap();
        let socket = NotifySocket::at(path.as_os_str()).unwrap();
        while socket.notify(&NotifyState::Watchdog).unwrap() {}
        let mut watchdog = Watchdog { socket: Some(socket), period: None, last_sign: None };
        watchdog.turned();
        assert_eq!(watchdog.last_sign, None);
        let mut bytes = [0; 64];
        supervisor.set_nonblocking(true).unwrap();
        while supervisor.recv(&mut bytes).is_ok() {}
        watchdog.turned();
        let length = supervisor.recv(&mut bytes).unwrap();
        assert_eq!(str::from_utf8(&bytes[..length]).unwrap().trim(), "READY=1");
    }

    /// `act` of this node does not return from the third turn on, by its own clock.
    struct Stuck(u32);

    impl Node for Stuck {
        fn name(&self) -> &'static str {
            "stuck"
        }
        fn subscriptions(&self) -> &'static [Topic] {
            &[]
        }
        fn on(&mut self, _: Now, _: Event, _: &mut Vec<Effect>) {}
        fn act(&mut self, _: Now, _: &mut Vec<Effect>) {
            self.0 += 1;
            assert!(self.0 < 3, "hangs");
        }
        fn deadline(&self) -> Option<Time> {
            None
        }
    }

    #[test]
    fn a_turn_that_does_not_end_is_no_sign_of_life() {
        let mut stuck = Stuck(0);
        let watchdog = Watchdog { socket: None, period: Some(Duration::ZERO), last_sign: None };
        let mut watched = Watched { node: &mut stuck, watchdog };
        let mut signs = Vec::new();
        for _ in 0..3 {
            let turn = std::panic::AssertUnwindSafe(|| watched.act(Now::default(), &mut Vec::new()));
            let _ = std::panic::catch_unwind(turn);
            signs.push(watched.watchdog.last_sign);
        }
        assert!(signs[0] < signs[1], "the second turn is a sign");
        assert_eq!(signs[1], signs[2], "the third never ended");
    }
}
