//! The end of the processes.

use std::time::{Duration, Instant};

use super::Launcher;
use crate::up::Happening;
use crate::up::supervise::Child;

/// Services that were asked to end and run after this time are killed; then the router is ended.
const SERVICES_END: Duration = Duration::from_millis(2500);
const ROUTER_END: Duration = Duration::from_secs(1);

impl Launcher<'_> {
    /// Ends the services, then the router that they use until then.
    pub(super) fn end_children(&mut self) {
        self.bus.stop();
        let (routers, services): (Vec<_>, Vec<_>) =
            self.children.running().into_iter().partition(|it| *it == Child::Router);
        self.end_all(&services, SERVICES_END);
        self.end_all(&routers, ROUTER_END);
    }

    fn end_all(&mut self, children: &[Child], limit: Duration) {
        children.iter().for_each(|it| self.children.ask_to_end(*it));
        let (until, mut why) = (Instant::now() + limit, format!("did not end within {limit:?}"));
        while children.iter().any(|it| self.children.running().contains(it)) {
            let left = until.saturating_duration_since(Instant::now());
            match self.happenings.recv_timeout(left) {
                Ok(Happening::Ended(child)) => {
                    self.children.reap(child);
                }
                Ok(Happening::Log { child, text }) => self.screen.log(&format!("{child}: {text}")),
                Ok(Happening::Interrupted) => {
                    why = "was asked a second time".to_owned();
                    break;
                }
                Err(_) => break,
                Ok(_) => {}
            }
        }
        for child in children {
            if self.children.running().contains(child) {
                self.screen.log(&format!("{child} {why}: killed"));
            }
            self.children.kill(*child);
            self.children.reap(*child);
        }
    }
}
