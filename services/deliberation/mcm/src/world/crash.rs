//! A crash: nothing starts before an operator has said that the vehicle was inspected, in whatever flight, and after every restart.

use super::World;

pub(super) const INSPECT_FIRST: &str = "the vehicle has crashed: inspect it, then order `inspected`";

/// The last crash of the vehicle. Inspected: an operator has said so, and it has not flown since.
pub(super) type Crash = kittiwake_proto::v1::StoredCrash;

impl World {
    /// Why the vehicle has to be inspected before anything starts.
    pub(super) fn uninspected_crash(&self) -> Option<&str> {
        self.landings.crash.as_ref().filter(|it| !it.is_inspected).map(|it| &*it.why)
    }

    /// Whether nothing starts because of a crash: it is inspected first, and started by an operator then.
    pub(super) fn may_not_start_after_crash(&self) -> bool {
        self.landings.crash.as_ref().is_some_and(|it| !it.is_inspected || !self.people.operator.has_started)
    }

    /// An operator says that the vehicle was inspected and may fly.
    pub(super) fn inspected(&mut self) -> Result<String, String> {
        let stands = self.seen.vehicle.is_some_and(|it| !it.flying && !it.armed);
        match &mut self.landings.crash {
            Some(crash) if !crash.is_inspected && stands => crash.is_inspected = true,
            Some(crash) if !crash.is_inspected => return Err("the vehicle is not seen on the ground, disarmed".into()),
            _ => return Err("no crash of the vehicle waits for an inspection".into()),
        }
        let next = if self.over().is_some() { "upload the next mission, then start it" } else { "start the mission" };
        Ok(format!("the vehicle may fly again: {next}"))
    }
}
