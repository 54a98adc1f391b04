//! The beginning and the end of a mission, as the launcher prints them.

use std::process::{Command, Stdio};

use kittiwake_proto::v1::MissionReport;

use super::{End, Launcher};
use crate::backend::Backend;
use crate::outcome::Outcome;
use crate::output;
use crate::run::run_file::{RunFile, Running};
use crate::up::aircraft::State;
use crate::up::report;

/// Whether the desktop was asked to show the page. Other users of this machine can read the link in its list of processes for a moment: only
/// `kittiwake demo`, which flies a simulator, calls this.
fn open_in_browser(link: &str) -> bool {
    let mut opener = Command::new("xdg-open");
    let started = opener.arg(link).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    // It is waited for, so that it leaves no zombie; a browser may stay as long as its user likes.
    started.is_ok_and(|mut it| std::thread::Builder::new().spawn(move || it.wait()).is_ok())
}

impl Launcher<'_> {
    /// Once all processes are seen: prints the addresses, and lets `inject` and `status` find the system.
    pub(super) fn check_start(&mut self) -> Option<End> {
        if self.run_file.is_some() {
            return None;
        }
        let missing = self.supervisor.missing();
        if let (true, Some(connect), Some(http)) = (missing.is_empty(), &self.locator, &self.http) {
            let (vehicle, config) = (self.config.vehicle.to_string(), self.files.settings.config.clone());
            let token = self.demo.as_ref().map(|it| it.token.clone()).unwrap_or_default();
            let (pid, connect, http) = (std::process::id(), connect.clone(), http.clone());
            let ca = self.config.gateway.tls_certificate.clone();
            let running = Running { pid, connect, http, token, vehicle, config, ca };
            // First the file, then the lines: who has read them may look for the system.
            return match RunFile::write(&running) {
                Ok(file) => {
                    self.run_file = Some(file);
                    self.tell_addresses(&running);
                    None
                }
                Err(cause) => self.give_up_on_ground(format!("cannot write the run file: {cause}")),
            };
        }
        let limit = self.config.launcher.start_limit_s.seconds();
        if self.own_now() < limit {
            return None;
        }
        let names: Vec<_> = missing.iter().map(|it| it.name()).collect();
        self.give_up_on_ground(format!("not seen within {limit:?}: {}", names.join(", ")))
    }

    /// Ends the launcher, unless the aircraft may be in the air: then its processes are kept up, and the reason is logged once.
    pub(super) fn give_up_on_ground(&mut self, why: String) -> Option<End> {
        if !self.aircraft.may_be_in_the_air(self.now()) {
            return Some(End::GaveUp(why));
        }
        if self.logged.insert(why.clone()) {
            self.screen.log(&format!(
                "{why}; the aircraft may be in the air, so its processes are kept up until it is seen on the ground"
            ));
        }
        None
    }

    fn tell_addresses(&self, running: &Running) {
        let Running { connect, http, vehicle, .. } = running;
        self.screen.line(&format!(
            "{} is up: speed {}, permissions {}, seed {}, router {connect}\nstatus: {http}/api/v1/vehicles/{}",
            vehicle, self.config.speed, self.config.permissions, self.config.seed, vehicle
        ));
        match self.backend {
            Backend::Sim => {}
            Backend::Px4 => {
                self.screen.line(&format!("vehicle: px4, awaited at {}", self.config.px4_bridge.endpoint));
            }
            Backend::Mavlink => {
                self.screen.line(&format!("vehicle: over MAVLink, {}", self.config.mavlink_bridge.connect));
            }
        }
        if self.demo.is_some() {
            let link = format!("{http}/#token={}", running.token);
            self.screen.line(&format!("operate: {link}"));
            if self.args.opens_page && !open_in_browser(&link) {
                self.screen.line("no browser was found: open the link above");
            }
        }
        if let Some(folder) = &self.recordings {
            self.screen.line(&format!("recordings: {}", folder.display()));
        }
    }

    pub(super) fn check_report(&mut self) -> Option<End> {
        if self.reported.is_some() && self.progress.report().is_none() && !self.args.exit_when_done {
            // An operator has begun the next mission: it gets a report of its own.
            self.reported = None;
        }
        if self.reported.is_none() {
            let report = self.progress.report()?.clone();
            self.screen.end_progress();
            self.tell(&report);
            self.reported = Some(report.outcome().into());
        }
        let outcome = self.reported.filter(|_| self.args.exit_when_done)?;
        if self.aircraft.state(self.now()) == State::AtRest {
            return Some(End::Reported(outcome));
        }
        // Without the system nobody would answer for the aircraft.
        if let Some(text) = self.aircraft.await_rest(self.now()) {
            self.screen.line(text);
        }
        None
    }

    pub(super) fn show_progress(&mut self) {
        if self.run_file.is_some() && self.reported.is_none() {
            self.screen.progress(&self.progress, self.now());
        }
    }

    fn tell(&self, report: &MissionReport) {
        self.screen.line(&report::text(report));
        if self.args.json {
            output::line(report::json(report));
        }
    }

    /// Reports the progress of a mission that did not come to its end.
    pub(super) fn unfinished(&self, reason: &str, outcome: Outcome) -> Outcome {
        if self.reported.is_none() {
            self.tell(&self.progress.unfinished(self.config.vehicle.as_str(), reason));
        } else {
            self.screen.log(reason);
        }
        outcome
    }
}
