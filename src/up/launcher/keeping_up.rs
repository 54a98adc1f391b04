//! What has ended is started again, and what hangs is killed for it; what the run has on disk is kept there.

use super::{End, Launcher};
use crate::run::run_file::RunFile;
use crate::setup::access::DemoAccess;
use crate::up::supervise::{Child, Ending, Verdict};

impl Launcher<'_> {
    /// Starts those whose time it is.
    pub(super) fn start_due(&mut self) -> Option<End> {
        let due = self.supervisor.due(self.own_now());
        if !due.is_empty() {
            self.restore_files();
        }
        for child in due {
            if let Err(cause) = self.children.start(child, self.locator.as_deref()) {
                // Like a death: what the operating system lacks now it may have again later.
                self.screen.log(&format!("{child} cannot be started: {cause}"));
                if let Some(end) = self.judge(child, Ending::NotStarted) {
                    return Some(end);
                }
            }
        }
        None
    }

    /// Without its files nothing could be started.
    fn restore_files(&self) {
        let access = self.demo.as_ref().map_or(Ok(false), DemoAccess::restore);
        match self.files.restore().and_then(|files| Ok(files || access?)) {
            Ok(false) => {}
            Ok(true) => self.screen.log("files of this run were removed or changed: they are written again"),
            Err(cause) => {
                self.screen.log(&format!("files of this run were removed or changed and cannot be written: {cause}"))
            }
        }
    }

    /// Kills the children that hang; they are started again as soon as they have ended. So is a router whose socket was
    /// removed: a process started from here on would find it nowhere, and a new router makes a new socket.
    pub(super) fn end_what_hangs(&mut self) {
        if self.children.router_is_nowhere() && self.supervisor.router_is_seen() {
            self.screen.log("the router's socket was removed: the router is killed, to be started again");
            self.supervisor.hangs(Child::Router, self.own_now());
            self.children.kill(Child::Router);
        }
        let limit = self.config.launcher.hung_after_s.seconds();
        for child in self.liveness.hung(self.own_now(), self.supervisor.router_is_seen()) {
            if self.supervisor.hangs(child, self.own_now()) {
                self.screen.log(&format!("{child} does not answer for {limit:?}: killed, to be started again"));
                self.children.kill(child);
            }
        }
        // At first all start at once, and who is missing then ends the system: see `check_start`. One alone needs less time.
        let start_limit = self.config.launcher.start_limit_s.seconds();
        if self.run_file.is_some() || start_limit <= self.own_now() {
            let overdue = self.supervisor.overdue(self.own_now(), start_limit / 2);
            for (child, limit) in &overdue {
                self.screen
                    .log(&format!("{child} is not seen {limit:?} after it was started: killed, to be started again"));
                self.children.kill(*child);
            }
            if !overdue.is_empty() && self.supervisor.nobody_is_seen() {
                self.screen.log("the router listens, and nobody is seen: it is killed as well, to be started again");
                self.supervisor.hangs(Child::Router, self.own_now());
                self.children.kill(Child::Router);
            }
        }
    }

    /// Who cleans up temporary files does not know that a system runs: commands are to find it, and the next run is to leave its folders alone.
    pub(super) fn keep_places(&mut self) {
        self.children.hold_sockets();
        if let Some(state) = &self.state {
            state.hold();
        }
        let said = match self.run_file.as_mut().map_or(Ok(false), RunFile::restore) {
            Ok(false) => return,
            Ok(true) => "the run file was removed: it is written again".to_owned(),
            Err(cause) => {
                format!("the run file was removed, so no command finds this system, and it cannot be written: {cause}")
            }
        };
        if self.logged.insert(said.clone()) {
            self.screen.log(&said);
        }
    }

    pub(super) fn on_ended(&mut self, child: Child) -> Option<End> {
        let ending = self.children.reap(child)?;
        self.liveness.ended(child);
        self.judge(child, ending)
    }

    /// What follows when a child has ended so.
    fn judge(&mut self, child: Child, ending: Ending) -> Option<End> {
        match self.supervisor.ended(child, ending, self.own_now(), self.aircraft.may_be_in_the_air(self.now())) {
            Verdict::Restart(delay) => {
                self.screen.log(&format!("{child} ended {ending}; it is started again in {delay:?}"));
                None
            }
            Verdict::KeepTrying(delay, reason) => {
                self.screen.log(&format!(
                    "{reason}; the aircraft may be in the air, so it is started again every {delay:?} until it is seen on the ground"
                ));
                None
            }
            Verdict::GiveUp(reason) if ending.is_refusal() && self.run_file.is_none() => Some(End::Refused(reason)),
            Verdict::GiveUp(reason) => Some(End::GaveUp(reason)),
        }
    }
}
