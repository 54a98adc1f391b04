//! The launcher's own connection to the bus.

use bus::{Link, Scope, Stop};

use super::Launcher;
use crate::up::Happening;
use crate::up::watch::Watch;

impl Launcher<'_> {
    /// Connects to the bus of the router at `locator`.
    pub(super) fn join(&mut self, locator: &str) {
        let link = Link {
            connect: vec![locator.to_owned()],
            scope: Scope::Fleet,
            open_timeout: self.config.connect_limit_s.seconds(),
        };
        // One that has ended needs no stop any more.
        self.bus = Stop::new();
        let (sender, stop) = (self.sender.clone(), self.bus.clone());
        let watching = std::thread::Builder::new().name("watch".into()).spawn(move || {
            let result = bus::Process::of(&mut Watch(sender.clone()), &link).run(&stop);
            // Fails only while the launcher ends.
            let _ = sender.send(Happening::BusEnded(result));
        });
        if let Err(cause) = watching {
            self.hearing.ended(self.own_now());
            let said = format!("the launcher cannot listen to the bus: {cause}; it tries again");
            if self.logged.insert(said.clone()) {
                self.screen.log(&said);
            }
        }
    }

    /// Connects to the bus again, if that has ended. Meanwhile nobody is said to hang: it is the launcher that hears nothing.
    pub(super) fn keep_hearing(&mut self) {
        let now = self.own_now();
        if self.hearing.is_due(now)
            && let Some(locator) = self.locator.clone()
        {
            self.join(&locator);
        }
        if self.hearing.is_deaf() {
            self.liveness.held_up(now);
            self.supervisor.nobody_can_be_seen(now);
        }
    }
}
