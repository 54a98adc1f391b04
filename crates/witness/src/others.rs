//! Whether the vehicle is commanded while a pilot, another ground station or a failsafe of the autopilot flies it.

use std::time::Duration;

use domain::time::Time;
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use kittiwake_proto::v1::vehicle_command::Command;

use crate::Breach;

/// Who else flies, as the status says.
#[derive(Debug, Default)]
pub(crate) struct Others {
    other: Flies,
    failsafe: Flies,
}

/// Whether one of them flies, and since when, if no operator has ordered anything since.
#[derive(Debug, Default)]
struct Flies {
    now: bool,
    unordered_since: Option<Time>,
}

impl Flies {
    fn hear(&mut self, at: Time, flies: bool) {
        if std::mem::replace(&mut self.now, flies) != flies {
            self.unordered_since = flies.then_some(at);
        }
    }

    /// Whether a command sent now ignores that: there was time to hear, and no operator ordered anything. Reported
    /// once.
    fn is_defied(&mut self, at: Time, hears: Duration) -> bool {
        self.unordered_since.take_if(|since| *since + hears < at).is_some()
    }
}

impl Others {
    /// Whether a pilot or another ground station flies.
    pub(crate) fn fly(&self) -> bool {
        self.other.now
    }

    /// A message passes by, of a vehicle that `flies` or not; who commands has heard a status after the time `hears`.
    pub(crate) fn take_in(&mut self, at: Time, message: &Message, flies: bool, hears: Duration) -> Option<Breach> {
        match message {
            Message::VehicleStatus(it) => {
                self.other.hear(at, domain::fmu::Status::from(it.clone()).is_flown_by_other());
                self.failsafe.hear(at, is_own_failsafe(it));
            }
            Message::DecisionRecord(it) if it.kind() == v1::DecisionKind::OrderAccepted => {
                (self.other.unordered_since, self.failsafe.unordered_since) = (None, None);
            }
            Message::TrajectorySetpoint(_) | Message::VehicleCommand(_) if self.other.is_defied(at, hears) => {
                return Some(Breach::Fought { at });
            }
            // A landing on the spot may end it, and so may the motors' end on the ground.
            Message::VehicleCommand(v1::VehicleCommand {
                command: Some(Command::SetMode(_) | Command::Takeoff(_)),
                ..
            }) if flies && self.failsafe.is_defied(at, hears) => return Some(Breach::EndedFailsafe { at }),
            _ => {}
        }
        None
    }
}

/// Whether the autopilot flies a failsafe, and says that it is not for want of setpoints.
fn is_own_failsafe(status: &v1::VehicleStatus) -> bool {
    status.armed && status.failsafe && status.failsafe_reason() == v1::FailsafeReason::Other
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failsafe_of_the_autopilot_is_ended_by_a_landing_and_by_an_order_given_since() {
        const LOITER: Command = Command::SetMode(v1::SetMode { mode: v1::FlightMode::Loiter as i32 });
        /// From 10 s on a failsafe flies for this reason; then the order, if any, and the command.
        #[track_caller]
        fn check(reason: v1::FailsafeReason, ordered_s: Option<u64>, commanded_s: u64, command: Command, ends: bool) {
            let mut others = Others::default();
            let status = |failsafe| v1::VehicleStatus {
                armed: true,
                failsafe,
                failsafe_reason: if failsafe { reason as i32 } else { 0 },
                intended_mode: v1::FlightMode::Offboard as i32,
                ..Default::default()
            };
            let order = || v1::DecisionRecord { kind: v1::DecisionKind::OrderAccepted as i32, ..Default::default() };
            let mut seen: Vec<(u64, Message)> = vec![
                (0, status(false).into()),
                (10, status(true).into()),
                (commanded_s, v1::VehicleCommand { id: 1, command: Some(command) }.into()),
            ];
            seen.extend(ordered_s.map(|at| (at, order().into())));
            seen.sort_by_key(|(at, _)| *at);
            let at = |second| Time::after(Duration::from_secs(second));
            let mut breach = |(second, message)| others.take_in(at(second), &message, true, Duration::from_secs(1));
            let breaches: Vec<Breach> = seen.into_iter().filter_map(&mut breach).collect();
            let expected: &[Breach] = if ends { &[Breach::EndedFailsafe { at: at(commanded_s) }] } else { &[] };
            assert_eq!(breaches, expected, "{reason:?} {ordered_s:?} {commanded_s} {command:?}");
        }
        use v1::FailsafeReason::{Other, Setpoints};
        check(Other, None, 20, LOITER, true);
        check(Other, None, 20, Command::Takeoff(v1::TakeoffCommand { altitude_m: 30.0 }), true);
        check(Other, None, 20, Command::Land(v1::LandCommand::default()), false);
        check(Other, None, 20, Command::Release(v1::ReleaseCommand {}), false);
        check(Setpoints, None, 20, LOITER, false);
        check(Other, Some(15), 20, LOITER, false);
        // What was ordered before says nothing about it, and what was sent before it was heard of does not count.
        check(Other, Some(5), 20, LOITER, true);
        check(Other, None, 5, LOITER, false);
        check(Other, None, 10, LOITER, false);
    }
}
