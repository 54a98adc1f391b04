//! Who flies: Kittiwake; a pilot or another ground station; or the autopilot, by its own failsafe. And whether positions can still be
//! compared with those of the mission.
//!
//! Somebody else who flies is never fought: see the row `somebody_else_flies`. What raises it is what the vehicle's status says
//! ([`domain::fmu::flown_by_other`]), or the skill manager. Once raised it stays up, whatever is said later, since a backend that was started
//! again does not know who commanded what. It falls by an operator's order, which takes control back, or on the ground with motors off;
//! the mission then waits for an operator.

use std::time::Duration;

use domain::contingency::{AUTOPILOT_PREEMPTS, FRAME_MOVED, LEFT_TO_OTHERS, SOMEBODY_ELSE_FLIES};
use domain::flight_state::status_limit;
use domain::geodesy::Origin;
use domain::time::Time;
use domain::wire::InvalidMessage;
use kittiwake_proto::v1;

use super::{SELF, UnplannedLanding, World};
use crate::clients::skills::Sending;
use crate::vehicle::{ConfirmedState, Vehicle};

/// Origins nearer than this to each other are the same place. (ENG: less than the tolerance of any goal.)
const SAME_ORIGIN_M: f64 = 1.0;

/// Time from a command until the status shows that it was obeyed. (MAVLink: a mode is up to 1 s late in the heartbeat; ENG: three of them.)
const OBEYS_WITHIN: Duration = Duration::from_secs(3);

/// Why nothing is flown but a landing where the vehicle is.
pub(crate) const OF_ITS_OWN: &str = "the autopilot flies a failsafe of its own";

/// What is known about who flies.
#[derive(Debug, Default)]
pub(super) struct Control {
    /// An operator has ordered to take control back: then, and when a skill was flown since.
    taking: Option<Taking>,
    /// What the autopilot says about what it flies; empty where it says nothing.
    words: String,
    /// When a skill was pre-empted by the autopilot: until a newer status shows otherwise it still is.
    pre_empted_at: Time,
    /// The autopilot has last been seen, or heard, to fly by itself with its motors on.
    flew_by_itself: bool,
    /// The local frame, and where it had its origin when positions could last be compared with those of the mission.
    frame: Option<Frame>,
    /// It is the frame of a mission that was under way before a restart; and whether it has not been compared with that of now.
    is_remembered: bool,
    awaits_comparison: bool,
}

/// A local frame of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    epoch: u64,
    /// Where it has its origin, if that is known.
    origin: Option<Origin>,
}

impl From<Frame> for v1::MissionFrame {
    fn from(frame: Frame) -> v1::MissionFrame {
        v1::MissionFrame { epoch: frame.epoch, origin: frame.origin.map(Into::into) }
    }
}

impl TryFrom<v1::MissionFrame> for Frame {
    type Error = InvalidMessage;

    fn try_from(frame: v1::MissionFrame) -> Result<Frame, InvalidMessage> {
        Ok(Frame { epoch: frame.epoch, origin: frame.origin.map(Origin::try_from).transpose()? })
    }
}

#[derive(Debug, Clone, Copy, Default)]
struct Taking {
    flown: Option<Time>,
}

impl World {
    /// What the autopilot says about what it flies.
    pub(super) fn autopilot_says(&mut self, words: &str) {
        if self.control.words != words {
            words.clone_into(&mut self.control.words);
        }
    }

    /// A skill has come to be flown.
    pub(super) fn skill_flown(&mut self) {
        if let Some(taking) = &mut self.control.taking {
            taking.flown.get_or_insert(self.now.time);
        }
    }

    /// A skill was pre-empted, for this reason.
    pub(super) fn skill_pre_empted(&mut self, by_other: bool, reason: &str) {
        if by_other {
            return self.somebody_else_flies(reason.to_owned());
        }
        (self.control.pre_empted_at, self.control.flew_by_itself) = (self.now.time, true);
        self.raise(AUTOPILOT_PREEMPTS, SELF, reason);
    }

    /// A pilot or another ground station flies: nothing is commanded any more.
    pub(super) fn somebody_else_flies(&mut self, reason: String) {
        self.control.taking = None;
        self.raise(SOMEBODY_ELSE_FLIES, SELF, reason);
    }

    /// Whether a pilot or another ground station flies the vehicle.
    pub(crate) fn is_flown_by_other(&self) -> bool {
        self.flags.is_up(SOMEBODY_ELSE_FLIES)
    }

    /// Whether the vehicle flies, and nobody else flies it: by a status from since it has lifted off, which would tell; of one that is
    /// silent no more is to be expected.
    pub(crate) fn flies_unattended(&self) -> bool {
        let (Some(vehicle), Some(since)) = (self.vehicle, self.flies_since) else { return false };
        let is_told = since <= vehicle.status_at || status_limit(self.limits.pace) <= self.now.time - since;
        vehicle.flying && is_told && !self.is_flown_by_other()
    }

    /// Whether the autopilot flies a failsafe of its own, which nothing but a landing where the vehicle is, or an operator's order, may end:
    /// the skill manager refuses everything else.
    pub(crate) fn is_left_to_autopilot(&self) -> bool {
        self.flags.is_up(AUTOPILOT_PREEMPTS) && self.vehicle.is_some_and(|it| it.flying)
    }

    /// An operator has ordered to take control back, and the vehicle has not obeyed yet.
    pub(super) fn takes_control(&self) -> bool {
        self.control.taking.is_some()
    }

    /// The same of a process before this one.
    pub(super) fn restore_taking(&mut self, takes_control: bool) {
        self.control.taking = takes_control.then(Taking::default);
    }

    /// How requests for skills are sent now.
    pub(super) fn sending(&self) -> Sending {
        Sending { quietly: self.is_flown_by_other(), takes_control: self.control.taking.is_some() }
    }

    /// An operator orders something that is flown: what was left to others is taken back. Returns whether anything was.
    pub(super) fn take_control_back(&mut self, by: &str) -> bool {
        let left = LEFT_TO_OTHERS.into_iter().filter(|it| self.flags.is_up(it)).collect::<Vec<_>>();
        for flag in &left {
            self.lower(flag);
            self.say("operator", format!("{by} takes control back: `{flag}` no longer counts"));
        }
        if !left.is_empty() {
            self.control.taking = Some(Taking::default());
        }
        !left.is_empty()
    }

    /// Notices who flies.
    pub(super) fn watch_control(&mut self) {
        let Some(vehicle) = self.vehicle else { return };
        let stands = !vehicle.armed && !vehicle.flying;
        let wait = if vehicle.of_other { OBEYS_WITHIN } else { Duration::ZERO };
        let is_known = |it: &Taking| it.flown.is_some_and(|at| at + wait < vehicle.status_at);
        if stands || self.control.taking.as_ref().is_some_and(is_known) {
            // From here on whoever flies is another one, or still the same, whom the order did not reach.
            self.control.taking = None;
        }
        let is_over = self.mission.over.is_some() && !vehicle.flying;
        let is_up = self.is_flown_by_other();
        if vehicle.of_other && !is_up && self.control.taking.is_none() && !is_over {
            let words = if self.control.words.is_empty() { "" } else { ": " };
            let mode = vehicle.mode.map_or_else(|| "a mode without a name here".to_owned(), |it| it.to_string());
            let reason = format!("somebody else has chosen the mode, {mode}{words}{}", self.control.words);
            self.somebody_else_flies(reason);
        } else if is_up && stands && self.has_settled() {
            self.leave_to_operator();
        }
        self.leave_what_autopilot_ended(&vehicle);
        let is_pre_empted = vehicle.pre_empted || vehicle.status_at <= self.control.pre_empted_at;
        if !is_pre_empted && self.flags.is_up(AUTOPILOT_PREEMPTS) {
            self.flags.condition_gone(AUTOPILOT_PREEMPTS, SELF);
        }
        self.watch_frame();
    }

    /// The autopilot has ended a takeoff or a landing by a failsafe of its own, at the ground: nothing begins by itself, whether or not it has
    /// switched the motors off. (After a landing of its own in flight the touchdown says so already.)
    fn leave_what_autopilot_ended(&mut self, vehicle: &Vehicle) {
        if self.control.taking.is_some() {
            // An operator has just ordered to end it.
            self.control.flew_by_itself = false;
            return;
        }
        let is_newer = self.control.pre_empted_at < vehicle.status_at;
        // For a moment each change of the mode looks like one.
        let flies_by_itself = vehicle.pre_empted && vehicle.armed && self.flags.is_up(AUTOPILOT_PREEMPTS);
        if vehicle.flying && !vehicle.near_ground && is_newer {
            // In the air what was interrupted goes on once it is over.
            self.control.flew_by_itself = flies_by_itself;
            return;
        }
        self.control.flew_by_itself |= flies_by_itself;
        let is_left = !vehicle.flying && !flies_by_itself && is_newer;
        if is_left && std::mem::take(&mut self.control.flew_by_itself) && self.mission.over.is_none() {
            let why = "the autopilot has ended a takeoff or a landing by itself".to_owned();
            self.say("contingency", format!("waits for an operator: {why}"));
            self.planner.withdraw(&why);
            self.unplanned_landing.get_or_insert(UnplannedLanding { since: self.now.time, why });
        }
    }

    /// Nobody flies any more, and nothing begins by itself.
    fn leave_to_operator(&mut self) {
        self.lower(SOMEBODY_ELSE_FLIES);
        self.say(
            "contingency",
            format!("`{SOMEBODY_ELSE_FLIES}` is over: the vehicle is on the ground, with its motors off"),
        );
        if self.mission.over.is_none() {
            let why = "somebody else has flown the vehicle".to_owned();
            self.planner.withdraw(&why);
            self.unplanned_landing.get_or_insert(UnplannedLanding { since: self.now.time, why });
        }
    }

    /// The frame that the places of the mission are in, for as long as one is under way.
    pub(super) fn mission_frame(&self) -> Option<Frame> {
        let is_begun = self.mission.started.is_some() || self.control.is_remembered;
        let is_under_way = self.mission.over.is_none() || self.was_flying;
        self.control.frame.filter(|_| is_begun && is_under_way)
    }

    /// The frame of a mission that was under way before a restart.
    pub(super) fn restore_frame(&mut self, frame: Option<Frame>) {
        self.control.frame = frame;
        (self.control.is_remembered, self.control.awaits_comparison) = (frame.is_some(), frame.is_some());
    }

    /// The places of the next mission are in the frame that there is when it begins.
    pub(super) fn forget_frame(&mut self) {
        self.restore_frame(None);
    }

    /// Notices a local frame that is another one than before.
    fn watch_frame(&mut self) {
        let Some(vehicle) = self.vehicle else { return };
        let (epoch, origin) = (vehicle.frame_epoch, vehicle.origin);
        let Some(Frame { epoch: before, origin: reference }) = self.control.frame else {
            self.control.frame = Some(Frame { epoch, origin });
            return;
        };
        let is_same = reference.zip(origin).map(|(a, b)| is_same_place(a, b));
        self.control.frame = Some(Frame { epoch, origin: reference.or(origin.filter(|_| before == epoch)) });
        // If everything was started again at once, epochs may begin at zero again: then only the origins show that the frame is another one.
        let is_another = self.control.awaits_comparison && is_same == Some(false) && !self.flags.is_up(FRAME_MOVED);
        let was_begun = self.mission.started.is_some() || self.control.is_remembered;
        self.control.awaits_comparison &= is_same.is_none();
        if before != epoch || is_another {
            self.confirmed = ConfirmedState::default();
            self.blocked_sites.clear();
            self.planner.withdraw("the autopilot's local frame moved");
            if !was_begun && !vehicle.flying {
                // Nothing was planned in the frame before.
                self.control.frame = Some(Frame { epoch, origin });
            } else if is_same != Some(true) {
                let origins = match is_same {
                    Some(false) => "its origin is another place",
                    _ => "where its origin is, or was, is not known",
                };
                let reason = format!("the autopilot was started again or its local frame moved, and {origins}");
                self.raise(FRAME_MOVED, SELF, reason);
            }
        } else if self.is_planned_elsewhere(origin) {
            self.planner.withdraw("the vehicle's local frame has its origin elsewhere");
        } else if is_same == Some(true) && self.flags.is_up(FRAME_MOVED) {
            self.flags.condition_gone(FRAME_MOVED, SELF);
        }
    }

    /// Whether the present step was planned for a local frame with another origin than this one, by a mission for which that matters.
    fn is_planned_elsewhere(&self, origin: Option<Origin>) -> bool {
        let apart = self.planner.planned_from().zip(origin).is_some_and(|(a, b)| !is_same_place(a, b));
        apart && self.planner.step().is_some() && self.planner.status().origin.is_some()
    }

    /// An operator lets a mission on the ground go on in the frame that there is now. Returns whether another one was.
    ///
    /// # Errors
    /// If the vehicle flies: where it is cannot be known.
    pub(super) fn accept_frame(&mut self) -> Result<bool, String> {
        if !self.flags.is_up(FRAME_MOVED) {
            return Ok(false);
        }
        if self.is_flying() {
            let why = "the local frame has moved, and where the vehicle is in that of the mission is not known";
            return Err(format!("{why}; order an abort, which lands it where it is"));
        }
        self.lower(FRAME_MOVED);
        self.control.frame = self.vehicle.map(|it| Frame { epoch: it.frame_epoch, origin: it.origin });
        Ok(true)
    }
}

fn is_same_place(a: Origin, b: Origin) -> bool {
    let apart_m = a.altitude_m.zip(b.altitude_m).map_or(0.0, |(a, b)| (a - b).abs());
    a.place.distance_m(b.place) < SAME_ORIGIN_M && apart_m < SAME_ORIGIN_M
}
