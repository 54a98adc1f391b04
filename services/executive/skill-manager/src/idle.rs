//! The vehicle in the air that no skill flies: held, after a moment for the next skill to come.

use domain::time::{Now, Time};
use kittiwake_proto::v1::FlightMode;

use crate::commands::{Answer, Command, Purpose};
use crate::executor::Executor;
use crate::vehicle::View;

/// Nothing flies the vehicle; its last setpoint is kept alive until loiter is taken.
#[derive(Debug, Clone, Copy)]
pub struct Idle {
    since: Time,
    tries: u32,
}

/// What to do with a vehicle that no skill flies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Care {
    /// It is on the ground, loiters, or is flown by the autopilot's own failsafe: leave it.
    None,
    Loiter,
}

impl Executor {
    /// A skill has ended and its successor is not there yet.
    pub(crate) fn begin_idle(&mut self, now: Time) {
        self.idle.get_or_insert(Idle { since: now, tries: 0 });
    }

    /// The vehicle is looked after, by a skill or by the autopilot.
    pub(crate) fn end_idle(&mut self) {
        self.idle = None;
        self.stream.stop();
    }

    /// When loiter is to be commanded; `None` while something else comes first.
    pub(crate) fn loiter_due(&self) -> Option<Time> {
        let is_free = self.registered.is_none() && self.candidate.is_none() && !self.commands.is_busy();
        let wait = self.pace.limit(self.config.loiter_after_s.seconds());
        self.idle.filter(|_| is_free).map(|it| it.since + wait)
    }

    /// Commands loiter if that is due.
    pub(crate) fn look_after_idle(&mut self, now: Now) {
        if self.loiter_due().is_none_or(|due| now.time < due) {
            return;
        }
        match care(&self.vehicle.view(now.time)) {
            Care::None => self.end_idle(),
            Care::Loiter => self.send(Command::Loiter, Purpose::Idle, now),
        }
    }

    /// The autopilot has answered, or not answered, that loiter.
    pub(crate) fn idle_answered(&mut self, answer: &Answer, now: Time) {
        let Some(idle) = self.idle else { return };
        // Also when it was refused: without setpoints the autopilot's own failsafe holds the vehicle.
        self.end_idle();
        let tries = idle.tries + 1;
        if *answer != Answer::Accepted && tries < self.config.loiter_tries {
            self.idle = Some(Idle { since: now, tries });
        }
    }
}

/// Where the data do not tell, loiter: it is refused at worst.
fn care(view: &View) -> Care {
    let loiters = view.status.is_some_and(|it| it.actual == FlightMode::Loiter && it.intended == FlightMode::Loiter);
    let autopilot_flies = view.status.is_some_and(|it| it.failsafe || it.actual != it.intended);
    if view.at_rest_on_ground() == Some(true) || loiters || autopilot_flies { Care::None } else { Care::Loiter }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::Status;

    #[test]
    fn loiter_is_commanded_unless_somebody_looks_after_the_vehicle() {
        #[track_caller]
        fn check(landed: Option<bool>, status: Option<Status>, expected: Care) {
            assert_eq!(care(&View { landed, status, ..View::default() }), expected);
        }
        let flies = |intended, actual| Some(Status { armed: true, intended, actual, failsafe: intended != actual });
        use FlightMode::{Loiter, Offboard, Return, Takeoff};
        check(Some(false), flies(Offboard, Offboard), Care::Loiter);
        check(Some(false), flies(Takeoff, Takeoff), Care::Loiter);
        check(Some(false), flies(Loiter, Loiter), Care::None);
        check(Some(false), flies(Offboard, Return), Care::None);
        check(Some(true), flies(Loiter, Loiter), Care::None);
        check(Some(true), flies(Takeoff, Takeoff), Care::Loiter);
        check(None, None, Care::Loiter);
    }
}
