//! The processes that were lost, until their successors are heard.

use std::time::{Duration, Instant};

use kittiwake_proto::topics::Message;

use crate::figures::{How, Loss};
use crate::trouble::Victim;

/// A router that has died passes on nothing for this long, whatever is still on its way.
const ON_ITS_WAY: Duration = Duration::from_millis(100);

/// The losses of a run.
#[derive(Debug, Default)]
pub(super) struct Losses(Vec<Pending>);

/// A loss whose figures may still be missing.
#[derive(Debug)]
struct Pending {
    id: u32,
    at: Instant,
    path_m: f64,
    loss: Loss,
}

impl Losses {
    /// A process is about to be killed or stopped, after this much of the flight.
    pub(super) fn lost(&mut self, victim: Victim, id: u32, how: How, path_m: f64) {
        let loss = Loss { victim, how, detected_s: None, resumed_s: None, flown_m: 0.0 };
        self.0.push(Pending { id, at: Instant::now(), path_m, loss });
    }

    /// A process that was not missed long enough does not count as lost.
    pub(super) fn continued(&mut self, id: u32) {
        self.0.retain(|it| it.id != id || it.loss.detected_s.is_some());
    }

    /// The power is lost: nobody comes back.
    pub(super) fn power_lost(&mut self) {
        self.0.retain(|it| it.loss.resumed_s.is_some());
    }

    /// The system says something: perhaps that it has noticed a loss.
    pub(super) fn said(&mut self, line: &str) {
        let noticed = |it: &&mut Pending| match it.loss.how {
            How::Hung => line.starts_with(&format!("{} does not answer ", it.loss.victim)),
            _ => line.starts_with(&format!("{} ended ", it.loss.victim)),
        };
        // A process that is back was noticed, even without a message: one that was stopped and then killed.
        let is_open = |it: &&mut Pending| it.loss.detected_s.is_none() && it.loss.resumed_s.is_none();
        if let Some(it) = self.0.iter_mut().filter(is_open).find(noticed) {
            it.loss.detected_s = Some(it.at.elapsed().as_secs_f64());
        }
    }

    /// Somebody is heard: perhaps the successor of one that was lost.
    pub(super) fn heard(&mut self, message: &Message, path_m: f64) {
        for it in self.0.iter_mut().filter(|it| it.loss.resumed_s.is_none()) {
            let since_s = it.at.elapsed().as_secs_f64();
            let is_after = it.loss.detected_s.is_some_and(|at_s| at_s + ON_ITS_WAY.as_secs_f64() < since_s);
            let is_back = match (it.loss.victim, message) {
                // Not before it is known where the vehicle is by now.
                (Victim::Router, Message::VehicleLocalPosition(_)) => is_after,
                (Victim::GroundRouter, Message::PermissionLedger(_)) => is_after,
                (victim, Message::Heartbeat(beat)) => {
                    victim.nodes().contains(&beat.service.as_str()) && beat.pid != it.id
                }
                _ => false,
            };
            if is_back {
                it.loss.resumed_s = Some(since_s);
                it.loss.flown_m = path_m - it.path_m;
            }
        }
    }

    /// The figures.
    pub(super) fn figures(self) -> Vec<Loss> {
        self.0.into_iter().map(|it| it.loss).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kittiwake_proto::v1;

    fn beat(service: &str, pid: u32) -> Message {
        v1::Heartbeat { service: service.into(), pid, ..Default::default() }.into()
    }

    #[test]
    fn one_that_was_stopped_and_then_killed_is_back_though_nobody_said_that_it_hung() {
        let mut losses = Losses::default();
        losses.lost(Victim::Planner, 1, How::Hung, 0.0);
        losses.lost(Victim::Planner, 1, How::Killed, 10.0);
        losses.said("planner ended by signal 9; it is started again");
        losses.heard(&beat("planner", 1), 20.0);
        losses.heard(&beat("monitor", 2), 20.0);
        losses.heard(&beat("planner", 3), 30.0);
        // Of another one, later.
        losses.said("planner does not answer to its watchdog: it is killed");
        let found = losses.figures();
        let of = |it: &Loss| (it.how, it.detected_s.is_some(), it.resumed_s.is_some(), it.flown_m);
        let expected = [(How::Hung, false, true, 30.0), (How::Killed, true, true, 20.0)];
        assert_eq!(found.iter().map(of).collect::<Vec<_>>(), expected);
    }
}
